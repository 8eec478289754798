//! Minimum memory traffic of the kernels of stage 1.

use crate::raster::{Load, constants::GEOMETRY_PLANES};

/// Planes of geometry.
const GEOMETRY: f64 = GEOMETRY_PLANES as f64;

/// 32-bit words that a dispatch of one of stage 1's own kernels must read and write at
/// least; `None` for a kernel of another module.
pub fn minimum_words(kernel: &str, load: &Load) -> Option<f64> {
    let Load {
        splats,
        pixels,
        sh_planes,
        ..
    } = *load;
    Some(match kernel {
        // The photo has four pixels a word.
        "luma_loss" => 4.25 * pixels,
        "luma_loss_backward" => 5.25 * pixels,
        "densify_geometry" => 2.0 * GEOMETRY * splats,
        "densify_sh" => 2.0 * sh_planes * splats,
        // The average of those of geometry and harmonics.
        "densify_moments" => (GEOMETRY + sh_planes) * splats,
        _ => return None,
    })
}
