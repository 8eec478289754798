//! Room on the device for what is trained.

use super::state::LumaTrainer;
use crate::{
    gpu::{GpuError, Recorder},
    luma::workspace::Workspace,
};

/// Room left above what an overflowing view needed.
const HEADROOM: f64 = 1.25;

impl LumaTrainer {
    /// Room for a view that needed so many entries of the tile lists.
    pub(super) fn make_room(&mut self, needed: usize, iteration: usize) -> Result<(), GpuError> {
        self.rebuild((needed as f64 * HEADROOM) as usize, iteration)
    }

    /// A new workspace; statistics go on.
    pub(super) fn rebuild(&mut self, capacity: usize, iteration: usize) -> Result<(), GpuError> {
        // Statistics since the last densification go on.
        let statistics = self.workspace()?.statistics().clone();
        self.renew(capacity, iteration)?;
        let mut recorder = Recorder::new(&self.gpu);
        recorder.copy(statistics.raw(), self.workspace()?.statistics().raw());
        recorder.submit();
        Ok(())
    }

    /// A new workspace for the present model.
    pub(super) fn renew(&mut self, capacity: usize, iteration: usize) -> Result<(), GpuError> {
        let limit = self.settings.memory_limit;
        self.demand.check(limit, self.model.len(), capacity)?;
        // Losses since the last report go on.
        let losses = self.workspace()?.log.losses.clone();
        self.workspace = None;
        // Only now the device frees what it held.
        self.gpu.wait()?;
        let workspace = Workspace::new(
            &self.raster,
            &self.kernels,
            &self.model,
            &self.targets,
            &self.demand,
            capacity,
        );
        self.workspace = Some(workspace.map_err(|error| error.of_splats(self.model.len()))?);
        let mut recorder = Recorder::new(&self.gpu);
        recorder.copy(losses.raw(), self.workspace()?.log.losses.raw());
        recorder.submit();
        self.base = iteration;
        Ok(())
    }
}
