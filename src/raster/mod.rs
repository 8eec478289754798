//! The rasterizer and its adjoint, host side.
//!
//! project → depth sort → tile lists → tile sort → blend, then back. Every step
//! is a kernel in `shaders/`; [`Lists`] records those that depend on the
//! geometry alone, [`Layer`] those that draw one field of color over it,
//! [`LumaAdjoint`] and [`ChromaAdjoint`] their adjoints.

mod adam;
mod adjoint;
pub mod constants;
mod contributions;
mod depth;
pub mod groups;
mod kernels;
mod layer;
mod lists;
mod model;
mod numerics;
mod portions;
mod renderer;
mod rgb_adjoint;
mod roofline;
pub mod scan;
mod scene_renderer;
pub mod sort;
mod splats;
mod streamed;
mod sum_loss;
mod view;

pub use adam::{Adam, AdamKernel, AdamMoments, AdamParameters, AdamStep, StepBuffers};
pub use adjoint::{AdjointScratch, COLOR_FIGURES, ChromaAdjoint, ChromaSums, LumaAdjoint, Outcome};
pub use contributions::Contributions;
pub use depth::{DepthLayer, UNREACHED, depths};
pub use layer::{Canvas, Layer};
pub use lists::{Lists, Projected, Status, StatusReadback, TileListsMode};
pub use model::{Model, Snapshot};
pub use numerics::{AdamSteps, RasterNumerics, Storage};
pub use portions::Portion;
pub use renderer::{Picture, Renderer};
pub use rgb_adjoint::{RgbAdjoint, RgbAdjointKernels};
pub use roofline::{Load, minimum_words};
pub use scene_renderer::SceneRenderer;
pub use splats::{Field, Geometry, field_of, planes_of};
pub use streamed::{Frustum, Streamed};
pub use sum_loss::{LossLog, SumLossKernel, SumLossParameters};
pub use view::ViewUniform;

use std::sync::Arc;

use crate::gpu::{Gpu, Kernel};
use kernels::{
    BlendBackwardKernels, LayerKernels, ProjectionKernels, ShadeBackwardKernels, shade_step,
};
use lists::ListKernels;
use scan::ScanKernels;
use sort::SortKernels;

/// What the channels of a field mean.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColorKind {
    /// sRGB-encoded gray.
    Luma,
    /// CIELAB a and b.
    Chroma,
    /// sRGB-encoded red, green and blue.
    Rgb,
}

impl ColorKind {
    /// The kind with so many channels, if there is one.
    pub fn of_channels(channels: usize) -> Option<Self> {
        match channels {
            1 => Some(Self::Luma),
            2 => Some(Self::Chroma),
            3 => Some(Self::Rgb),
            _ => None,
        }
    }

    /// Channels of one color.
    pub fn channels(self) -> usize {
        match self {
            Self::Luma => 1,
            Self::Chroma => 2,
            Self::Rgb => 3,
        }
    }

    /// Floats between two colors in a device array (`vec3f` is aligned to 16 bytes).
    pub fn stride(self) -> usize {
        match self {
            Self::Luma => 1,
            Self::Chroma => 2,
            Self::Rgb => 4,
        }
    }
}

/// Effects of image formation that the rasterizer is compiled with. What is off is not in
/// the kernels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RasterOptions {
    /// A Gaussian's opacity falls by what the blur of
    /// [`BLUR`](constants::BLUR) px² spreads it (Mip-Splatting, Yu et al. 2024): its size
    /// in pixels does not change how much it shows.
    pub antialiased: bool,
    /// How a Gaussian ends.
    pub falloff: Falloff,
}

/// How a Gaussian's opacity falls towards its border.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Falloff {
    /// As a Gaussian, to where it is no longer seen (Kerbl et al. 2023).
    #[default]
    Gaussian,
    /// As PlayCanvas' engine has it: less than a Gaussian by e⁻⁴, divided by what is left of 1,
    /// ended at √8 deviations, and blurred by [`PLAYCANVAS_BLUR`](constants::PLAYCANVAS_BLUR)
    /// px² only. It is not antialiased. Of layers and adjoints only RGB's know it.
    PlayCanvas,
}

