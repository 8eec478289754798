//! Going on from a checkpoint, and making one.

use super::{scores::Best, state::LumaTrainer};
use crate::{
    effects::Plan,
    gpu::GpuError,
    luma::{
        LumaError,
        checkpoint::{Checkpoint, TrainingState},
    },
};

impl LumaTrainer {
    /// The plan that its checkpoints hold.
    pub(in crate::luma) fn remember(&mut self, plan: Plan) {
        self.plan = Some(plan);
    }

    /// The training after `iteration` and `seconds`. Nothing may be on its way.
    pub(super) fn checkpoint(
        &self,
        iteration: usize,
        seconds: f64,
    ) -> Result<Checkpoint, GpuError> {
        let workspace = self.workspace()?;
        let best = self.watch.best.as_ref();
        Ok(Checkpoint {
            model: self.model.snapshot(&self.gpu)?,
            statistics: workspace.statistics().read(&self.gpu)?,
            best: best.map(|best| best.model.clone()),
            left_out: self.targets.photos.left_out(),
            state: TrainingState {
                plan: self.plan.clone(),
                iteration,
                seconds,
                schedule: self.schedule.clone(),
                longest: self.longest,
                pace: self.pace.clone(),
                base: self.base,
                status: workspace.lists.status.read(&self.gpu)?,
                capacity: workspace.lists.capacity,
                next_look: self.watch.next,
                curve: self.watch.curve.clone(),
                watched_seconds: self.watch.seconds,
                held: [self.model.held, best.map_or(0, |best| best.model.held)],
                best: best.map(|best| (best.iteration, best.psnr)),
                given_up: self.watch.given_up,
                seen: self.seen,
                reports: self.reports,
            },
        })
    }

    /// Goes on from a checkpoint of a training with the same settings and views when it trains;
    /// what it has done so far is forgotten.
    ///
    /// # Errors
    /// [`GpuError`], or [`LumaError`] of a photo.
    pub fn resume(&mut self, checkpoint: &Checkpoint) -> Result<(), LumaError> {
        let state = &checkpoint.state;
        self.model.restore(&self.gpu, &checkpoint.model)?;
        self.renew(state.capacity, state.base)?;
        let workspace = self.workspace()?;
        workspace
            .statistics()
            .write(&self.gpu, &checkpoint.statistics);
        workspace.lists.status.write(&self.gpu, &state.status);
        for (photo, bits) in &checkpoint.left_out {
            let photos = &mut self.targets.photos;
            photos.leave_out_bits(&self.gpu, &*self.views, *photo, bits.clone())?;
        }
        self.schedule = state.schedule.clone();
        self.longest = state.longest;
        self.pace = state.pace.clone();
        self.seen = state.seen;
        self.reports = state.reports;
        self.watch.next = state.next_look;
        self.watch.curve.clone_from(&state.curve);
        self.watch.seconds = state.watched_seconds;
        self.watch.given_up = state.given_up;
        let best = state.best.zip(checkpoint.best.as_ref());
        self.watch.best = best.map(|((iteration, psnr), model)| Best {
            iteration,
            psnr,
            model: model.clone(),
        });
        self.done = (state.iteration, state.seconds);
        Ok(())
    }
}
