//! The training loop of stage 1.
//!
//! An iteration is one submission without a read-back. Every [`SYNC_EVERY`]
//! iterations, and oftener at first, the host orders losses and counts and
//! meanwhile goes on; it waits for an order only when the next one is due. When
//! tile lists overflow, the device stops taking steps by itself; the host learns
//! how many it took, grows the lists and repeats from there, so that the result
//! does not depend on when it noticed.

mod best;
mod capacity;
mod changes;
mod checkpoint;
mod ends;
mod rates;
mod scores;
mod state;
mod watch;

pub use scores::{AlbumPicture, HeldOutScore};
pub use state::{Grows, LumaTrainer};

use std::{
    ops::ControlFlow,
    time::{Duration, Instant},
};

use super::{Checkpointing, LumaError, NoCheckpoints, loss, settings::SYNC_EVERY};
use crate::{
    capture::view_at,
    gpu::{Readback, Recorder},
    raster::{StatusReadback, ViewUniform},
};

/// Progress of a training.
#[derive(Clone, Copy, Debug)]
pub struct LumaProgress {
    /// Iterations done.
    pub iteration: usize,
    /// Iterations in all, as it looks now.
    pub end: usize,
    /// Mean loss since the last report.
    pub loss: f64,
    /// Gaussians.
    pub splats: usize,
    /// Gaussians culled for values that are not finite, since the set last changed.
    pub poisoned: usize,
    /// Gradients refused for not being finite, since the set last changed.
    pub refused: usize,
    /// Seconds of training, those of watching not counted.
    pub seconds: f64,
    /// Score of the last validation on the [watched](LumaTrainer::watch) views.
    pub looked: Option<HeldOutScore>,
}

/// An order on its way: the status and losses at the end of an iteration.
struct Report {
    /// Iterations done when it was ordered, had none been refused.
    iteration: usize,
    /// True if the caller is notified of it, and not only of an overflow.
    told: bool,
    status: StatusReadback,
    losses: Readback<f32>,
}

impl LumaTrainer {
    /// Trains to the end of the schedule, or to where a time limit or a flat curve puts it,
    /// telling `observe` now and then. Where it goes back to the best on the way, iterations
    /// are counted from there again.
    ///
    /// # Errors
    /// [`GpuError`] when the device runs out of room or is lost.
    pub fn train(&mut self, observe: &mut dyn FnMut(LumaProgress)) -> Result<(), LumaError> {
        self.train_while(&mut |progress| {
            observe(progress);
            ControlFlow::Continue(())
        })
    }

    /// [`Self::train`], unless `observe` says that it is enough: what is trained by then stays.
    ///
    /// # Errors
    /// As there, and [`LumaError::Cancelled`].
    pub fn train_while(
        &mut self,
        observe: &mut dyn FnMut(LumaProgress) -> ControlFlow<()>,
    ) -> Result<(), LumaError> {
        self.train_keeping(&mut NoCheckpoints, observe)
    }

    /// The same; `checkpointing` is asked now and then whether it wants a checkpoint, which changes
    /// nothing in what is trained.
    ///
    /// # Errors
    /// As there; [`LumaError::Cancelled`] also where the checkpointing wants no more.
    pub fn train_keeping(
        &mut self,
        checkpointing: &mut dyn Checkpointing,
        observe: &mut dyn FnMut(LumaProgress) -> ControlFlow<()>,
    ) -> Result<(), LumaError> {
        let (mut iteration, seconds) = self.done;
        let now = Instant::now();
        let begun = now
            .checked_sub(Duration::from_secs_f64(seconds))
            .unwrap_or(now);
        let mut pending: Option<Report> = None;
        while iteration < self.schedule.end {
            self.step(iteration)?;
            iteration += 1;
            let schedule = &self.schedule;
            let densifies = schedule.densifies_after(iteration) || schedule.resets_after(iteration);
            let finds_outliers =
                self.settings.robust && schedule.find_outliers_at.contains(&iteration);
            let ends = iteration == schedule.end;
            let looks = self.watch.is_due(iteration, schedule.end);
            // Its losses are told by then.
            let keeps =
                iteration.is_multiple_of(SYNC_EVERY) && !ends && checkpointing.wants(iteration);
            let surrounds = !self.is_surrounded() && !ends && iteration >= schedule.surround_at;
            let pauses = surrounds || densifies || finds_outliers || looks || ends || keeps;
            // The first views say how much room is needed: those lost to an overflow
            // are few if it is noticed early.
            let early = iteration < SYNC_EVERY && iteration.is_power_of_two();
            let told = pauses || iteration.is_multiple_of(SYNC_EVERY);
            if iteration.is_multiple_of(SYNC_EVERY) && checkpointing.looks_on() {
                let asked = Instant::now();
                checkpointing.show(self.splats()?, asked.elapsed());
            }
            if !(told || early) {
                continue;
            }
            let order = Report {
                iteration,
                told,
                status: self.workspace()?.lists.status_later(&self.gpu),
                losses: self.workspace()?.log.read_later(&self.gpu),
            };
            // Before the set changes or is looked at, and at the end, nothing may be left open.
            let mut due: Vec<Report> = pending.take().into_iter().collect();
            if pauses {
                due.push(order);
            } else {
                pending = Some(order);
            }
            let mut refused = None;
            for report in due {
                if let Some(done) = self.review(report, &begun, observe)? {
                    refused = Some(done);
                    break;
                }
            }
            if let Some(done) = refused {
                pending = None;
                iteration = done;
                continue;
            }
            if looks {
                let seconds = begun.elapsed().as_secs_f64() - self.watch.seconds;
                self.look(iteration, seconds)?;
                self.settle_when_reached(iteration);
                if let Some(best) = self.stop_when_flat(iteration)? {
                    iteration = best;
                    self.pace.back_to(best, begun.elapsed().as_secs_f64());
                    self.keep_to_limit(best);
                    continue;
                }
            }
            if !ends {
                self.keep_to_limit(iteration);
            }
            if self.schedule.densifies_after(iteration) {
                self.densify(iteration)?;
            }
            if self.schedule.resets_after(iteration) {
                self.reset_opacities()?;
            }
            if surrounds {
                self.begin_surrounding(iteration)?;
            }
            if finds_outliers {
                self.leave_out_outliers()?;
            }
            if keeps {
                let checkpoint = self.checkpoint(iteration, begun.elapsed().as_secs_f64())?;
                if !checkpointing.keep(checkpoint) {
                    return Err(LumaError::Cancelled);
                }
            }
        }
        Ok(())
    }

