//! What changes between two iterations, beside the steps of Adam.

use super::LumaTrainer;
use crate::{
    gpu::{Buffer, GpuError},
    luma::{
        Densification, LumaError,
        densify::{self, Evidence},
        memory::ENTRIES_PER_SPLAT,
        outliers, relocation,
    },
};

impl LumaTrainer {
    /// Splits, moves and removes Gaussians.
    pub(super) fn densify(&mut self, iteration: usize) -> Result<(), GpuError> {
        let evidence = Evidence {
            geometry: &self.model.geometry.planes.read(&self.gpu)?,
            statistics: &self.workspace()?.statistics().read(&self.gpu)?,
        };
        let plan = match self.settings.densify {
            Densification::Split => densify::plan(&self.settings, &evidence),
            Densification::Relocate => relocation::plan(&self.settings, &evidence, iteration),
        };
        if plan.is_empty() {
            // Nothing would be left: keep what there is and go on.
            return Ok(());
        }
        let plan = Buffer::from_slice(&self.gpu, "plan", &plan)?;
        self.model = self
            .kernels
            .densify
            .carry_out(&self.gpu, &plan, &self.model)?;
        let present = self.workspace()?.lists.capacity;
        let capacity = present.max(self.model.len() * ENTRIES_PER_SPLAT);
        self.renew(capacity, iteration)
    }

    /// Looks for pixels that show something else than the scene, and lets them count no
    /// longer; those that were found before get another chance.
    pub(super) fn leave_out_outliers(&mut self) -> Result<(), LumaError> {
        let scene = outliers::Scene {
            raster: &self.raster,
            geometry: &self.model.geometry,
            field: &self.model.field,
            near: self.near,
            capacity: self.workspace()?.lists.capacity,
        };
        let (gpu, photos) = (&self.gpu, &mut self.targets.photos);
        scene.masks(&*self.views, |view, mask| {
            photos.leave_out(gpu, view, &mask)
        })
    }
}
