//! Median depth of a view: where the transmittance of its pixels falls to one half.

use super::{Raster, kernels::variant, lists::Lists};
use crate::gpu::{Buffer, GpuError, Kernel, Recorder, shaders};

/// Pixels before any Gaussian, for [`blend_depth`]: minus the transmittance to fall to.
pub const UNREACHED: f32 = -0.5;

/// Records `blend` of depths over a view's tile lists, which have at most `max_tiles` tiles and
/// were recorded before. `pixels` are [`UNREACHED`] or what Gaussians before these left; they
/// become depths along the camera's z axis in world units where they are positive.
///
/// # Errors
/// [`GpuError::TooLarge`].
pub fn blend_depth(
    raster: &Raster,
    lists: &Lists,
    pixels: &[f32],
    max_tiles: usize,
    recorder: &mut Recorder,
) -> Result<Buffer<f32>, GpuError> {
    let gpu = &raster.gpu;
    let cutoffs = raster.numerics.cutoffs();
    let source = variant(gpu, [shaders::BLEND_DEPTH, shaders::BLEND_DEPTH_SIMD]);
    let kernel = Kernel::with(gpu, "blend", source, &cutoffs);
    let image = Buffer::from_slice(gpu, "depth image", pixels)?;
    let buffers = [
        (0, lists.view.raw()),
        (1, lists.starts.raw()),
        (2, lists.slots().raw()),
        (3, lists.instance_splats.raw()),
        (4, lists.projected.raw()),
        (5, lists.depths.raw()),
        (6, image.raw()),
    ];
    let bindings = (lists.portions).bind(gpu, &kernel, &buffers, 8, max_tiles);
    bindings.record(&kernel, recorder);
    Ok(image)
}

/// Depths from what [`blend_depth`] left of a view; NaN where there is none.
pub fn depths(mut pixels: Vec<f32>) -> Vec<f32> {
    for unreached in pixels.iter_mut().filter(|z| **z <= 0.0) {
        *unreached = f32::NAN;
    }
    pixels
}
