//! The kernels of layers, their adjoints and the projection, compiled for what is to be
//! drawn and how accurately.

use super::{AdamSteps, ColorKind, RasterNumerics, RasterOptions, Storage};
use crate::gpu::{Gpu, Kernel, shaders};

#[derive(Clone)]
pub(super) struct LayerKernels {
    pub shade: Kernel,
    pub blend: Kernel,
}

impl LayerKernels {
    pub fn new(gpu: &Gpu, kind: ColorKind, numerics: &RasterNumerics) -> Self {
        let (shade, blend) = match kind {
            ColorKind::Luma => (shaders::SHADE_LUMA, shaders::BLEND_LUMA),
            ColorKind::Chroma => (shaders::SHADE_CHROMA, shaders::BLEND_CHROMA),
            ColorKind::Rgb => (shaders::SHADE_RGB, shaders::BLEND_RGB),
        };
        Self {
            shade: Kernel::new(gpu, "shade", shade),
            blend: Kernel::with(gpu, "blend", blend, &numerics.cutoffs()),
        }
    }
}

#[derive(Clone)]
pub(super) struct AdjointKernels {
    pub blend: Kernel,
    pub sum: Kernel,
    pub shade: Kernel,
    /// Adds to the gradient instead of replacing it; chroma only.
    pub shade_add: Option<Kernel>,
}

impl AdjointKernels {
    /// # Panics
    /// For RGB, which is shown but never trained.
    pub fn new(gpu: &Gpu, kind: ColorKind, numerics: &RasterNumerics) -> Self {
        let (blend, sum, shade) = match kind {
            ColorKind::Luma => {
                let (blend, sum) = match numerics.storage {
                    Storage::Full => (shaders::BLEND_BACKWARD_LUMA, shaders::SUM_INSTANCES_LUMA),
                    Storage::Half => (
                        shaders::BLEND_BACKWARD_LUMA_HALF,
                        shaders::SUM_INSTANCES_LUMA_HALF,
                    ),
                };
                (blend, sum, shaders::SHADE_BACKWARD_LUMA)
            }
            ColorKind::Chroma => (
                shaders::BLEND_BACKWARD_CHROMA,
                shaders::SUM_INSTANCES_CHROMA,
                shaders::SHADE_BACKWARD_CHROMA,
            ),
            ColorKind::Rgb => panic!("RGB has no adjoint"),
        };
        Self {
            blend: Kernel::with(gpu, "blend_backward", blend, &numerics.alpha_cutoff()),
            sum: match kind {
                // Chroma's sums need no division by the opacity.
                ColorKind::Chroma | ColorKind::Rgb => Kernel::new(gpu, "sum_instances", sum),
                ColorKind::Luma => {
                    Kernel::with(gpu, "sum_instances", sum, &numerics.alpha_cutoff())
                }
            },
            shade: Kernel::new(gpu, "shade_backward", shade),
            shade_add: (kind == ColorKind::Chroma)
                .then(|| Kernel::new(gpu, "shade_backward", shaders::SHADE_BACKWARD_CHROMA_ADD)),
        }
    }
}

/// The kernels that the options make a difference to.
#[derive(Clone)]
pub(super) struct ProjectionKernels {
    pub project: Kernel,
    pub backward: Kernel,
    pub step: Kernel,
}

impl ProjectionKernels {
    pub fn new(gpu: &Gpu, options: RasterOptions, numerics: &RasterNumerics) -> Self {
        let [project, backward] = if options.antialiased {
            [shaders::PROJECT_MIP, shaders::PROJECT_BACKWARD_MIP]
        } else {
            [shaders::PROJECT, shaders::PROJECT_BACKWARD]
        };
        let step = match (options.antialiased, numerics.adam) {
            (false, AdamSteps::Exact) => shaders::PROJECT_BACKWARD_STEP,
            (false, AdamSteps::Lazy) => shaders::PROJECT_BACKWARD_STEP_LAZY,
            (true, AdamSteps::Exact) => shaders::PROJECT_BACKWARD_MIP_STEP,
            (true, AdamSteps::Lazy) => shaders::PROJECT_BACKWARD_MIP_STEP_LAZY,
        };
        Self {
            project: Kernel::with(gpu, "project", project, &numerics.alpha_cutoff()),
            backward: Kernel::new(gpu, "project_backward", backward),
            step: Kernel::new(gpu, "project_backward", step),
        }
    }
}

/// The adjoint of shading with Adam's step.
pub(super) fn shade_step(gpu: &Gpu, numerics: &RasterNumerics) -> Kernel {
    let source = match numerics.adam {
        AdamSteps::Exact => shaders::SHADE_BACKWARD_STEP,
        AdamSteps::Lazy => shaders::SHADE_BACKWARD_STEP_LAZY,
    };
    Kernel::new(gpu, "shade_backward", source)
}
