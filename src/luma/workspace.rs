//! Everything of a training step that is tied to the number of Gaussians or to
//! the room of the tile lists.

use super::{
    LumaSettings, SsimWindow,
    densify::DensifyKernels,
    loss::{Loss, LossEffects, LossKernels, Targets},
    relocation::{Relocation, RelocationKernel},
    settings::Densification,
    trainer::SYNC_EVERY,
};
use crate::{
    gpu::{Buffer, Gpu, GpuError},
    raster::{
        AdamState, Field, Geometry, Layer, LayerAdjoint, Lists, LossLog, Outcome, Raster,
        SumLossKernel,
    },
};

/// The kernels of a step besides the rasterizer's.
pub struct Kernels {
    pub sum_loss: SumLossKernel,
    pub loss: LossKernels,
    pub densify: DensifyKernels,
    pub relocation: RelocationKernel,
}

impl Kernels {
    /// Compiles them.
    pub fn new(gpu: &Gpu, effects: LossEffects, window: SsimWindow) -> Self {
        Self {
            sum_loss: SumLossKernel::new(gpu),
            loss: LossKernels::new(gpu, effects, window),
            densify: DensifyKernels::new(gpu),
            relocation: RelocationKernel::new(gpu),
        }
    }
}

/// What has to be made anew when the number of Gaussians or the room changes.
pub struct Workspace {
    pub lists: Lists,
    pub layer: Layer,
    pub adjoint: LayerAdjoint,
    pub adam_geometry: AdamState,
    pub adam_field: AdamState,
    pub log: LossLog,
    pub losses: Vec<Loss>,
    /// When the set changes by relocation.
    pub relocation: Option<Relocation>,
}

impl Workspace {
    /// A workspace for tile lists of `capacity` entries; Adam goes on from
    /// `moments` (of geometry and field) or starts from rest.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    #[allow(
        clippy::too_many_arguments,
        reason = "called from two places that own the parts separately"
    )]
    pub fn new(
        raster: &Raster,
        kernels: &Kernels,
        settings: &LumaSettings,
        geometry: &Geometry,
        field: &Field,
        targets: &Targets,
        [max_pixels, max_tiles]: [usize; 2],
        capacity: usize,
        moments: Option<[[Buffer<f32>; 2]; 2]>,
    ) -> Result<Self, GpuError> {
        let gpu = &raster.gpu;
        let lists = Lists::new(raster, geometry, max_tiles, capacity)?;
        let layer = Layer::new(raster, geometry, &lists, field, max_pixels, max_tiles)?;
        let (of_geometry, of_field) = match moments {
            Some([geometry, field]) => (Some(geometry), Some(field)),
            None => (None, None),
        };
        let count = geometry.count;
        let adam_geometry = AdamState::new(gpu, geometry.planes.len(), count, of_geometry)?;
        let adam_field = AdamState::new(gpu, field.planes.len(), count, of_field)?;
        let outcome = Outcome::Step {
            geometry: adam_geometry.step_buffers(),
            field: adam_field.step_buffers(),
        };
        let adjoint = LayerAdjoint::new(raster, geometry, &lists, field, &layer, &outcome)?;
        let log = LossLog::new(gpu, &kernels.sum_loss, &lists.status, max_tiles, SYNC_EVERY)?;
        let losses = Loss::all(gpu, &kernels.loss, &lists, &layer, &adjoint, &log, targets);
        let relocation = (settings.densification == Densification::Relocate)
            .then(|| {
                let kernels = &kernels.relocation;
                Relocation::new(gpu, kernels, &lists.status, &geometry.planes)
            })
            .transpose()?;
        Ok(Self {
            lists,
            layer,
            adjoint,
            adam_geometry,
            adam_field,
            log,
            losses,
            relocation,
        })
    }

    /// Densification statistics since the set last changed.
    pub fn statistics(&self) -> &Buffer<f32> {
        &self
            .adjoint
            .geometry
            .as_ref()
            .expect("luma trains geometry")
            .statistics
    }
}
