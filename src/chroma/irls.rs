//! The fast solver: with the geometry frozen, colors at each pixel are linear in the
//! unknowns, so the distillation is a robust linear regression. Iteratively reweighted
//! least squares, whose steps L-BFGS makes longer, over all views and all of it on the
//! device.

use std::time::Instant;

use super::{
    ChromaError, ChromaObserver, ChromaProgress, ChromaSettings, FrozenViews, Targets, Task,
    lbfgs::{Lbfgs, System, UNBOUNDED},
    passes::{Ending, Judging, Passes},
    progress::share,
};
use crate::{
    gpu::{Buffer, Gpu, Readback, Recorder},
    raster::{ColorKind, Field, Load},
    splats::{ShField, sh},
};

/// Residual, in CIELAB units, of a pixel that counts as one.
const TYPICAL_RESIDUAL: f64 = 3.0;

/// Black to white of RGB in the units of the loss.
const RGB_UNITS: f64 = 100.0;

/// One reweighting.
#[derive(Clone, Debug, PartialEq)]
struct Round {
    /// How often the pictures' size is halved.
    scale: usize,
    /// Residual at which the loss of a and b together levels off; without one, each has
    /// its own.
    robust: Option<f32>,
    /// Whether the views' corrections are found anew after it.
    corrects: bool,
}

/// The rounds that the settings ask for: on each coarser scale, to bring the views'
/// corrections and the colors close at little cost, then at full size.
fn rounds(settings: &ChromaSettings) -> Vec<Round> {
    let round = |scale, settled: bool| Round {
        scale,
        // It never levels off at first: what is far off now may be right once the rest is
        // in place.
        robust: (settings.robust).map(|residual| if settled { residual } else { f32::INFINITY }),
        corrects: settings.correct_views,
    };
    let coarsest = settings.coarse_scales as usize;
    let coarse = (1..=coarsest).rev().flat_map(|scale| {
        let settled = move |index| scale < coarsest || index >= PLAIN_ROUNDS;
        (0..settings.coarse_rounds).map(move |index| round(scale, settled(index)))
    });
    let full = (0..settings.rounds).map(|index| round(0, coarsest > 0 || index >= PLAIN_ROUNDS));
    coarse.chain(full).collect()
}

/// Rounds before the loss levels off.
const PLAIN_ROUNDS: usize = 4;

/// Solves for chroma or RGB harmonics.
pub struct IrlsSolver<'a> {
    passes: Passes<'a>,
    system: System,
    lbfgs: Lbfgs,
    rounds: Vec<Round>,
    /// Of the largest view.
    pixels: usize,
    spent: f64,
    /// Rounds done.
    done: usize,
}

impl<'a> IrlsSolver<'a> {
    /// A solver for chroma, starting from gray.
    ///
    /// # Errors
    /// [`ChromaError::NoViews`] without tasks, [`ChromaError::WrongSize`] when a target
    /// has not its camera's size, [`ChromaError::Gpu`].
    pub fn new(
        frozen: &'a FrozenViews,
        settings: &ChromaSettings,
        targets: &'a Targets,
        tasks: Vec<Task>,
    ) -> Result<Self, ChromaError> {
        let start = ShField::zeros(frozen.geometry.count, settings.sh_degree, 2);
        Self::starting_at(frozen, settings, targets, tasks, &start)
    }

