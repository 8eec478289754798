//! The paper's distillation: Adam on per-Gaussian a/b against the teacher,
//! coarse to fine (ChromaDistill, WACV 2025, algorithm 1); and on RGB, as recipes say.

use std::{ops::RangeInclusive, time::Instant};

use super::{
    ChromaError, ChromaObserver, ChromaProgress, ChromaSettings, Recipe, Targets, Task,
    checkpoint::{Interruptible, SolverState},
    field::FrozenField,
    loss::Space,
    passes::{LossOutput, LossSettings, Passes},
};
use crate::{
    capture::view_at,
    gpu::{Buffer, Gpu, Recorder},
    raster::{Adam, Load},
    splats::{ShField, Splats, sh},
};

/// Iterations between two reports.
const REPORT_EVERY: usize = 50;

/// Iterations, learning rates and scales of the steps.
struct AdamSchedule {
    iterations: usize,
    rates: [f64; 2],
    rest_share: f64,
    seed: u64,
    /// Scales that are drawn, 0 the full one; the coarsest is drawn first.
    scales: RangeInclusive<usize>,
    loss_settings: LossSettings,
    /// Planes of the constant harmonics, then of all that are solved for.
    planes: [usize; 2],
}

/// Distills a teacher into chroma harmonics by Adam, or RGB harmonics by a [`Recipe`].
pub struct AdamSolver<'a> {
    passes: Passes<'a>,
    schedule: AdamSchedule,
    adam: Adam,
    /// Iterations done.
    done: usize,
    /// Seconds of those before.
    seconds: f64,
}

impl<'a> AdamSolver<'a> {
    /// A solver starting from gray.
    ///
    /// # Errors
    /// As [`IrlsSolver::new`](super::IrlsSolver::new).
    ///
    /// # Panics
    /// Where the primitives wait on the host.
    pub fn new(
        frozen: &'a dyn FrozenField,
        settings: ChromaSettings,
        targets: &'a Targets,
        tasks: Vec<Task>,
    ) -> Result<Self, ChromaError> {
        let start = ShField::zeros(frozen.primitives().count(), settings.sh_degree, 2);
        let schedule = AdamSchedule {
            iterations: settings.iterations,
            rates: settings.rates,
            rest_share: settings.rest_share,
            seed: settings.seed,
            scales: 0..=settings.scales as usize,
            loss_settings: LossSettings {
                agreement: settings.agreement,
                robust: settings.robust,
                ..LossSettings::default()
            },
            planes: [2, 2 * sh::coefficient_count(settings.sh_degree)],
        };
        Self::along(frozen, schedule, targets, tasks, &start)
    }

    /// A solver for RGB harmonics by `recipe`, starting from the gray of `luma`; `seed` is that
    /// of the views' order. Targets are RGB.
    ///
    /// # Errors
    /// As [`AdamSolver::new`].
    pub fn by_recipe(
        frozen: &'a dyn FrozenField,
        recipe: &Recipe,
        targets: &'a Targets,
        tasks: Vec<Task>,
        luma: &Splats,
        seed: u64,
    ) -> Result<Self, ChromaError> {
        let gray = luma.sh.to_rgb();
        let (start, of_rest) = match recipe.rest_share {
            Some(_) => {
                let start = gray.raised(sh::MAX_DEGREE);
                let of_rest = sh::coefficient_count(start.degree) - 1;
                (start, of_rest)
            }
            None => (gray, 0),
        };
        let schedule = AdamSchedule {
            iterations: recipe.iterations,
            rates: recipe.rates,
            rest_share: recipe.rest_share.unwrap_or_default(),
            seed,
            scales: recipe.scales.clone(),
            loss_settings: LossSettings {
                agreement: recipe.agreement,
                robust: None,
                lab: recipe.loss,
            },
            planes: [3, 3 + 3 * of_rest],
        };
        Self::along(frozen, schedule, targets, tasks, &start)
    }

    fn along(
        frozen: &'a dyn FrozenField,
        schedule: AdamSchedule,
        targets: &'a Targets,
        tasks: Vec<Task>,
        start: &ShField,
    ) -> Result<Self, ChromaError> {
        assert!(frozen.streamed().is_none(), "all primitives on the device");
        let gpu = frozen.gpu();
        let sizes = [1 + schedule.scales.end(), REPORT_EVERY];
        let [_, planes] = schedule.planes;
        let passes = Passes::new(frozen, targets, tasks, start, planes, Space::Lab, sizes)?;
        let adam = Adam::new(
            gpu,
            &frozen.kernels().adam,
            &passes.status,
            &passes.gradient,
            &passes.field.planes,
            frozen.primitives().count(),
        )?;
        Ok(Self {
            passes,
            schedule,
            adam,
            done: 0,
            seconds: 0.0,
        })
    }

