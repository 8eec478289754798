//! Other ways to color the same geometry after a teacher's pictures, to compare with.

use std::{ops::ControlFlow, sync::Arc, time::Instant};

use serde::Serialize;

use super::{
    ColoredScene, EvalError, MeasuredTeacher, Observer, Progress, Task as Step,
    picture::{gray_picture, to_picture},
};
use crate::{
    chroma::{
        ChromaProgress, ChromaSettings, FrozenViews, MemoryBudget, Recipe, Targets, Task, fit_rgb,
        follow_recipe, masked_weights, native_rgb,
    },
    raster::{ColorKind, Raster},
    report::{Method, PeerReport},
    splats::{ShField, sh},
};

/// Rounds for RGB splats, nearly four times those of chroma: harmonics of degree 3 settle
/// more slowly than a color for each Gaussian.
const RGB_ROUNDS: usize = 45;

/// Another way to color a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Peer {
    /// RGB harmonics of degree 3 by least squares, as splat trainers have them.
    RgbSplats,
    /// [`Recipe::chromadistill_paper`].
    ChromadistillPaper,
    /// [`Recipe::chromadistill_one_scale`].
    ChromadistillOneScale,
    /// [`Recipe::chromadistill_code`].
    ChromadistillCode,
    /// [`Recipe::chromadistill_rgb`].
    ChromadistillRgb,
}

impl Peer {
    /// Method name of its pictures.
    pub fn method(self) -> Method {
        match self {
            Self::RgbSplats => Method::RgbSplats,
            Self::ChromadistillPaper => Method::ChromadistillPaper,
            Self::ChromadistillOneScale => Method::ChromadistillOneScale,
            Self::ChromadistillCode => Method::ChromadistillCode,
            Self::ChromadistillRgb => Method::ChromadistillRgb,
        }
    }

    fn recipe(self) -> Option<Recipe> {
        match self {
            Self::RgbSplats => None,
            Self::ChromadistillPaper => Some(Recipe::chromadistill_paper()),
            Self::ChromadistillOneScale => Some(Recipe::chromadistill_one_scale()),
            Self::ChromadistillCode => Some(Recipe::chromadistill_code()),
            Self::ChromadistillRgb => Some(Recipe::chromadistill_rgb()),
        }
    }

    /// RGB splats on the run's geometry, fitted to the teacher's pictures of the training
    /// views, whose exposures and masks they are told; and what that took. `seed` is that of
    /// the views' order.
    pub fn color(
        self,
        raster: &Arc<Raster>,
        scene: &ColoredScene,
        teacher: &MeasuredTeacher,
        seed: u64,
        memory_limit: Option<u64>,
        observe: &mut Observer<'_>,
    ) -> Result<(ShField, PeerReport), EvalError> {
        let name = self.method().to_string();
        observe(Progress {
            task: Step::Peer,
            done: 0,
            total: 0,
            name: &name,
        });
        let dataset = &scene.dataset;
        let recipe = self.recipe();
        let scales = recipe.as_ref().map_or(1, Recipe::target_scales);
        let mut targets = Targets::new(scales);
        let (mut tasks, mut cameras) = (Vec::new(), Vec::new());
        dataset.visit(&dataset.split.train, |view, photo| {
            let Some(answer) = teacher.answer(view)? else {
                return Ok(());
            };
            let colored = native_rgb(&gray_picture(photo), &to_picture(&answer));
            let wanted = scene.reference(view, photo).unexposed(&colored);
            let weights = masked_weights(None, photo);
            let size = [photo.width, photo.height];
            tasks.push(Task {
                view: cameras.len(),
                target: targets.push_rgb(size, &wanted, weights.as_deref())?,
            });
            cameras.push(dataset.cameras[view].clone());
            Ok::<_, EvalError>(())
        })?;
        if tasks.is_empty() {
            return Err(EvalError::NothingTaught);
        }
        let begun = Instant::now();
        let room = MemoryBudget {
            limit: memory_limit,
            color: ColorKind::Rgb,
            sh_degree: sh::MAX_DEGREE,
            weighted: targets.weighted(),
            streams: false,
        };
        let (luma, extent) = (&scene.luma, dataset.extent);
        let frozen = FrozenViews::new(raster, luma, extent, &cameras, scales, room)?;
        let (mut iterations, mut passes) = (0, 0.0);
        let mut told = |progress: ChromaProgress| {
            (iterations, passes) = (progress.iteration, progress.passes);
            observe(Progress {
                task: Step::Peer,
                done: progress.iteration,
                total: progress.total,
                name: &name,
            });
            ControlFlow::Continue(())
        };
        let field = match recipe {
            Some(recipe) => {
                follow_recipe(&frozen, &recipe, &targets, tasks, luma, seed, &mut told)?
            }
            None => fit_rgb(&frozen, &rgb_settings(), &targets, tasks, &mut told)?,
        };
        let report = PeerReport {
            method: self.method(),
            iterations,
            passes,
            seconds: begun.elapsed().as_secs_f64(),
        };
        Ok((field, report))
    }
}

/// Solver settings of the RGB splats.
fn rgb_settings() -> ChromaSettings {
    ChromaSettings {
        sh_degree: sh::MAX_DEGREE,
        robust: None,
        correct_views: false,
        rounds: RGB_ROUNDS,
        settled: 0.0,
        anchor: 0.0,
        ..ChromaSettings::irls()
    }
}
