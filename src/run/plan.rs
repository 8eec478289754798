//! `plan`: which effects a capture calls for, without training.

use std::path::PathBuf;

use super::{Observer, Preset, RunError, fit::open_gpu, scene::Scene};
use crate::effects::{Overrules, Plan};

/// What `plan` is asked to do; `None` leaves it to the preset.
#[derive(Clone, Debug)]
pub struct PlanOptions {
    /// The COLMAP folder.
    pub colmap_dir: PathBuf,
    /// Amount of work; `paper` on a GPU and `draft` on a software adapter by default.
    pub preset: Option<Preset>,
    /// Longer side of the photos in pixels.
    pub max_side: Option<u32>,
    /// What is on or off whatever the evidence.
    pub overrules: Overrules,
    /// Whether every 8th view is held out.
    pub holdout: bool,
}

/// Examines a capture as `fit` would.
///
/// # Errors
/// [`RunError`].
pub fn plan(options: &PlanOptions, observe: &mut Observer<'_>) -> Result<Plan, RunError> {
    let preset = match options.preset {
        Some(preset) => preset,
        None => Preset::for_device(&open_gpu(false)?),
    };
    let amounts = preset.amounts();
    let max_side = options.max_side.or(amounts.max_side);
    let scene = Scene::load(&options.colmap_dir, max_side, options.holdout, observe)?;
    Ok(scene.plan(amounts.sh_degree, &options.overrules))
}
