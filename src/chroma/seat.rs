//! Where a view is drawn and judged: buffers and bindings of one pass.

use super::{
    ChromaError,
    correction::CorrectionParameters,
    loss::{ChromaLossWeights, LabLossParameters, RgbLossParameters},
    passes::{Passes, Space},
};
use crate::{
    gpu::{Bindings, Buffer},
    raster::{AdjointScratch, Canvas, ChromaAdjoint, ChromaSums, ColorKind, Layer},
};

/// A loss tied to what it judges.
pub(super) enum Judge {
    Chroma {
        weights: Buffer<ChromaLossWeights>,
        loss: Bindings,
        /// Where there is a coarser scale.
        agreeing: Option<Bindings>,
        parameters: Buffer<CorrectionParameters>,
        sums: Bindings,
    },
    Rgb {
        parameters: Buffer<RgbLossParameters>,
        loss: Bindings,
    },
    Lab {
        parameters: Buffer<LabLossParameters>,
        loss: Bindings,
        /// Where there is a coarser scale.
        agreeing: Option<Bindings>,
    },
}

/// Where one view at one scale is drawn and judged.
pub(super) struct Seat {
    pub layer: Layer,
    pub adjoint: ChromaAdjoint,
    pub judge: Judge,
    pub wanted: Buffer<u32>,
    pub weights: Buffer<f32>,
}

impl Seat {
    /// Of a view at a scale; `coarser` is the canvas of the next one.
    ///
    /// # Errors
    /// [`ChromaError::Gpu`].
    pub fn new(
        passes: &Passes<'_>,
        view: usize,
        scale: usize,
        (canvas, coarser): (&Canvas, Option<&Canvas>),
        (image_gradient, scratch): (&Buffer<f32>, &AdjointScratch),
        wanted: Buffer<u32>,
        weights: Buffer<f32>,
    ) -> Result<Self, ChromaError> {
        let Passes { frozen, field, .. } = passes;
        let (raster, geometry, kernels) = (&frozen.raster, &frozen.geometry, &frozen.kernels);
        let gpu = &raster.gpu;
        let lists = frozen.lists(view, scale).ok_or(ChromaError::NoViews)?;
        let layer = Layer::on(
            raster,
            geometry,
            lists,
            field,
            canvas.clone(),
            lists.max_tiles(),
        );
        let sums = ChromaSums {
            gradient: &passes.gradient,
            diagonal: &passes.diagonal,
        };
        let scratch = scratch.clone();
        let adjoint = ChromaAdjoint::new(
            raster,
            geometry,
            lists,
            &layer,
            image_gradient,
            scratch,
            sums,
        );
        let block_losses = passes.log.block_losses.raw();
        let judge = match field.kind {
            ColorKind::Rgb if passes.space == Space::Lab => {
                let parameters =
                    Buffer::uniform(gpu, "lab loss parameters", &LabLossParameters::default())?;
                let mut buffers = vec![
                    lists.view.raw(),
                    layer.image.raw(),
                    wanted.raw(),
                    parameters.raw(),
                    block_losses,
                    image_gradient.raw(),
                    weights.raw(),
                ];
                let loss = kernels.lab_loss.bind(gpu, &buffers);
                let agreeing = coarser.map(|coarser| {
                    buffers.push(coarser.image().raw());
                    kernels.agreeing_lab_loss.bind(gpu, &buffers)
                });
                Judge::Lab {
                    parameters,
                    loss,
                    agreeing,
                }
            }
            ColorKind::Rgb => {
                let parameters =
                    Buffer::uniform(gpu, "rgb loss parameters", &RgbLossParameters::default())?;
                let loss = kernels.rgb_loss.bind(
                    gpu,
                    &[
                        lists.view.raw(),
                        layer.image.raw(),
                        wanted.raw(),
                        parameters.raw(),
                        block_losses,
                        image_gradient.raw(),
                        weights.raw(),
                    ],
                );
                Judge::Rgb { parameters, loss }
            }
            ColorKind::Chroma | ColorKind::Luma => {
                let of_loss =
                    Buffer::uniform(gpu, "chroma loss weights", &ChromaLossWeights::default())?;
                let mut buffers = vec![
                    lists.view.raw(),
                    layer.image.raw(),
                    wanted.raw(),
                    of_loss.raw(),
                    block_losses,
                    image_gradient.raw(),
                    weights.raw(),
                    passes.corrections.corrections.raw(),
                ];
                let loss = kernels.chroma_loss.bind(gpu, &buffers);
                let agreeing = coarser.map(|coarser| {
                    buffers.push(coarser.image().raw());
                    kernels.agreeing_loss.bind(gpu, &buffers)
                });
                let parameters = passes.corrections.parameters(gpu, 0, false)?;
                let inputs = [lists.view.raw(), layer.image.raw(), wanted.raw()];
                let inputs = (inputs, image_gradient, &weights);
                let sums = (passes.corrections).bind(gpu, &kernels.correction, &parameters, inputs);
                Judge::Chroma {
                    weights: of_loss,
                    loss,
                    agreeing,
                    parameters,
                    sums,
                }
            }
        };
        Ok(Self {
            layer,
            adjoint,
            judge,
            wanted,
            weights,
        })
    }
}
