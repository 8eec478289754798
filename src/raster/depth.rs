//! Median depth of a view: where the transmittance of its pixels falls to one half.

use super::{Raster, lists::Lists, portions::TileBindings};
use crate::gpu::{Buffer, GpuError, Kernel, Recorder, shaders};

/// Pixels before any Gaussian, for [`DepthLayer::new`]: minus the transmittance to fall to.
pub const UNREACHED: f32 = -0.5;

/// `blend` of depths over a view's tile lists.
pub struct DepthLayer {
    image: Buffer<f32>,
    kernel: Kernel,
    blend: TileBindings,
}

impl DepthLayer {
    /// A layer for one view of at most `max_tiles` tiles, whose pixels are [`UNREACHED`] or what a
    /// layer of the Gaussians before these left.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        raster: &Raster,
        lists: &Lists,
        pixels: &[f32],
        max_tiles: usize,
    ) -> Result<Self, GpuError> {
        let gpu = &raster.gpu;
        let cutoffs = raster.numerics.cutoffs();
        let kernel = Kernel::with(gpu, "blend", shaders::BLEND_DEPTH, &cutoffs);
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
        Ok(Self {
            blend: (lists.portions).bind(gpu, &kernel, &buffers, 8, max_tiles),
            image,
            kernel,
        })
    }

    /// Records blending; the lists must have been recorded before.
    pub fn record(&self, recorder: &mut Recorder) {
        self.blend.record(&self.kernel, recorder);
    }

    /// Reads the pixels: depths along the camera's z axis in world units where they are positive.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn read(&self, raster: &Raster) -> Result<Vec<f32>, GpuError> {
        self.image.read(&raster.gpu)
    }
}

/// Depths from what layers left of a view; NaN where there is none.
pub fn depths(mut pixels: Vec<f32>) -> Vec<f32> {
    for unreached in pixels.iter_mut().filter(|z| **z <= 0.0) {
        *unreached = f32::NAN;
    }
    pixels
}
