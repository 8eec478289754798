//! Changes of the model between two iterations, besides Adam's steps.

use super::state::{Grows, LumaTrainer};
use crate::{
    gpu::{Buffer, GpuError},
    luma::{
        DensifyRules, LumaError,
        densify::{self, Evidence},
        densify_3dgs::{self, Moment},
        memory::ENTRIES_PER_SPLAT,
        outliers,
    },
    raster::constants::{GEOMETRY_PLANES, PLANE_MEAN, PLANE_OPACITY, STAT_PULL},
    splats::Splats,
};

/// Lets nothing pull at Gaussians where none may be split.
fn calm(geometry: &[f32], statistics: &mut [f32], grows: &Grows) {
    let n = geometry.len() / GEOMETRY_PLANES;
    for i in 0..n {
        let place = [0, 1, 2].map(|axis| geometry[(PLANE_MEAN + axis) * n + i]);
        if !grows(place) {
            statistics[STAT_PULL * n + i] = 0.0;
        }
    }
}

impl LumaTrainer {
    /// Splits and removes Gaussians.
    pub(super) fn densify(&mut self, iteration: usize) -> Result<(), GpuError> {
        let geometry = self.model.geometry.planes.read(&self.gpu)?;
        let mut statistics = self.workspace()?.statistics().read(&self.gpu)?;
        if let Some(grows) = &self.grows {
            calm(&geometry, &mut statistics, grows);
        }
        let evidence = Evidence {
            geometry: &geometry,
            statistics: &statistics,
            held: self.model.held,
            reserved: match self.is_surrounded() {
                true => 0,
                false => self.surroundings.as_ref().map_or(0, Splats::len),
            },
        };
        let plan = match self.settings.rules {
            DensifyRules::Own => densify::plan(&self.settings, &evidence),
            DensifyRules::Published => {
                let reset_every = self.schedule.reset_every;
                let moment = Moment {
                    iteration,
                    extent: self.extent,
                    removes_large: reset_every.is_some_and(|every| iteration > every),
                };
                densify_3dgs::plan(&self.settings, &evidence, &moment)
            }
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

    /// Makes all Gaussians but the held ones faint, and lets Adam forget where their opacities
    /// went: what is needed becomes opaque again.
    pub(super) fn reset_opacities(&mut self) -> Result<(), GpuError> {
        let (model, gpu) = (&self.model, &self.gpu);
        let first = PLANE_OPACITY * model.len();
        let planes = &model.geometry.planes;
        let mut logits = planes.read(gpu)?.split_off(first);
        logits.truncate(model.len() - model.held);
        densify_3dgs::reset(&mut logits);
        planes.write_at(gpu, first, &logits);
        logits.fill(0.0);
        let moments = &model.geometry_moments;
        moments.first.write_at(gpu, first, &logits);
        moments.second.write_at(gpu, first, &logits);
        Ok(())
    }

    /// Draws these Gaussians from [`Schedule::surround_at`](crate::luma::Schedule) on, behind the
    /// others and as they are.
    pub fn surround(&mut self, surroundings: Splats) {
        self.surroundings = Some(surroundings).filter(|splats| !splats.is_empty());
    }

    /// The same from now on.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`], [`GpuError::Lost`].
    pub fn surround_at_once(&mut self, surroundings: Splats) -> Result<(), GpuError> {
        self.surround(surroundings);
        self.begin_surrounding(self.base)
    }

    /// Returns true if no surroundings are waiting to be drawn.
    pub(super) fn is_surrounded(&self) -> bool {
        self.model.held > 0 || self.surroundings.is_none()
    }

    /// Begins to draw the surroundings after `iteration`.
    pub(super) fn begin_surrounding(&mut self, iteration: usize) -> Result<(), GpuError> {
        if let Some(surroundings) = &self.surroundings {
            self.model.hold(&self.gpu, surroundings)?;
            let present = self.workspace()?.lists.capacity;
            let capacity = present.max(self.model.len() * ENTRIES_PER_SPLAT);
            self.renew(capacity, iteration)?;
        }
        Ok(())
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

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::raster::constants::{STAT_VIEWS, STATISTICS_PLANES};

    #[test]
    fn nothing_is_split_elsewhere() {
        let mut geometry = vec![0.0; 2 * GEOMETRY_PLANES];
        geometry[2 * PLANE_MEAN + 1] = 5.0;
        let mut statistics = vec![3.0; 2 * STATISTICS_PLANES];
        let grows: Grows = Arc::new(|[x, _, _]| x < 1.0);
        calm(&geometry, &mut statistics, &grows);
        assert_eq!(statistics[2 * STAT_PULL..][..2], [3.0, 0.0]);
        assert_eq!(statistics[2 * STAT_VIEWS..][..2], [3.0; 2]);
    }
}
