//! What the kernels of stage 2 must read and write at least.

use crate::raster::Load;

/// 32-bit words that a dispatch of one of stage 2's own kernels must read and write at
/// least; `None` for a kernel of another module.
pub fn minimum_words(kernel: &str, load: &Load) -> Option<f64> {
    let Load {
        splats,
        pixels,
        channels,
        sh_planes,
        ..
    } = *load;
    // Unknowns of the solver.
    let planes = sh_planes * splats;
    Some(match kernel {
        "chroma_loss" => 3.25 * channels * pixels,
        // Picture, wanted a/b and curvature.
        "view_correction_sums" => 3.0 * channels * pixels,
        // A few sums of each view.
        "view_correction" => 0.0,
        "lbfgs_ridge" | "lbfgs_add" | "lbfgs_precondition" => 3.0 * planes,
        "lbfgs_pair" => 8.0 * planes,
        "lbfgs_begin" => 5.0 * planes + 2.0 * splats,
        "lbfgs_dot" | "lbfgs_spread" => 2.0 * planes,
        "lbfgs_step" => 5.0 * planes,
        // One partial sum for every 256 unknowns.
        "lbfgs_judge" | "lbfgs_curvature" | "lbfgs_scale" | "lbfgs_alpha" | "lbfgs_beta" => {
            planes / 256.0
        }
        _ => return None,
    })
}
