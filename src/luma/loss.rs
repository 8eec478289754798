//! The luma loss (`shaders/luma_loss.wgsl`).

use bytemuck::{Pod, Zeroable};

use super::{SsimWindow, photos::Photos};
use crate::{
    capture::Exposure,
    gpu::{Bindings, Buffer, Gpu, GpuError, Kernel, Recorder, shaders},
    raster::{Layer, LayerAdjoint, Lists, LossLog, ViewUniform},
};

/// Pixels on the side of a workgroup's block.
const BLOCK_SIDE: u32 = 16;

/// Workgroups across and down an image.
pub fn blocks(view: &ViewUniform) -> [u32; 2] {
    view.size.map(|side| side.div_ceil(BLOCK_SIDE))
}

/// What the loss reckons with. What it does not is neither in the compiled kernels nor
/// in any buffer.
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
    /// What the picture is multiplied by to be the photo's.
    pub gain: f32,
    /// What is added then.
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

/// What the pictures are compared with, and room to do so.
pub struct Targets {
    /// The photos.
    pub photos: Photos,
    /// Their masks in the same order, if pixels count differently.
    pub masks: Option<Photos>,
    /// If photos differ in exposure.
    pub parameters: Option<Buffer<LumaLossParameters>>,
    /// Three buffers with room for a float a pixel.
    pub slopes: [Buffer<f32>; 3],
}

impl Targets {
    /// Photos as 8-bit gray and their masks; empty masks if `effects` has none.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        gpu: &Gpu,
        effects: LossEffects,
        photos: &[Vec<u8>],
        masks: &[Vec<u8>],
        streamed: bool,
    ) -> Result<Self, GpuError> {
        let packed =
            |pictures: &[Vec<u8>]| Photos::new(gpu, pictures.iter().map(Vec::as_slice), streamed);
        let largest = photos.iter().map(Vec::len).max().unwrap_or(0);
        let slopes = || Buffer::zeros(gpu, "slopes", largest);
        let unset = LumaLossParameters::zeroed();
        Ok(Self {
            photos: packed(photos)?,
            masks: effects.masked.then(|| packed(masks)).transpose()?,
            parameters: (effects.exposed)
                .then(|| Buffer::uniform(gpu, "loss parameters", &unset))
                .transpose()?,
            slopes: [slopes()?, slopes()?, slopes()?],
        })
    }

    /// Readies a photo for what is submitted next, and gives its buffers' place.
    pub fn show(&self, gpu: &Gpu, index: usize, exposure: Exposure) -> usize {
        if let Some(masks) = &self.masks {
            masks.show(gpu, index);
        }
        if let Some(buffer) = &self.parameters {
            buffer.write(gpu, &[exposure.into()]);
        }
        self.photos.show(gpu, index)
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
        adjoint: &LayerAdjoint,
        log: &LossLog,
        targets: &Targets,
    ) -> Vec<Self> {
        let [by_mean, by_square, by_product] = targets.slopes.each_ref().map(Buffer::raw);
        (targets.photos.buffers().iter().enumerate())
            .map(|(place, photo)| {
                let inputs = [lists.view.raw(), layer.image.raw(), photo.raw()];
                let mut bindings: Vec<_> = (0..)
                    .zip(inputs.into_iter().chain([by_mean, by_square, by_product]))
                    .collect();
                bindings.push((6, log.block_losses.raw()));
                if let Some(masks) = &targets.masks {
                    bindings.push((8, masks.buffers()[place].raw()));
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
