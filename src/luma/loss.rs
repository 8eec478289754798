//! The luma loss (`shaders/luma_loss.wgsl`).

use bytemuck::{Pod, Zeroable};

use std::sync::Arc;

use super::{LumaError, SsimWindow, TrainingViews, photos::Photos};
use crate::{
    capture::Exposure,
    gpu::{Bindings, Buffer, Gpu, Kernel, Recorder, shaders},
    raster::{Layer, Lists, LossLog, LumaAdjoint, ViewUniform},
};

/// Pixels on the side of a workgroup's block.
const BLOCK_SIDE: u32 = 16;

/// Workgroups across and down an image.
pub fn blocks(view: &ViewUniform) -> [u32; 2] {
    view.size.map(|side| side.div_ceil(BLOCK_SIDE))
}

/// Effects in the loss. Those that are off are neither in the compiled kernels nor in any buffer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LossEffects {
    /// Photos differ in exposure.
    pub exposed: bool,
    /// Some pixels do not count.
    pub masked: bool,
}

impl LossEffects {
    /// The kernels that have these effects and no others, with this window.
    pub fn shader(self, window: SsimWindow) -> &'static str {
        use SsimWindow::{Eleven, Five, Seven};
        match (self.exposed, self.masked, window) {
            (false, false, Eleven) => shaders::LUMA_LOSS,
            (false, false, Seven) => shaders::LUMA_LOSS_WINDOW7,
            (false, false, Five) => shaders::LUMA_LOSS_WINDOW5,
            (true, false, Eleven) => shaders::LUMA_LOSS_EXPOSED,
            (true, false, Seven) => shaders::LUMA_LOSS_EXPOSED_WINDOW7,
            (true, false, Five) => shaders::LUMA_LOSS_EXPOSED_WINDOW5,
            (false, true, Eleven) => shaders::LUMA_LOSS_MASKED,
            (false, true, Seven) => shaders::LUMA_LOSS_MASKED_WINDOW7,
            (false, true, Five) => shaders::LUMA_LOSS_MASKED_WINDOW5,
            (true, true, Eleven) => shaders::LUMA_LOSS_EXPOSED_MASKED,
            (true, true, Seven) => shaders::LUMA_LOSS_EXPOSED_MASKED_WINDOW7,
            (true, true, Five) => shaders::LUMA_LOSS_EXPOSED_MASKED_WINDOW5,
        }
    }
}

/// `LumaLossParameters` of the kernels.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct LumaLossParameters {
    /// Factor from scene luma to the photo's.
    pub gain: f32,
    /// Offset added after the factor.
    pub offset: f32,
    /// Nothing.
    pub padding: [u32; 2],
}

impl From<Exposure> for LumaLossParameters {
    fn from(exposure: Exposure) -> Self {
        Self {
            gain: exposure.gain as f32,
            offset: exposure.offset as f32,
            padding: [0; 2],
        }
    }
}

/// The two passes.
pub struct LossKernels {
    forward: Kernel,
    backward: Kernel,
}

impl LossKernels {
    /// Compiles them.
    pub fn new(gpu: &Gpu, effects: LossEffects, window: SsimWindow) -> Self {
        let source = effects.shader(window);
        Self {
            forward: Kernel::new(gpu, "luma_loss", source),
            backward: Kernel::new(gpu, "luma_loss_backward", source),
        }
    }
}

/// Photos to compare renders with, and buffers for the loss.
pub struct Targets {
    /// The photos.
    pub photos: Photos,
    /// If photos differ in exposure.
    pub parameters: Option<Buffer<LumaLossParameters>>,
    /// Three buffers with room for a float a pixel.
    pub slopes: [Buffer<f32>; 3],
}

impl Targets {
    /// Bytes besides the photos.
    pub fn bytes(max_pixels: usize) -> u64 {
        4 * 3 * max_pixels as u64
    }

    /// The photos of `views`, of at most so many pixels each; `streams` is whether they come to
    /// the device one by one.
    pub fn new(
        gpu: &Gpu,
        effects: LossEffects,
        views: &Arc<dyn TrainingViews>,
        max_pixels: usize,
        streams: bool,
    ) -> Result<Self, LumaError> {
        let slopes = || Buffer::zeros(gpu, "slopes", max_pixels);
        let unset = LumaLossParameters::zeroed();
        Ok(Self {
            photos: Photos::new(gpu, views, effects.masked, streams)?,
            parameters: (effects.exposed)
                .then(|| Buffer::uniform(gpu, "loss parameters", &unset))
                .transpose()?,
            slopes: [slopes()?, slopes()?, slopes()?],
        })
    }

    /// Readies a photo for what is submitted next, and gives its buffers' place; the photos
    /// of `next` come after it.
    pub fn show(
        &mut self,
        gpu: &Gpu,
        photo: usize,
        exposure: Exposure,
        next: impl Iterator<Item = usize>,
    ) -> Result<usize, LumaError> {
        if let Some(buffer) = &self.parameters {
            buffer.write(gpu, &[exposure.into()]);
        }
        self.photos.show(gpu, photo, next)
    }
}

/// The loss of a layer against one photograph.
pub struct Loss {
    forward: Bindings,
    backward: Bindings,
}

impl Loss {
    /// Ties the layer's image to each buffer that a photo may stand in.
    pub fn all(
        gpu: &Gpu,
        kernels: &LossKernels,
        lists: &Lists,
        layer: &Layer,
        adjoint: &LumaAdjoint,
        log: &LossLog,
        targets: &Targets,
    ) -> Vec<Self> {
        let [by_mean, by_square, by_product] = targets.slopes.each_ref().map(Buffer::raw);
        (targets.photos.pictures().iter())
            .map(|picture| {
                let inputs = [lists.view.raw(), layer.image.raw(), picture.gray.raw()];
                let mut bindings: Vec<_> = (0..)
                    .zip(inputs.into_iter().chain([by_mean, by_square, by_product]))
                    .collect();
                bindings.push((6, log.block_losses.raw()));
                if let Some(mask) = &picture.mask {
                    bindings.push((8, mask.raw()));
                }
                if let Some(parameters) = &targets.parameters {
                    bindings.push((9, parameters.raw()));
                }
                let forward = kernels.forward.bind_at(gpu, &bindings);
                bindings[6] = (7, adjoint.image_gradient.raw());
                let backward = kernels.backward.bind_at(gpu, &bindings);
                Self { forward, backward }
            })
            .collect()
    }

    /// Records both passes.
    pub fn record(&self, kernels: &LossKernels, recorder: &mut Recorder, view: &ViewUniform) {
        let [x, y] = blocks(view);
        recorder.dispatch_grid(&kernels.forward, &self.forward, x, y);
        recorder.dispatch_grid(&kernels.backward, &self.backward, x, y);
    }
}
