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
    splats::Splats,
};

impl LumaTrainer {
    /// Splits, moves and removes Gaussians.
    pub(super) fn densify(&mut self, iteration: usize) -> Result<(), GpuError> {
        let evidence = Evidence {
            geometry: &self.model.geometry.planes.read(&self.gpu)?,
            statistics: &self.workspace()?.statistics().read(&self.gpu)?,
            held: self.model.held,
            reserved: match self.is_surrounded() {
                true => 0,
                false => self.surroundings.as_ref().map_or(0, Splats::len),
            },
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

    /// Whether there is nothing to be drawn that is not drawn yet.
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
