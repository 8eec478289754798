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
mod options;
mod plain;
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
pub use depth::{UNREACHED, blend_depth, depths};
pub use layer::{Canvas, Layer};
pub use lists::{Lists, Projected, Status, StatusReadback, TileListsMode};
pub use model::{Model, Snapshot};
pub use numerics::{AdamSteps, RasterNumerics, Storage};
pub use options::{ColorKind, Falloff, RasterOptions};
pub use plain::plain;
pub use portions::Portion;
pub use renderer::{RenderedImage, Renderer};
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
    BlendBackwardKernels, LayerKernels, ListKernels, ProjectionKernels, ShadeBackwardKernels,
    shade_step,
};
use scan::ScanKernels;
use sort::SortKernels;

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

    /// Numerical accuracy.
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
