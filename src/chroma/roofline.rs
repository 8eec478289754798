//! Words that the kernels of stage 2 must read and write at least.

use crate::raster::Load;

/// 32-bit words that a dispatch of one of stage 2's own kernels must read and write at
/// least; `None` for a kernel of another module.
pub fn minimum_words(kernel: &str, load: &Load) -> Option<f64> {
    let Load {
        splats,
        pixels,
        sh_planes,
        ..
    } = *load;
    // Unknowns of the solver.
    let planes = sh_planes * splats;
    Some(match kernel {
        // Picture, wanted a/b, gradient and curvature.
        "chroma_loss" => 7.0 * pixels,
        // Picture, wanted RGB, gradient and curvature.
        "rgb_loss" => 9.0 * pixels,
        // Picture, wanted RGB, gradient.
        "lab_loss" => 8.0 * pixels,
        // Picture, wanted a/b and curvature.
        "view_correction_sums" => 5.0 * pixels,
        // A few sums of each view.
        "view_correction" => 0.0,
        "lbfgs_ridge" => 4.0 * planes + 2.0 * splats,
        "lbfgs_anchor" => 2.0 * planes + 4.0 * splats,
        "lbfgs_add" | "lbfgs_precondition" => 3.0 * planes,
        "lbfgs_pair" => 8.0 * planes,
        "lbfgs_begin" => 5.0 * planes + 4.0 * splats,
        "lbfgs_dot" | "lbfgs_spread" | "lbfgs_moved" => 2.0 * planes,
        "lbfgs_step" => 5.0 * planes,
        // One partial sum for every 256 unknowns.
        "lbfgs_judge" | "lbfgs_curvature" | "lbfgs_scale" | "lbfgs_mean" | "lbfgs_alpha"
        | "lbfgs_beta" | "lbfgs_slope" => planes / 256.0,
        _ => return None,
    })
}
