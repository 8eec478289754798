//! `plan`: which effects a capture calls for.

use std::{ops::ControlFlow, path::PathBuf, sync::Arc};

use super::{Preset, RunError};
use crate::{
    capture::LoadOptions,
    effects::{Overrules, Plan},
    gpu::Gpu,
    luma::planned,
    raster::Raster,
    subject::{
        scene::of_trial,
        sound::{SoundCapture, Soundness, open_examined},
    },
    tell::{Event, Observer, Stage},
};

/// Options of `plan`; `None` leaves a value to the preset.
#[derive(Clone, Debug)]
pub struct PlanOptions {
    /// The COLMAP folder.
    pub colmap_dir: PathBuf,
    /// Amount of work; `paper` on a GPU and `draft` on a software adapter by default.
    pub preset: Option<Preset>,
    /// Iterations of the training; trials take a share of them.
    pub iterations: Option<usize>,
    /// Options for loading photos; the longer side is the preset's if it is `None`.
    pub load: LoadOptions,
    /// Effects that are on or off regardless of the evidence.
    pub overrules: Overrules,
}

/// Effects that a capture needs, and its soundness.
#[derive(Clone, Debug)]
pub struct PlanReport {
    /// The effects.
    pub plan: Plan,
    /// Agreement of photos and model.
    pub soundness: Soundness,
}

/// Examines a capture as `fit` would.
pub fn plan(options: &PlanOptions, observe: &mut Observer<'_>) -> Result<PlanReport, RunError> {
    let preset = match options.preset {
        Some(preset) => preset,
        None => {
            observe(Event::begins(Stage::Device));
            Preset::for_device(&Gpu::open()?)
        }
    };
    let load = preset.load_options(&options.load, &options.overrules);
    let SoundCapture {
        dataset,
        evidence,
        soundness,
        ..
    } = open_examined(&options.colmap_dir, &load, observe)?;
    let dataset = Arc::new(dataset);
    let mut settings = preset.work().settings;
    settings.iterations = options.iterations.unwrap_or(settings.iterations);
    let raster = || Ok(Arc::new(Raster::new(&Gpu::open()?)));
    let plan = planned(
        &dataset,
        &evidence,
        &settings,
        &options.overrules,
        raster,
        &mut |progress| {
            observe(of_trial(&progress));
            ControlFlow::Continue(())
        },
    );
    plan.map(|plan| PlanReport { plan, soundness })
}