    /// Records and submits one iteration.
    fn step(&mut self, iteration: usize) -> Result<(), LumaError> {
        let views = self.views.count();
        let seed = self.settings.seed;
        let photo_at = |iteration| view_at(seed, views, iteration);
        let photo = photo_at(iteration);
        let exposure = self.views.exposure(photo);
        let next = (iteration + 1..self.schedule.end).map(photo_at);
        let picture = self.targets.show(&self.gpu, photo, exposure, next)?;
        let workspace = self.workspace()?;
        let view = ViewUniform::new(
            self.views.camera(photo),
            self.near,
            self.model.len(),
            self.degree_at(iteration),
        );
        let mut recorder = Recorder::new(&self.gpu);
        workspace.lists.set_view(&self.gpu, &view);
        workspace.lists.record(&self.raster, &mut recorder);
        workspace.layer.record(&self.raster, &mut recorder);
        workspace.losses[picture].record(&self.kernels.loss, &mut recorder, &view);
        let [x, y] = loss::blocks(&view);
        workspace.log.record(
            &self.gpu,
            &self.kernels.sum_loss,
            &mut recorder,
            x * y,
            view.pixel_count(),
            iteration,
        );
        let step = u32::try_from(iteration + 1).unwrap_or(u32::MAX);
        let rates = self.geometry_rates(iteration);
        let (geometry, field) = (&workspace.geometry_step, &workspace.field_step);
        geometry.set(&self.gpu, step, &rates);
        field.set(&self.gpu, step, &self.field_rates(iteration));
        workspace.adjoint.record(&self.raster, &mut recorder);
        recorder.submit();
        Ok(())
    }

    /// Looks at a report. Gives the iterations that were really done when the
    /// lists overflowed, after making room.
    fn review(
        &mut self,
        report: Report,
        begun: &Instant,
        observe: &mut dyn FnMut(LumaProgress) -> ControlFlow<()>,
    ) -> Result<Option<usize>, LumaError> {
        let status = report.status.wait(&self.gpu)?;
        if let Some(needed) = status.overflow {
            let done = self.base + status.steps;
            self.make_room(needed, done)?;
            return Ok(Some(done));
        }
        let losses = report.losses.wait(&self.gpu)?;
        self.seen.splats += self.model.len() as f64;
        self.seen.visible += status.visible as f64;
        self.seen.instances += status.instances as f64;
        self.seen.capacity += self.workspace()?.lists.capacity as f64;
        self.reports += 1;
        let all_seconds = begun.elapsed().as_secs_f64();
        self.pace.note(report.iteration, all_seconds);
        if !report.told {
            return Ok(None);
        }
        let since = (report.iteration - 1) / SYNC_EVERY * SYNC_EVERY;
        let recent = &losses[..report.iteration - since];
        let told = observe(LumaProgress {
            iteration: report.iteration,
            end: self.schedule.end,
            loss: recent.iter().map(|&loss| f64::from(loss)).sum::<f64>() / recent.len() as f64,
            splats: self.model.len(),
            poisoned: status.poisoned,
            refused: status.refused,
            seconds: all_seconds - self.watch.seconds,
            looked: self.watch.last(),
        });
        match told {
            ControlFlow::Continue(()) => Ok(None),
            ControlFlow::Break(()) => Err(LumaError::Cancelled),
        }
    }
}