    fn gpu(&self) -> &'a Gpu {
        self.passes.frozen.gpu()
    }

    /// Distills to the last iteration, telling `observe` now and then.
    ///
    /// # Errors
    /// [`ChromaError`] when the device is lost or targets cannot be read.
    pub fn run(&mut self, observe: &mut ChromaObserver<'_>) -> Result<(), ChromaError> {
        self.run_to(self.schedule.iterations, observe)
    }

    /// Goes on until so many iterations are done, and leaves the rest for later.
    ///
    /// # Errors
    /// As [`AdamSolver::run`].
    pub fn run_to(
        &mut self,
        until: usize,
        observe: &mut ChromaObserver<'_>,
    ) -> Result<(), ChromaError> {
        let begun = Instant::now();
        let mut pending = None;
        let until = until.min(self.schedule.iterations);
        for iteration in self.done..until {
            self.step(iteration)?;
            let done = iteration + 1;
            self.done = done;
            let ends = done == until;
            if !(ends || done.is_multiple_of(REPORT_EVERY)) {
                continue;
            }
            let due = pending.replace((done, self.passes.log.read_later(self.gpu())));
            let last = if ends { pending.take() } else { None };
            for (done, losses) in due.into_iter().chain(last) {
                let losses = losses.wait(self.gpu())?;
                let recent = &losses[..done - (done - 1) / REPORT_EVERY * REPORT_EVERY];
                let told = observe(ChromaProgress {
                    iteration: done,
                    total: self.schedule.iterations,
                    moved: None,
                    loss: recent.iter().map(|&loss| f64::from(loss)).sum::<f64>()
                        / recent.len() as f64,
                    passes: done as f64 * self.schedule.scales.clone().map(share).sum::<f64>(),
                    seconds: self.seconds + begun.elapsed().as_secs_f64(),
                });
                if told.is_break() {
                    return Err(ChromaError::Cancelled);
                }
            }
        }
        self.seconds += begun.elapsed().as_secs_f64();
        Ok(())
    }

    /// Reads the harmonics distilled so far.
    ///
    /// # Errors
    /// [`ChromaError::Gpu`] when the device is lost.
    pub fn harmonics(&self) -> Result<ShField, ChromaError> {
        self.passes.harmonics()
    }

    /// Work of a dispatch, the mean over the passes.
    pub fn load(&self) -> Load {
        self.passes.load(1 + self.schedule.scales.end())
    }

    /// One view through all scales, one step of Adam a scale.
    fn step(&mut self, iteration: usize) -> Result<(), ChromaError> {
        let gpu = self.gpu();
        let schedule = &self.schedule;
        let task = view_at(schedule.seed, self.passes.tasks.len(), iteration);
        let rate = exponential(schedule.rates, iteration, schedule.iterations);
        let [constants, planes] = schedule.planes;
        let mut rates = vec![(rate * schedule.rest_share) as f32; planes];
        rates[..constants].fill(rate as f32);
        let (finest, coarsest) = (*schedule.scales.start(), *schedule.scales.end());
        for scale in (finest..=coarsest).rev() {
            let mut recorder = Recorder::new(gpu);
            recorder.clear(self.passes.gradient.raw());
            recorder.submit();
            let agreement = schedule.loss_settings.agreement;
            let loss_settings = LossSettings {
                agreement: if scale < coarsest { agreement } else { 0.0 },
                ..schedule.loss_settings
            };
            // The finest scale is drawn last, and its loss stays.
            self.passes
                .draw(task, scale, loss_settings, iteration, LossOutput::Gradient)?;
            let done = iteration * (coarsest - finest + 1) + coarsest - scale;
            let step = u32::try_from(done + 1).unwrap_or(u32::MAX);
            let mut recorder = Recorder::new(gpu);
            let kernel = &self.passes.frozen.kernels().adam;
            self.adam.record(gpu, kernel, &mut recorder, step, &rates);
            recorder.submit();
        }
        Ok(())
    }
}

impl AdamSolver<'_> {
    /// Buffers that the next step goes by.
    fn kept(&self) -> [(&'static str, &Buffer<f32>); 3] {
        [
            ("harmonics", &self.passes.field.planes),
            ("first moments", &self.adam.moments.first),
            ("second moments", &self.adam.moments.second),
        ]
    }
}

impl Interruptible for AdamSolver<'_> {
    fn go_on(&mut self, observe: &mut ChromaObserver<'_>) -> Result<bool, ChromaError> {
        let goes_on = self.done < self.schedule.iterations;
        // To where all losses are told.
        self.run_to(self.done + REPORT_EVERY, observe)?;
        Ok(goes_on)
    }

    fn so_far(&self) -> Result<ShField, ChromaError> {
        self.harmonics()
    }

    fn state(&self) -> Result<SolverState, ChromaError> {
        let mut state = SolverState::default();
        state.rounds.done = self.done;
        state.rounds.seconds = self.seconds;
        for (name, buffer) in self.kept() {
            let values = buffer.read(self.gpu())?;
            state.buffers.insert(name.to_owned(), values);
        }
        Ok(state)
    }

    fn go_on_from(&mut self, state: &SolverState) -> bool {
        self.done = state.rounds.done;
        self.seconds = state.rounds.seconds;
        let mut kept = self.kept().into_iter();
        kept.all(|(name, buffer)| state.put(name, buffer, self.gpu()))
    }
}

/// Colors `luma` by `recipe`; the targets of `tasks` are RGB pictures, and `seed` is that of
/// the views' order.
///
/// # Errors
/// As [`solve`](super::solve); [`ChromaError::Cancelled`] where `observe` says so.
pub fn follow_recipe(
    frozen: &dyn FrozenField,
    recipe: &Recipe,
    targets: &Targets,
    tasks: Vec<Task>,
    luma: &Splats,
    seed: u64,
    observe: &mut ChromaObserver<'_>,
) -> Result<ShField, ChromaError> {
    let mut adam = AdamSolver::by_recipe(frozen, recipe, targets, tasks, luma, seed)?;
    adam.run(observe)?;
    adam.harmonics()
}

/// A rate that falls from the first to the last by the same share in each of so many
/// iterations.
fn exponential([first, last]: [f64; 2], iteration: usize, iterations: usize) -> f64 {
    let t = iteration as f64 / iterations.max(1) as f64;
    first * (last / first).powf(t.min(1.0))
}

/// Cost of a pass over one scale, as a share of one at full size.
fn share(scale: usize) -> f64 {
    0.25_f64.powi(scale as i32)
}