/// The compiled kernels of the rasterizer.
#[derive(Clone)]
pub struct Raster {
    /// The device they run on.
    pub gpu: Gpu,
    options: RasterOptions,
    numerics: RasterNumerics,
    scan: ScanKernels,
    sort: SortKernels,
    lists: ListKernels,
    layers: [LayerKernels; 3],
    blend_backward: BlendBackwardKernels,
    shade_backward: ShadeBackwardKernels,
    projection: ProjectionKernels,
    shade_step: Kernel,
}

impl Raster {
    /// Compiles all kernels, without any effect.
    pub fn new(gpu: &Gpu) -> Self {
        Self::with(gpu, RasterOptions::default())
    }

    /// Compiles all kernels with these effects.
    pub fn with(gpu: &Gpu, options: RasterOptions) -> Self {
        let numerics = RasterNumerics::DEFAULT;
        Self {
            gpu: gpu.clone(),
            options,
            numerics,
            scan: ScanKernels::new(gpu),
            sort: SortKernels::new(gpu),
            lists: ListKernels::new(gpu, &numerics),
            layers: layers(gpu, options.falloff, &numerics),
            blend_backward: BlendBackwardKernels::new(gpu, &numerics),
            shade_backward: ShadeBackwardKernels::new(gpu),
            projection: ProjectionKernels::new(gpu, options, &numerics),
            shade_step: shade_step(gpu, &numerics),
        }
    }

    /// The rasterizer with these effects: this one where they are its own, else one that
    /// shares the kernels that they do not concern.
    pub fn drawing(self: &Arc<Self>, options: RasterOptions) -> Arc<Self> {
        if self.options == options {
            return self.clone();
        }
        let layers = if self.options.falloff == options.falloff {
            self.layers.clone()
        } else {
            layers(&self.gpu, options.falloff, &self.numerics)
        };
        Arc::new(Self {
            options,
            layers,
            projection: ProjectionKernels::new(&self.gpu, options, &self.numerics),
            ..Self::clone(self)
        })
    }

    /// The rasterizer that computes as accurately as this: itself where it does so
    /// already, else one that shares the kernels that it does not concern.
    pub fn computing(self: &Arc<Self>, numerics: RasterNumerics) -> Arc<Self> {
        if self.numerics == numerics {
            return self.clone();
        }
        let gpu = &self.gpu;
        Arc::new(Self {
            numerics,
            lists: ListKernels::new(gpu, &numerics),
            layers: layers(gpu, self.options.falloff, &numerics),
            blend_backward: BlendBackwardKernels::new(gpu, &numerics),
            projection: ProjectionKernels::new(gpu, self.options, &numerics),
            shade_step: shade_step(gpu, &numerics),
            ..Self::clone(self)
        })
    }

    /// The effects it was compiled with.
    pub fn options(&self) -> RasterOptions {
        self.options
    }

    /// How accurately it computes.
    pub fn numerics(&self) -> RasterNumerics {
        self.numerics
    }

    /// The kernels of the prefix sum.
    pub fn scan_kernels(&self) -> &ScanKernels {
        &self.scan
    }

    /// The kernels of the sort.
    pub fn sort_kernels(&self) -> &SortKernels {
        &self.sort
    }

    fn layer(&self, kind: ColorKind) -> &LayerKernels {
        &self.layers[kind.channels() - 1]
    }
}

fn layers(gpu: &Gpu, falloff: Falloff, numerics: &RasterNumerics) -> [LayerKernels; 3] {
    [ColorKind::Luma, ColorKind::Chroma, ColorKind::Rgb]
        .map(|kind| LayerKernels::new(gpu, kind, falloff, numerics))
}
