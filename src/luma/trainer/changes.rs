//! What changes between two iterations, beside the steps of Adam.

use glam::DVec3;

use super::LumaTrainer;
use crate::{
    capture::Camera,
    gpu::{Buffer, GpuError},
    luma::{
        Densification,
        densify::{self, Evidence, Target},
        memory::ENTRIES_PER_SPLAT,
        outliers, relocation,
    },
    raster::{Geometry, constants::PLANE_OPACITY},
};

/// Opacity to which a reset lowers (3DGS).
const RESET_OPACITY: f32 = 0.01;

impl LumaTrainer {
    /// Splits, moves and removes Gaussians.
    pub(super) fn densify(&mut self, iteration: usize) -> Result<(), GpuError> {
        let evidence = Evidence {
            geometry: &self.geometry.planes.read(&self.gpu)?,
            statistics: &self.workspace().statistics().read(&self.gpu)?,
            extent: self.extent,
            center: center(&self.cameras),
            prune_large: iteration > self.settings.schedule.reset_every,
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

    /// Lowers every opacity and forgets its momentum.
    pub(super) fn reset_opacities(&self) -> Result<(), GpuError> {
        let n = self.geometry.count;
        let first = PLANE_OPACITY * n;
        let ceiling = (RESET_OPACITY / (1.0 - RESET_OPACITY)).ln();
        let planes = self.geometry.planes.read(&self.gpu)?;
        let lowered: Vec<f32> = planes[first..first + n]
            .iter()
            .map(|&logit| logit.min(ceiling))
            .collect();
        self.geometry.planes.write_at(&self.gpu, first, &lowered);
        for moment in [
            &self.workspace().adam_geometry.first,
            &self.workspace().adam_geometry.second,
        ] {
            moment.write_at(&self.gpu, first, &vec![0.0; n]);
        }
        Ok(())
    }
}

/// The mean of the cameras' centres.
fn center(cameras: &[Camera]) -> [f64; 3] {
    let sum: DVec3 = cameras.iter().map(Camera::center).sum();
    (sum / cameras.len().max(1) as f64).to_array()
}
