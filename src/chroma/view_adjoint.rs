//! Buffers and bindings by which a view's picture is judged in a pass.

use super::{
    ChromaError, ChromaKernels,
    correction::{CorrectionParameters, Corrections},
    loss::{ChromaLossWeights, LabLossParameters, RgbLossParameters, Space},
};
use crate::{
    gpu::{Bindings, Buffer, Gpu, Kernel},
    raster::{ColorKind, ViewUniform},
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

/// Buffers that all views of a solve share.
pub(super) struct SolveBuffers<'a> {
    pub gpu: &'a Gpu,
    pub kernels: &'a ChromaKernels,
    pub kind: ColorKind,
    pub block_losses: &'a Buffer<f32>,
    pub corrections: &'a Corrections,
    pub space: Space,
    pub image_gradient: &'a Buffer<f32>,
    /// One for each scale.
    pub images: &'a [Buffer<f32>],
}

/// Buffers and bindings by which the picture of one view at one scale is judged.
pub(super) struct ViewAdjoint {
    /// Its size; kernels of the loss need no more of a camera.
    pub view: Buffer<ViewUniform>,
    pub view_loss: ViewLoss,
    pub loss: Bindings,
    /// The loss with the agreement with a coarser scale, where there is one.
    pub agreeing: Option<Bindings>,
    pub wanted: Buffer<u32>,
    pub weights: Buffer<f32>,
}

impl ViewAdjoint {
    /// Those of a view of this size at a scale.
    pub fn new(
        shared: &SolveBuffers<'_>,
        size: [u32; 2],
        scale: usize,
        wanted: Buffer<u32>,
        weights: Buffer<f32>,
    ) -> Result<Self, ChromaError> {
        let &SolveBuffers {
            gpu,
            kernels,
            corrections,
            image_gradient,
            images,
            ..
        } = shared;
        let image = &images[scale];
        let view = Buffer::uniform(gpu, "size of a view", &sized(size))?;
        // The first bindings are the same for all losses; the coarser picture is the last.
        let tied =
            |parameters: &wgpu::Buffer, more: &[&wgpu::Buffer], [plain, agreeing]: [_; 2]| {
                let mut buffers = vec![
                    view.raw(),
                    image.raw(),
                    wanted.raw(),
                    parameters,
                    shared.block_losses.raw(),
                    image_gradient.raw(),
                    weights.raw(),
                ];
                buffers.extend(more);
                let loss = Kernel::bind(plain, gpu, &buffers);
                let agreeing = images.get(scale + 1).map(|coarser| {
                    buffers.push(coarser.raw());
                    Kernel::bind(agreeing, gpu, &buffers)
                });
                (loss, agreeing)
            };
        let (view_loss, (loss, agreeing)) = match shared.kind {
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
                let inputs = [view.raw(), image.raw(), wanted.raw()];
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
            view,
            view_loss,
            loss,
            agreeing,
            wanted,
            weights,
        })
    }
}

/// A view of which nothing counts but the size.
pub(super) fn sized(size: [u32; 2]) -> ViewUniform {
    ViewUniform {
        size,
        ..ViewUniform::default()
    }
}
