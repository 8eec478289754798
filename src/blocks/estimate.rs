//! Expected Gaussians, memory and time of a training.

use serde::{Deserialize, Serialize};

use crate::{
    capture::Camera,
    luma::{Demand, LumaSettings, resident_photos},
};

/// Share of an iteration's time that does not depend on the number of Gaussians: a round figure, as
/// it varies with the device and the photos' size.
const FIXED: f64 = 0.5;

/// Expected Gaussians, memory and time of a training.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Estimate {
    /// Gaussians, at the end.
    pub splats: usize,
    /// Bytes of the device, at most.
    pub memory: u64,
    /// Time, against that of all photos with all Gaussians in one training of as many epochs.
    pub time: f64,
}

impl Estimate {
    /// For photos by these cameras and settings, of which the degree of the harmonics and where
    /// photos are held count; `share` is that of the whole capture's photos, `whole` its
    /// Gaussians.
    pub fn of<'a>(
        cameras: impl Iterator<Item = &'a Camera>,
        settings: &LumaSettings,
        splats: usize,
        share: f64,
        whole: usize,
    ) -> Self {
        let demand = Demand::of(
            cameras,
            false,
            settings.sh_degree,
            resident_photos(settings),
        );
        let relative = splats as f64 / whole.max(1) as f64;
        Self {
            splats,
            memory: demand.peak_bytes(splats),
            time: share * (FIXED + (1.0 - FIXED) * relative),
        }
    }
}
