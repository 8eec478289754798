//! Densification as 3D Gaussian Splatting publishes it (Kerbl et al. 2023): small Gaussians
//! that are pulled at are cloned, large ones split in two, large and faint ones removed.
//!
//! Sizes in the picture are not looked at: the released code means to remove what is wider than
//! 20 pixels, but forgets those widths just before.

use std::f64::consts::{LN_2, TAU};

use super::{
    LumaSettings,
    densify::{Descent, Evidence, plan_by, survivor},
};
use crate::{raster::constants::*, splats::Splats};

/// Largest standard deviation of what is cloned, in scene extents; what is larger is split.
const CLONED: f64 = 0.01;

/// Largest standard deviation of what stays once opacities were reset, in scene extents.
const LARGEST: f64 = 0.1;

/// Divisor of the scales of a Gaussian that is split in two.
const SPLIT_BY: f64 = 1.6;

/// Opacities of the first Gaussians, and at most after a reset.
const FIRST_OPACITY: f64 = 0.1;
const RESET_OPACITY: f64 = 0.01;

/// Circumstances of a densification.
pub struct Moment {
    /// Iterations done: the seed of where halves go.
    pub iteration: usize,
    /// The scene's extent.
    pub extent: f64,
    /// True if large Gaussians are removed.
    pub removes_large: bool,
}

/// Plans one densification. Halves are samples of the Gaussian that is split; clones and halves
/// have no moments yet.
pub fn plan(settings: &LumaSettings, evidence: &Evidence<'_>, moment: &Moment) -> Vec<Descent> {
    let n = evidence.geometry.len() / GEOMETRY_PLANES;
    let largest = |i: usize| {
        let axes = (0..3).map(|axis| evidence.geometry[(PLANE_LOG_SCALE + axis) * n + i]);
        f64::from(axes.fold(f32::NEG_INFINITY, f32::max)).exp()
    };
    // The golden ratio's bits keep the iterations' seeds apart.
    let seed = (moment.iteration as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mut random = fastrand::Rng::with_seed(settings.seed ^ seed);
    let divided = |i: usize| {
        let original = survivor(i);
        if largest(i) <= CLONED * moment.extent {
            let clone = Descent {
                survives: 0,
                ..original
            };
            return [original, clone];
        }
        [(); 2].map(|()| Descent {
            offset: [(); 3].map(|()| normal(&mut random)),
            log_growth: [-SPLIT_BY.ln() as f32; 3],
            survives: 0,
            ..original
        })
    };
    let stays = |descent: &Descent| {
        let growth = f64::from(descent.log_growth[0]).exp();
        let size = largest(descent.source as usize) * growth;
        !moment.removes_large || size <= LARGEST * moment.extent
    };
    plan_by(settings, evidence, divided, stays)
}

/// A sample of the standard normal distribution (Box and Muller 1958).
fn normal(random: &mut fastrand::Rng) -> f32 {
    let (u, v) = (random.f64(), random.f64());
    ((-2.0 * (1.0 - u).ln()).sqrt() * (TAU * v).cos()) as f32
}

fn logit(opacity: f64) -> f32 {
    (opacity / (1.0 - opacity)).ln() as f32
}

/// Makes the first Gaussians, half as wide as they are apart, twice as wide, and thin.
pub fn begin(splats: &mut Splats) {
    let scales = splats.log_scales.as_flattened_mut();
    scales.iter_mut().for_each(|scale| *scale += LN_2 as f32);
    splats.opacity_logits.fill(logit(FIRST_OPACITY));
}

/// Lowers opacity logits to that of the opacity which a reset leaves.
pub fn reset(logits: &mut [f32]) {
    let most = logit(RESET_OPACITY);
    let higher = logits.iter_mut().filter(|logit| **logit > most);
    higher.for_each(|logit| *logit = most);
}
