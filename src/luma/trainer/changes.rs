//! What changes between two iterations, beside the steps of Adam.

use super::LumaTrainer;
use crate::{
    gpu::{Buffer, GpuError},
    luma::{
        Densification,
        densify::{self, Evidence, Target},
        memory::ENTRIES_PER_SPLAT,
        outliers, relocation,
    },
    raster::Geometry,
};

impl LumaTrainer {
    /// Splits, moves and removes Gaussians.
    pub(super) fn densify(&mut self, iteration: usize) -> Result<(), GpuError> {
        let evidence = Evidence {
            geometry: &self.geometry.planes.read(&self.gpu)?,
            statistics: &self.workspace().statistics().read(&self.gpu)?,
        };
        let plan = match self.settings.densification {
            Densification::Split => densify::plan(&self.settings, &evidence),
            Densification::Relocate => relocation::plan(&self.settings, &evidence, iteration),
        };
        if plan.is_empty() {
            // Nothing would be left: keep what there is and go on.
            return Ok(());
        }
        let plan = Buffer::from_slice(&self.gpu, "plan", &plan)?;
        let apply = |source: &Buffer<f32>, target| {
            self.kernels
                .densify
                .apply(&self.gpu, &plan, self.geometry.count, source, target)
        };
        let moments = [
            &self.workspace().adam_geometry,
            &self.workspace().adam_field,
        ]
        .map(|adam| [&adam.first, &adam.second].map(|moment| apply(moment, Target::Moments)));
        let planes = apply(&self.geometry.planes, Target::Geometry)?;
        let field = apply(&self.field.planes, Target::Field)?;
        let [[g1, g2], [f1, f2]] = moments;
        let moments = [[g1?, g2?], [f1?, f2?]];
        self.geometry = Geometry {
            count: plan.len(),
            planes,
        };
        self.field.planes = field;
        let capacity = self
            .workspace()
            .lists
            .capacity
            .max(self.geometry.count * ENTRIES_PER_SPLAT);
        self.renew(capacity, iteration, moments)
    }

    /// Looks for pixels that show something else than the scene, and lets them count no
    /// longer; those that were found before get another chance.
    pub(super) fn leave_out_outliers(&mut self) -> Result<(), GpuError> {
        let scene = outliers::Scene {
            raster: &self.raster,
            geometry: &self.geometry,
            field: &self.field,
            near: self.near,
            capacity: self.workspace().lists.capacity,
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
