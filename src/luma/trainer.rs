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
mod watch;

pub use changes::Grows;
pub use watch::HeldOutScore;

use std::{
    ops::ControlFlow,
    sync::Arc,
    time::{Duration, Instant},
};

use watch::Watch;

use super::{
    Checkpointing, Goal, LumaError, LumaSettings, NoCheckpoints, Schedule,
    loss::{self, LossEffects, Targets},
    memory::{Demand, ENTRIES_PER_SPLAT, resident_photos},
    pace::Pace,
    settings::SYNC_EVERY,
    view::TrainingViews,
    workspace::{Kernels, Workspace},
};
use crate::{
    capture::{Exposure, view_at},
    effects::Plan,
    gpu::{Gpu, GpuError, Readback, Recorder},
    raster::{Load, Model, Raster, StatusReadback, ViewUniform, constants::*},
    splats::{Splats, sh},
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

/// Trains geometry and luma.
pub struct LumaTrainer {
    raster: Arc<Raster>,
    gpu: Gpu,
    kernels: Kernels,
    settings: LumaSettings,
    /// Schedule from the settings, as changed since.
    schedule: Schedule,
    goal: Goal,
    extent: f64,
    near: f64,
    views: Arc<dyn TrainingViews>,
    targets: Targets,
    model: Model,
    /// None while a new one is made, which the old one would crowd out, or when there was
    /// no room for it.
    workspace: Option<Workspace>,
    demand: Demand,
    /// Iteration at which the present workspace began to count steps.
    base: usize,
    pace: Pace,
    /// Iterations that a run with time left may take.
    longest: usize,
    watch: Watch,
    /// Shell to draw behind the scene.
    surroundings: Option<Splats>,
    /// Sums over the reports of what [`Self::load`] averages.
    seen: Load,
    /// Reports.
    reports: usize,
    /// Region in which Gaussians may be split, if not everywhere.
    grows: Option<Grows>,
    /// Plan to store in checkpoints.
    plan: Option<Plan>,
    /// Iterations and seconds that an interrupted training had done.
    done: (usize, f64),
}

impl LumaTrainer {
    /// A trainer that starts from `splats` (one channel of the settings' degree).
    ///
    /// # Errors
    /// [`LumaError::Gpu`] when the adapter cannot hold it, [`LumaError::NoViews`], or what is
    /// wrong with a photo.
    pub fn new(
        raster: Arc<Raster>,
        settings: LumaSettings,
        extent: f64,
        splats: &Splats,
        views: impl TrainingViews + 'static,
    ) -> Result<Self, LumaError> {
        let views: Arc<dyn TrainingViews> = Arc::new(views);
        let all = 0..views.count();
        if all.is_empty() {
            return Err(LumaError::NoViews);
        }
        let raster = raster.drawing(settings.raster_options());
        let raster = raster.computing(settings.numerics.raster);
        let gpu = raster.gpu.clone();
        let effects = LossEffects {
            exposed: (all.clone()).any(|view| views.exposure(view) != Exposure::NONE),
            masked: settings.robust || views.masked(),
        };
        let kernels = Kernels::new(&gpu, effects, settings.numerics.ssim_window);
        let near = NEAR_SHARE * extent;
        let schedule = Schedule::of(&settings);
        let demand = Demand::of(
            all.map(|view| views.camera(view)),
            effects.masked,
            splats.sh.degree,
            resident_photos(&settings),
        );
        let longest = ends::LONGER * settings.iterations;
        let capacity = splats.len() * ENTRIES_PER_SPLAT;
        demand.check(settings.memory_limit, splats.len(), capacity)?;
        let targets = Targets::new(&gpu, effects, &views, demand.max_pixels, demand.streams)?;
        let model = Model::upload(&gpu, splats)?;
        let workspace = Workspace::new(&raster, &kernels, &model, &targets, &demand, capacity)?;
        Ok(Self {
            raster,
            gpu,
            kernels,
            settings,
            schedule,
            goal: Goal::Fixed,
            extent,
            near,
            views,
            targets,
            model,
            workspace: Some(workspace),
            demand,
            base: 0,
            pace: Pace::default(),
            longest,
            watch: Watch::default(),
            surroundings: None,
            seen: Load::default(),
            reports: 0,
            grows: None,
            plan: None,
            done: (0, 0.0),
        })
    }

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
            let densifies = schedule.densifies_after(iteration);
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

    /// Trains towards `goal` instead of to the end of the schedule.
    pub fn aim(&mut self, goal: Goal) {
        self.goal = goal;
    }

    /// Splits Gaussians only where that is `true` of their centers; others are trained all the
    /// same.
    pub fn grow_in(&mut self, grows: Option<Grows>) {
        self.grows = grows;
    }

    /// Trains by another schedule than that of its settings.
    pub fn follow(&mut self, schedule: Schedule) {
        self.schedule = schedule;
    }

    /// Settings of the training.
    pub fn settings(&self) -> &LumaSettings {
        &self.settings
    }

    /// When things happen; once it is trained, when they did.
    pub fn schedule(&self) -> &Schedule {
        &self.schedule
    }

    /// Number of surroundings, the last of the Gaussians.
    pub fn surroundings(&self) -> usize {
        self.model.held
    }

    /// Reads the Gaussians.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn splats(&self) -> Result<Splats, GpuError> {
        self.model.download(&self.gpu)
    }

    /// Mean load of an iteration, over the reports.
    pub fn load(&self) -> Load {
        let mean = |sum: f64| sum / self.reports.max(1) as f64;
        let count = self.views.count();
        let pixels = (0..count).map(|view| {
            let camera = self.views.camera(view);
            f64::from(camera.width) * f64::from(camera.height)
        });
        Load {
            splats: mean(self.seen.splats),
            visible: mean(self.seen.visible),
            instances: mean(self.seen.instances),
            capacity: mean(self.seen.capacity),
            pixels: pixels.sum::<f64>() / count as f64,
            tiles: self.demand.max_tiles as f64,
            channels: 1.0,
            sh_planes: sh::coefficient_count(self.model.field.degree) as f64,
            numerics: self.raster.numerics(),
        }
    }

    /// # Errors
    /// [`GpuError::NoWorkspace`] after one could not be made.
    fn workspace(&self) -> Result<&Workspace, GpuError> {
        self.workspace.as_ref().ok_or(GpuError::NoWorkspace)
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
