//! What changes between two iterations, beside the steps of Adam.

use super::LumaTrainer;
use crate::{
    gpu::{Buffer, GpuError},
    luma::{
        Densification,
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
    pub(super) fn leave_out_outliers(&mut self) -> Result<(), GpuError> {
        let scene = outliers::Scene {
            raster: &self.raster,
            geometry: &self.model.geometry,
            field: &self.model.field,
            near: self.near,
            capacity: self.workspace()?.lists.capacity,
        };
        let photos: Vec<_> = (0..self.exposures.len())
            .map(|index| outliers::Photo {
                camera: &self.cameras[index],
                gray: &self.pictures[index].0,
                mask: &self.pictures[index].1,
                exposure: self.exposures[index],
            })
            .collect();
        let found = scene.masks(&photos)?;
        if let Some(masks) = &mut self.targets.masks {
            for (index, mask) in found.iter().enumerate() {
                masks.replace(&self.gpu, index, mask);
            }
        }
        Ok(())
    }
}
