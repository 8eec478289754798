//! Settings of a preset for a device and photos.

use serde::{Deserialize, Serialize};

use crate::{
    capture::LoadOptions,
    effects::{Effect, Overrules},
    gpu::Gpu,
    luma::{LumaOverlay, LumaSettings, Preset},
};

/// An amount of work.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Workload {
    /// Settings of luma training.
    pub settings: LumaSettings,
    /// Longer side of the photos.
    pub max_side: Option<u32>,
}

impl Workload {
    /// A preset's where nothing else is asked for.
    pub fn asked(preset: Preset, overlay: &LumaOverlay, max_side: Option<u32>) -> Self {
        let mut work = preset.work();
        overlay.apply(&mut work.settings);
        work.max_side = max_side.or(work.max_side);
        work
    }
}

impl Preset {
    /// Default preset of a device.
    pub(crate) fn for_device(gpu: &Gpu) -> Self {
        if gpu.is_software() {
            Self::Draft
        } else {
            Self::Paper
        }
    }

    /// As much work as it is.
    pub(crate) fn work(self) -> Workload {
        Workload {
            settings: self.settings(),
            max_side: self.max_side(),
        }
    }

    /// Iterations of Adam in stage 2.
    pub(crate) fn adam_iterations(self) -> usize {
        match self {
            Self::Draft => 150,
            Self::Balanced => 3_000,
            Self::Paper => 15_000,
        }
    }

    /// The options with the preset's longer side where they leave it open, and with
    /// what is overruled about the lens.
    pub(crate) fn load_options(self, asked: &LoadOptions, overrules: &Overrules) -> LoadOptions {
        LoadOptions {
            max_side: asked.max_side.or(self.max_side()),
            lens: overrules.choice(Effect::Lens),
            ..asked.clone()
        }
    }
}
