//! Everything of a training step that is tied to the number of Gaussians or to
//! the room of the tile lists.

use super::{
    Demand, SsimWindow,
    densify::DensifyKernels,
    loss::{Loss, LossEffects, LossKernels, Targets},
    settings::SYNC_EVERY,
};
use crate::{
    gpu::{Buffer, Gpu, GpuError},
    raster::{
        AdamStep, Layer, Lists, LossLog, LumaAdjoint, Model, Outcome, Raster, SumLossKernel,
        constants::GEOMETRY_PLANES,
    },
    splats::sh,
};

/// The kernels of a step besides the rasterizer's.
pub struct Kernels {
    pub sum_loss: SumLossKernel,
    pub loss: LossKernels,
    pub densify: DensifyKernels,
}

impl Kernels {
    /// Compiles them.
    pub fn new(gpu: &Gpu, effects: LossEffects, window: SsimWindow) -> Self {
        Self {
            sum_loss: SumLossKernel::new(gpu),
            loss: LossKernels::new(gpu, effects, window),
            densify: DensifyKernels::new(gpu),
        }
    }
}

/// Buffers that are reallocated when the number of Gaussians or the tile-list capacity changes.
pub struct Workspace {
    pub lists: Lists,
    pub layer: Layer,
    pub adjoint: LumaAdjoint,
    /// Rates of the geometry.
    pub geometry_step: AdamStep,
    /// Rates of the harmonics.
    pub field_step: AdamStep,
    pub log: LossLog,
    pub losses: Vec<Loss>,
}

impl Workspace {
    /// A workspace to train `model` with tile lists of `capacity` entries.
    pub fn new(
        raster: &Raster,
        kernels: &Kernels,
        model: &Model,
        targets: &Targets,
        demand: &Demand,
        capacity: usize,
    ) -> Result<Self, GpuError> {
        let gpu = &raster.gpu;
        let (geometry, field) = (&model.geometry, &model.field);
        let (max_pixels, max_tiles) = (demand.max_pixels, demand.max_tiles);
        let lists = Lists::new(raster, geometry, max_tiles, capacity)?;
        let layer = Layer::new(raster, geometry, &lists, field, max_pixels, max_tiles)?;
        let step = |planes| AdamStep::holding(gpu, planes, geometry.count, model.held);
        let geometry_step = step(GEOMETRY_PLANES)?;
        let field_step = step(sh::coefficient_count(field.degree))?;
        let outcome = Outcome::Step {
            geometry: geometry_step.of(&model.geometry_moments),
            field: field_step.of(&model.field_moments),
        };
        let adjoint = LumaAdjoint::new(raster, geometry, &lists, field, &layer, &outcome)?;
        let log = LossLog::new(gpu, &kernels.sum_loss, &lists.status, max_tiles, SYNC_EVERY)?;
        let losses = Loss::all(gpu, &kernels.loss, &lists, &layer, &adjoint, &log, targets);
        Ok(Self {
            lists,
            layer,
            adjoint,
            geometry_step,
            field_step,
            log,
            losses,
        })
    }

    /// Densification statistics since the set last changed.
    pub fn statistics(&self) -> &Buffer<f32> {
        &self.adjoint.statistics
    }
}