    /// A solver for the harmonics up to the settings' degree of a/b or RGB, the others
    /// staying as they are in `start`.
    ///
    /// # Errors
    /// As [`IrlsSolver::new`].
    pub(super) fn starting_at(
        frozen: &'a FrozenViews,
        settings: &ChromaSettings,
        targets: &'a Targets,
        tasks: Vec<Task>,
        start: &ShField,
    ) -> Result<Self, ChromaError> {
        let gpu = &frozen.raster.gpu;
        let rounds = rounds(settings);
        let scales = rounds.iter().map(|round| round.scale).max().unwrap_or(0) + 1;
        let field = Field::upload(gpu, start)?;
        let channels = start.channels;
        let planes = channels * sh::coefficient_count(settings.sh_degree.min(start.degree));
        let sizes = [scales, tasks.len()];
        let passes = Passes::new(frozen, targets, tasks, field, planes, sizes)?;
        let count = frozen.geometry.count;
        let origin = Buffer::zeros(gpu, "origin", planes * count)?;
        let mut recorder = Recorder::new(gpu);
        recorder.copy_front(passes.field.planes.raw(), origin.raw());
        recorder.submit();
        let system = System {
            unknowns: passes.field.planes.clone(),
            gradient: passes.gradient.clone(),
            diagonal: passes.diagonal.clone(),
            origin,
            floors: Buffer::from_slice(gpu, "floors", &vec![UNBOUNDED; planes * count])?,
            losses: passes.log.losses.clone(),
        };
        let views = passes.tasks.iter().map(|task| frozen.uniform(task.view, 0));
        let pixels = views.map(|view| view.pixel_count()).max().unwrap_or(1);
        let units = match passes.field.kind {
            ColorKind::Rgb => RGB_UNITS * RGB_UNITS,
            ColorKind::Chroma | ColorKind::Luma => 1.0,
        };
        let ridge = units * settings.ridge * 0.5 / pixels as f64 * sh::C0 * sh::C0;
        let size = [count, channels];
        let lbfgs = Lbfgs::new(gpu, &frozen.kernels.lbfgs, &system, size, ridge as f32)?;
        Ok(Self {
            passes,
            system,
            lbfgs,
            rounds,
            pixels,
            spent: 0.0,
            done: 0,
        })
    }

