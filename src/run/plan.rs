//! `plan`: which effects a capture calls for.

use std::{ops::ControlFlow, path::PathBuf, sync::Arc};

use super::{Observer, Preset, RunError, fit::open_gpu, scene::tell_trial, sound::open_examined};
use crate::{
    capture::LoadOptions,
    effects::{Overrules, Plan},
    luma::planned,
    raster::Raster,
};

/// What `plan` is asked to do; `None` leaves it to the preset.
#[derive(Clone, Debug)]
pub struct PlanOptions {
    /// The COLMAP folder.
    pub colmap_dir: PathBuf,
    /// Amount of work; `paper` on a GPU and `draft` on a software adapter by default.
    pub preset: Option<Preset>,
    /// How photos are loaded; the longer side is the preset's where it is `None`.
    pub load: LoadOptions,
    /// What is on or off whatever the evidence.
    pub overrules: Overrules,
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
    let load = preset.load_options(&options.load, &options.overrules);
    let (dataset, evidence) = open_examined(&options.colmap_dir, &load, observe)?;
    let dataset = Arc::new(dataset);
    let raster = || Ok(Arc::new(Raster::new(&open_gpu(false)?)));
    planned(
        &dataset,
        &evidence,
        preset.work().room(),
        &options.overrules,
        raster,
        &mut |progress| {
            tell_trial(&progress, observe);
            ControlFlow::Continue(())
        },
    )
}
