//! The kernels of layers, their adjoints and the projection, compiled for what is to be
//! drawn and how accurately.

use super::{AdamSteps, ColorKind, Falloff, RasterNumerics, RasterOptions, Storage};
use crate::gpu::{Gpu, Kernel, shaders};

/// The variant for a GPU, or that for the vector registers of a processor.
pub(super) fn variant(gpu: &Gpu, [gpus, processors]: [&'static str; 2]) -> &'static str {
    if gpu.simd() { processors } else { gpus }
}

#[derive(Clone)]
pub(super) struct LayerKernels {
    pub shade: Kernel,
    pub blend: Kernel,
}

impl LayerKernels {
    pub fn new(gpu: &Gpu, kind: ColorKind, falloff: Falloff, numerics: &RasterNumerics) -> Self {
        let shade = match kind {
            ColorKind::Luma => shaders::SHADE_LUMA,
            ColorKind::Chroma => shaders::SHADE_CHROMA,
            ColorKind::Rgb => shaders::SHADE_RGB,
        };
        let blend = match (falloff, kind) {
            (_, ColorKind::Luma) => [shaders::BLEND_LUMA, shaders::BLEND_LUMA_SIMD],
            (_, ColorKind::Chroma) => [shaders::BLEND_CHROMA, shaders::BLEND_CHROMA_SIMD],
            (Falloff::Gaussian, ColorKind::Rgb) => [shaders::BLEND_RGB, shaders::BLEND_RGB_SIMD],
            (Falloff::PlayCanvas, ColorKind::Rgb) => [
                shaders::BLEND_RGB_PLAYCANVAS,
                shaders::BLEND_RGB_PLAYCANVAS_SIMD,
            ],
        };
        Self {
            shade: Kernel::new(gpu, "shade", shade),
            blend: Kernel::with(gpu, "blend", variant(gpu, blend), &numerics.cutoffs()),
        }
    }
}

#[derive(Clone)]
pub(super) struct ListKernels {
    pub compact: Kernel,
    pub tile_lists: Kernel,
    pub tile_ranges: Kernel,
}

impl ListKernels {
    pub fn new(gpu: &Gpu, numerics: &RasterNumerics) -> Self {
        Self {
            compact: Kernel::new(gpu, "compact", shaders::COMPACT),
            tile_lists: Kernel::with(
                gpu,
                "tile_lists",
                shaders::TILE_LISTS,
                &numerics.alpha_cutoff(),
            ),
            tile_ranges: Kernel::new(gpu, "tile_ranges", shaders::TILE_RANGES),
        }
    }
}

/// `blend_backward` and `sum_instances`.
#[derive(Clone)]
pub(super) struct BlendBackwardKernels {
    luma: [Kernel; 2],
    color: [Kernel; 2],
}

impl BlendBackwardKernels {
    pub fn new(gpu: &Gpu, numerics: &RasterNumerics) -> Self {
        let (blend, sum) = match numerics.storage {
            Storage::Full => (
                [
                    shaders::BLEND_BACKWARD_LUMA,
                    shaders::BLEND_BACKWARD_LUMA_SIMD,
                ],
                shaders::SUM_INSTANCES_LUMA,
            ),
            Storage::Half => (
                [
                    shaders::BLEND_BACKWARD_LUMA_HALF,
                    shaders::BLEND_BACKWARD_LUMA_HALF_SIMD,
                ],
                shaders::SUM_INSTANCES_LUMA_HALF,
            ),
        };
        let cutoff = numerics.alpha_cutoff();
        let of_blend =
            |sources| Kernel::with(gpu, "blend_backward", variant(gpu, sources), &cutoff);
        Self {
            luma: [
                of_blend(blend),
                Kernel::with(gpu, "sum_instances", sum, &cutoff),
            ],
            color: [
                of_blend([
                    shaders::BLEND_BACKWARD_FIGURES,
                    shaders::BLEND_BACKWARD_FIGURES_SIMD,
                ]),
                // Nothing is divided by the opacity here.
                Kernel::new(gpu, "sum_instances", shaders::SUM_INSTANCES_FIGURES),
            ],
        }
    }

    pub fn luma(&self) -> [&Kernel; 2] {
        self.luma.each_ref()
    }

    pub fn color(&self) -> [&Kernel; 2] {
        self.color.each_ref()
    }
}

/// `shade_backward`.
#[derive(Clone)]
pub(super) struct ShadeBackwardKernels {
    pub luma: Kernel,
    pub chroma: Kernel,
    pub rgb: Kernel,
}

impl ShadeBackwardKernels {
    pub fn new(gpu: &Gpu) -> Self {
        let kernel = |source| Kernel::new(gpu, "shade_backward", source);
        Self {
            luma: kernel(shaders::SHADE_BACKWARD_LUMA),
            chroma: kernel(shaders::SHADE_BACKWARD_CHROMA),
            rgb: kernel(shaders::SHADE_BACKWARD_RGB),
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
        let project = match options.falloff {
            Falloff::Gaussian => project,
            Falloff::PlayCanvas => shaders::PROJECT_PLAYCANVAS,
        };
        let step = match (options.antialiased, numerics.adam) {
            (false, AdamSteps::Exact) => shaders::PROJECT_BACKWARD_STEP,
            (false, AdamSteps::Lazy) => shaders::PROJECT_BACKWARD_STEP_LAZY,
            (true, AdamSteps::Exact) => shaders::PROJECT_BACKWARD_MIP_STEP,
            (true, AdamSteps::Lazy) => shaders::PROJECT_BACKWARD_MIP_STEP_LAZY,
        };
        Self {
            project: Kernel::with(gpu, "project", project, &numerics.alpha_cutoff()),
            backward: Kernel::with(gpu, "project_backward", backward, &numerics.pulls()),
            step: Kernel::with(gpu, "project_backward", step, &numerics.pulls()),
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