    fn gpu(&self) -> &'a Gpu {
        &self.passes.frozen.raster.gpu
    }

    /// Lets no unknown fall below these, planes as the unknowns are.
    pub(super) fn set_floors(&mut self, floors: &[f32]) {
        self.system.floors.write(self.gpu(), floors);
    }

    /// Rounds that [`IrlsSolver::run`] takes.
    pub fn round_count(&self) -> usize {
        self.rounds.len()
    }

    /// Solves, telling `observe` after each round.
    ///
    /// # Errors
    /// [`ChromaError`] when the device is lost or targets cannot be read.
    pub fn run(&mut self, observe: &mut ChromaObserver<'_>) -> Result<(), ChromaError> {
        self.run_to(self.rounds.len(), observe)
    }

    /// Goes on until so many rounds are done, and leaves the rest for later.
    ///
    /// # Errors
    /// As [`IrlsSolver::run`].
    pub fn run_to(
        &mut self,
        until: usize,
        observe: &mut ChromaObserver<'_>,
    ) -> Result<(), ChromaError> {
        let begun = Instant::now();
        let gpu = self.gpu();
        let mut pending: Option<(usize, f64, Readback<f32>)> = None;
        let until = until.min(self.rounds.len());
        for index in self.done..until {
            let round = self.rounds[index].clone();
            if index > 0 && self.rounds[index - 1] != round {
                self.lbfgs.restart(gpu);
            }
            self.draw(&round, true)?;
            let log = self.passes.log.read_later(gpu);
            let mut recorder = Recorder::new(gpu);
            // The first picture is gray and says nothing about the teachers.
            if round.corrects && index > 0 {
                let kernels = &self.passes.frozen.kernels.correction;
                self.passes.corrections.solve(kernels, &mut recorder);
            }
            self.lbfgs.step(&mut recorder);
            recorder.submit();
            self.done = index + 1;
            if self.done == self.rounds.len() {
                self.draw(&round, false)?;
                let mut recorder = Recorder::new(gpu);
                self.lbfgs.end(&mut recorder);
                recorder.submit();
            }
            let due = pending.replace((index, self.spent, log));
            let last = if self.done == until {
                pending.take()
            } else {
                None
            };
            for (index, passes, losses) in due.into_iter().chain(last) {
                let told = observe(ChromaProgress {
                    iteration: index + 1,
                    total: self.rounds.len(),
                    loss: mean(&losses.wait(gpu)?),
                    passes,
                    seconds: begun.elapsed().as_secs_f64(),
                });
                if told.is_break() {
                    return Err(ChromaError::Cancelled);
                }
            }
        }
        Ok(())
    }

    /// The plain loss of `chroma` over all views at full size, in CIELAB units: what the
    /// solvers are compared by. Teachers count as corrected so far, which is not at all
    /// before the second round. Leaves the solver with this field.
    ///
    /// # Errors
    /// [`ChromaError`].
    pub fn objective(&mut self, chroma: &ShField) -> Result<f64, ChromaError> {
        let gpu = self.gpu();
        let planes = Field::upload(gpu, chroma)?.planes;
        let mut recorder = Recorder::new(gpu);
        recorder.copy(planes.raw(), self.passes.field.planes.raw());
        recorder.submit();
        let spent = self.spent;
        let plain = Round {
            scale: 0,
            robust: None,
            corrects: false,
        };
        self.draw(&plain, false)?;
        self.spent = spent;
        self.lbfgs.restart(gpu);
        Ok(mean(&self.passes.log.read_later(gpu).wait(gpu)?))
    }

    /// How far the views decide each Gaussian's a/b, in pixels that show it fully and
    /// whose wanted color is about met.
    ///
    /// # Errors
    /// [`ChromaError::Gpu`] when the device is lost.
    pub fn seen(&self) -> Result<Vec<f32>, ChromaError> {
        let count = self.passes.frozen.geometry.count;
        let diagonal = self.system.diagonal.read(self.gpu())?;
        // One pixel of weight one whose residual is the typical one.
        let pixel = 0.5 / self.pixels as f64 / TYPICAL_RESIDUAL * sh::C0;
        let planes = diagonal.len() / count.max(1);
        let of_splat = |i: usize| diagonal[i..].iter().step_by(count).map(|&d| f64::from(d));
        Ok((0..count)
            .map(|i| (of_splat(i).sum::<f64>() / planes as f64 / pixel) as f32)
            .collect())
    }

    /// Reads the harmonics found so far.
    ///
    /// # Errors
    /// [`ChromaError::Gpu`] when the device is lost.
    pub fn chroma(&self) -> Result<ShField, ChromaError> {
        Ok(self.passes.field.download(self.gpu())?)
    }

    /// What a dispatch works on, the mean over the passes.
    pub fn load(&self) -> Load {
        let scales = self.rounds.iter().map(|round| round.scale).max();
        self.passes.load(scales.unwrap_or(0) + 1)
    }

    /// Draws every view for its loss, and with `adjoint` finds the gradient and the sums
    /// of the corrections.
    fn draw(&mut self, round: &Round, adjoint: bool) -> Result<(), ChromaError> {
        self.passes.clear(adjoint);
        let judging = Judging {
            agreement: 0.0,
            robust: round.robust,
        };
        let ending = match (adjoint, round.corrects) {
            (false, _) => Ending::Loss,
            (true, false) => Ending::Gradient,
            (true, true) => Ending::GradientAndSums,
        };
        for task in 0..self.passes.tasks.len() {
            self.passes.draw(task, round.scale, judging, task, ending)?;
        }
        let of_view = if adjoint { 1.0 } else { DRAWING } * share(round.scale);
        self.spent += of_view * self.passes.tasks.len() as f64;
        Ok(())
    }
}

fn mean(losses: &[f32]) -> f64 {
    losses.iter().map(|&loss| f64::from(loss)).sum::<f64>() / losses.len() as f64
}

/// What drawing a view is of a pass over it, its adjoint included.
const DRAWING: f64 = 0.5;
