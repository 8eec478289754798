//! The luma loss (`shaders/luma_loss.wgsl`).

use crate::{
    gpu::{Bindings, Buffer, Gpu, Kernel, Recorder, shaders},
    optimize::LossLog,
    raster::{Layer, LayerAdjoint, Lists, ViewUniform},
};

/// Pixels on the side of a workgroup's block.
const BLOCK_SIDE: u32 = 16;

/// Workgroups across and down an image.
pub fn blocks(view: &ViewUniform) -> [u32; 2] {
    view.size.map(|side| side.div_ceil(BLOCK_SIDE))
}

/// The two passes.
pub struct LossKernels {
    forward: Kernel,
    backward: Kernel,
}

impl LossKernels {
    /// Compiles them.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            forward: Kernel::new(gpu, "luma_loss", shaders::LUMA_LOSS),
            backward: Kernel::new(gpu, "luma_loss_backward", shaders::LUMA_LOSS),
        }
    }
}

/// The loss of a layer against one photograph.
pub struct Loss {
    forward: Bindings,
    backward: Bindings,
}

impl Loss {
    /// Ties the layer's image to `photo` (8-bit gray, four pixels a word).
    /// `slopes` are three buffers with room for a float a pixel.
    #[allow(
        clippy::too_many_arguments,
        reason = "each is a buffer of its own that the kernel binds"
    )]
    pub fn new(
        gpu: &Gpu,
        kernels: &LossKernels,
        lists: &Lists,
        layer: &Layer,
        adjoint: &LayerAdjoint,
        log: &LossLog,
        slopes: &[Buffer<f32>; 3],
        photo: &Buffer<u32>,
    ) -> Self {
        let [by_mean, by_square, by_product] = slopes.each_ref().map(Buffer::raw);
        let inputs = [lists.view.raw(), layer.image.raw(), photo.raw()];
        let mut bindings: Vec<_> = (0..)
            .zip(inputs.into_iter().chain([by_mean, by_square, by_product]))
            .collect();
        bindings.push((6, log.block_losses.raw()));
        let forward = kernels.forward.bind_at(gpu, &bindings);
        bindings[6] = (7, adjoint.image_gradient.raw());
        let backward = kernels.backward.bind_at(gpu, &bindings);
        Self { forward, backward }
    }

    /// Records both passes.
    pub fn record(&self, kernels: &LossKernels, recorder: &mut Recorder, view: &ViewUniform) {
        let [x, y] = blocks(view);
        recorder.dispatch_grid(&kernels.forward, &self.forward, x, y);
        recorder.dispatch_grid(&kernels.backward, &self.backward, x, y);
    }
}

/// Packs 8-bit pixels four to a word, the first in the lowest byte.
pub fn pack(gray: &[u8]) -> Vec<u32> {
    gray.chunks(4)
        .map(|bytes| {
            let mut word = [0; 4];
            word[..bytes.len()].copy_from_slice(bytes);
            u32::from_le_bytes(word)
        })
        .collect()
}
