//! Short trainings that tell what the photos alone do not.

use std::{ops::ControlFlow, sync::Arc};

use super::{
    LumaError, LumaSettings, LumaTrainer, PlannedViews, TrainingView, start::placed_splats,
};
use crate::{
    capture::{Dataset, Exposure},
    effects::{Evidence, Overrules, Plan, Room},
    raster::Raster,
};

/// Iterations of a trial: with 150 there is no scene yet that could fit one way or the other.
const ITERATIONS: usize = 400;

/// Its cap on Gaussians, and how large and how many its photos are at most: half the work of
/// the least scene (`Amounts::SKETCH`), twice.
const MAX_SPLATS: usize = 3_000;
const MAX_SIDE: u32 = 160;
const MAX_VIEWS: usize = 32;

/// How far a trial is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrialProgress {
    /// Iterations done, of both trainings.
    pub done: usize,
    /// Iterations in all.
    pub total: usize,
    /// Whether the present training knows the exposures.
    pub exposed: bool,
}

/// The plan of a capture, after a trial on the device that `raster` gives where it needs one.
///
/// # Errors
/// Those of `raster`, and [`LumaError`] of a photo or of the device.
pub fn planned<E: From<LumaError>>(
    dataset: &Arc<Dataset>,
    evidence: &Evidence,
    room: Room,
    overrules: &Overrules,
    raster: impl FnOnce() -> Result<Arc<Raster>, E>,
    observe: &mut dyn FnMut(TrialProgress) -> ControlFlow<()>,
) -> Result<Plan, E> {
    let plan = evidence.decide(room, overrules, None);
    if !plan.needs_trial() {
        return Ok(plan);
    }
    let gain = exposure_gain(dataset, evidence, &raster()?, &plan, observe)?;
    Ok(evidence.decide(room, overrules, Some(gain)))
}

/// Per cent by which a small scene that is trained with the plan's exposures has less loss
/// than one trained without.
fn exposure_gain(
    dataset: &Arc<Dataset>,
    evidence: &Evidence,
    raster: &Arc<Raster>,
    plan: &Plan,
    observe: &mut dyn FnMut(TrialProgress) -> ControlFlow<()>,
) -> Result<f64, LumaError> {
    let told = |which, iteration| TrialProgress {
        done: which * ITERATIONS + iteration,
        total: 2 * ITERATIONS,
        exposed: which == 0,
    };
    if observe(told(0, 0)).is_break() {
        return Err(LumaError::Cancelled);
    }
    let views = PlannedViews::new(dataset.clone(), evidence, plan);
    let train = &dataset.split.train;
    let count = train.len().min(MAX_VIEWS);
    let exposed: Vec<TrainingView> = (0..count)
        .map(|k| views.of(train[k * train.len() / count]).map(small))
        .collect::<Result<_, _>>()?;
    let mut unexposed = exposed.clone();
    for view in &mut unexposed {
        view.exposure = Exposure::NONE;
    }
    let settings = LumaSettings {
        sh_degree: 0,
        max_splats: MAX_SPLATS,
        ..LumaSettings::new(ITERATIONS)
    };
    let start = placed_splats(dataset, evidence, &settings)?;
    let mut losses = [0.0; 2];
    for (which, (views, loss)) in [exposed, unexposed]
        .into_iter()
        .zip(&mut losses)
        .enumerate()
    {
        let (raster, settings) = (raster.clone(), settings.clone());
        LumaTrainer::new(raster, settings, dataset.extent, &start, views)?.train_while(
            &mut |progress| {
                *loss = progress.loss;
                observe(told(which, progress.iteration))
            },
        )?;
    }
    let [with, without] = losses;
    Ok(100.0 * (1.0 - with / without))
}

/// The same photo, halved until it is small.
fn small(view: TrainingView) -> TrainingView {
    let mut view = view;
    while view.camera.width.max(view.camera.height) > MAX_SIDE {
        view = view.halved();
    }
    view
}
