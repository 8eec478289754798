//! Buffers and bindings by which a view is drawn and judged in a pass.

use super::{
    ChromaError, FrozenViews,
    correction::{CorrectionParameters, Corrections},
    loss::{ChromaLossWeights, LabLossParameters, RgbLossParameters, Space},
};
use crate::{
    gpu::{Bindings, Buffer, Kernel},
    raster::{AdjointScratch, Canvas, ChromaAdjoint, ChromaSums, ColorKind, Field, Layer},
};

/// Parameters of a view's loss.
pub(super) enum ViewLoss {
    Chroma {
        weights: Buffer<ChromaLossWeights>,
        parameters: Buffer<CorrectionParameters>,
        sums: Bindings,
    },
    Rgb(Buffer<RgbLossParameters>),
    Lab(Buffer<LabLossParameters>),
}

/// Buffers that all seats of a solve share.
pub(super) struct SolveBuffers<'a> {
    pub frozen: &'a FrozenViews,
    pub field: &'a Field,
    pub sums: ChromaSums<'a>,
    pub block_losses: &'a Buffer<f32>,
    pub corrections: &'a Corrections,
    pub space: Space,
    pub image_gradient: &'a Buffer<f32>,
    pub scratch: &'a AdjointScratch,
    /// One for each scale.
    pub canvases: &'a [Canvas],
}

/// Buffers and bindings by which one view at one scale is drawn and judged.
pub(super) struct ViewAdjoint {
    pub layer: Layer,
    pub adjoint: ChromaAdjoint,
    pub view_loss: ViewLoss,
    pub loss: Bindings,
    /// The loss with the agreement with a coarser scale, where there is one.
    pub agreeing: Option<Bindings>,
    pub wanted: Buffer<u32>,
    pub weights: Buffer<f32>,
}

impl ViewAdjoint {
    /// Those of a view at a scale.
    pub fn new(
        shared: &SolveBuffers<'_>,
        view: usize,
        scale: usize,
        wanted: Buffer<u32>,
        weights: Buffer<f32>,
    ) -> Result<Self, ChromaError> {
        let &SolveBuffers {
            frozen,
            field,
            corrections,
            image_gradient,
            ..
        } = shared;
        let (raster, geometry, kernels) = (&frozen.raster, &frozen.geometry, &frozen.kernels);
        let gpu = &raster.gpu;
        let lists = frozen.lists(view, scale).ok_or(ChromaError::NoViews)?;
        let (canvas, tiles) = (shared.canvases[scale].clone(), lists.max_tiles());
        let layer = Layer::on(raster, geometry, lists, field, canvas, tiles);
        let scratch = shared.scratch.clone();
        let adjoint = ChromaAdjoint::new(
            raster,
            geometry,
            lists,
            &layer,
            image_gradient,
            scratch,
            shared.sums,
        );
        // The first bindings are the same for all losses; the coarser picture is the last.
        let tied =
            |parameters: &wgpu::Buffer, more: &[&wgpu::Buffer], [plain, agreeing]: [_; 2]| {
                let mut buffers = vec![
                    lists.view.raw(),
                    layer.image.raw(),
                    wanted.raw(),
                    parameters,
                    shared.block_losses.raw(),
                    image_gradient.raw(),
                    weights.raw(),
                ];
                buffers.extend(more);
                let loss = Kernel::bind(plain, gpu, &buffers);
                let agreeing = shared.canvases.get(scale + 1).map(|coarser| {
                    buffers.push(coarser.image().raw());
                    Kernel::bind(agreeing, gpu, &buffers)
                });
                (loss, agreeing)
            };
        let (view_loss, (loss, agreeing)) = match field.kind {
            ColorKind::Rgb if shared.space == Space::Lab => {
                let parameters = LabLossParameters::default();
                let parameters = Buffer::uniform(gpu, "lab loss parameters", &parameters)?;
                let both = [&kernels.lab_loss, &kernels.agreeing_lab_loss];
                let tied = tied(parameters.raw(), &[], both);
                (ViewLoss::Lab(parameters), tied)
            }
            ColorKind::Rgb => {
                let parameters = RgbLossParameters::default();
                let parameters = Buffer::uniform(gpu, "rgb loss parameters", &parameters)?;
                // There is one scale.
                let tied = tied(parameters.raw(), &[], [&kernels.rgb_loss; 2]);
                (ViewLoss::Rgb(parameters), tied)
            }
            ColorKind::Chroma | ColorKind::Luma => {
                let of_loss = ChromaLossWeights::default();
                let of_loss = Buffer::uniform(gpu, "chroma loss weights", &of_loss)?;
                let both = [&kernels.chroma_loss, &kernels.agreeing_loss];
                let found = corrections.corrections.raw();
                let tied = tied(of_loss.raw(), &[found], both);
                let parameters = corrections.parameters(gpu, 0, false)?;
                let inputs = [lists.view.raw(), layer.image.raw(), wanted.raw()];
                let inputs = (inputs, image_gradient, &weights);
                let sums = corrections.bind(gpu, &kernels.correction, &parameters, inputs);
                let view_loss = ViewLoss::Chroma {
                    weights: of_loss,
                    parameters,
                    sums,
                };
                (view_loss, tied)
            }
        };
        Ok(Self {
            layer,
            adjoint,
            view_loss,
            loss,
            agreeing,
            wanted,
            weights,
        })
    }
}
