//! Room on the device for what is trained.

use super::LumaTrainer;
use crate::{
    gpu::{Buffer, GpuError, Recorder},
    luma::workspace::Workspace,
    raster::AdamState,
};

/// Room left above what an overflowing view needed.
const HEADROOM: f64 = 1.25;

impl LumaTrainer {
    /// Room for a view that needed so many entries of the tile lists.
    pub(super) fn make_room(&mut self, needed: usize, iteration: usize) -> Result<(), GpuError> {
        self.rebuild((needed as f64 * HEADROOM) as usize, iteration)
    }

    /// A new workspace with the same Gaussians and moments.
    pub(super) fn rebuild(&mut self, capacity: usize, iteration: usize) -> Result<(), GpuError> {
        let keep = |adam: &AdamState| -> Result<[Buffer<f32>; 2], GpuError> {
            let copies = [
                Buffer::zeros(&self.gpu, "first moments", adam.first.len())?,
                Buffer::zeros(&self.gpu, "second moments", adam.second.len())?,
            ];
            let mut recorder = Recorder::new(&self.gpu);
            recorder.copy(adam.first.raw(), copies[0].raw());
            recorder.copy(adam.second.raw(), copies[1].raw());
            recorder.submit();
            Ok(copies)
        };
        let moments = [
            keep(&self.workspace().adam_geometry)?,
            keep(&self.workspace().adam_field)?,
        ];
        // Statistics since the last densification go on.
        let statistics = self.workspace().statistics().clone();
        self.renew(capacity, iteration, moments)?;
        let mut recorder = Recorder::new(&self.gpu);
        recorder.copy(statistics.raw(), self.workspace().statistics().raw());
        recorder.submit();
        Ok(())
    }

    /// A new workspace for the present Gaussians with these moments.
    pub(super) fn renew(
        &mut self,
        capacity: usize,
        iteration: usize,
        moments: [[Buffer<f32>; 2]; 2],
    ) -> Result<(), GpuError> {
        let limit = self.settings.memory_limit;
        self.demand.check(limit, self.geometry.count, capacity)?;
        // Losses since the last report go on.
        let losses = self.workspace().log.losses.clone();
        self.workspace = None;
        // Only now the device frees what it held.
        self.gpu.wait()?;
        let workspace = Workspace::new(
            &self.raster,
            &self.kernels,
            &self.settings,
            &self.geometry,
            &self.field,
            &self.targets,
            [self.max_pixels, self.max_tiles],
            capacity,
            Some(moments),
        );
        self.workspace = Some(workspace.map_err(|error| error.of_splats(self.geometry.count))?);
        let mut recorder = Recorder::new(&self.gpu);
        recorder.copy(losses.raw(), self.workspace().log.losses.raw());
        recorder.submit();
        self.base = iteration;
        Ok(())
    }
}
