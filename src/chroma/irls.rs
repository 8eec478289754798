//! The fast solver: with the geometry frozen, colors at each pixel are linear in the
//! unknowns, so the distillation is a robust linear regression. Iteratively reweighted
//! least squares, whose steps L-BFGS makes longer, over all views and all of it on the
//! device, where that has room for all Gaussians.

use std::{
    sync::atomic::{AtomicBool, Ordering},
    time::Instant,
};

use super::{
    ChromaError, ChromaObserver, ChromaProgress, ChromaSettings, Correction, Targets, Task,
    checkpoint::{Interruptible, Rounds, SolverState},
    field::FrozenField,
    lbfgs::LbfgsState,
    loss::Space,
    passes::{LossOutput, LossSettings, Passes},
    steps::{Priors, StepStatus, Steps},
};
use crate::{
    gpu::{Gpu, Recorder},
    raster::{ColorKind, Load},
    splats::{ShField, sh},
};

/// Residual, in CIELAB units, of a pixel that counts as one.
const TYPICAL_RESIDUAL: f64 = 3.0;

/// Black to white of RGB in the units of the loss.
const RGB_UNITS: f64 = 100.0;

/// The loss levels off after so many rounds at the earliest, and once one moves the colors by
/// less than so many CIELAB units: what is far off at first may be right once the rest is in
/// place.
pub(super) const PLAIN_ROUNDS: usize = 4;
const PLAIN_MOVES: f64 = 2.0;

/// Rounds after which the colors are anchored at the earliest, and not before the loss levels
/// off: what these have not settled is what the pictures decide badly (docs/decisions/chroma.md).
/// Until then no round counts as settled.
const FREE_ROUNDS: usize = 8;

/// Every so many rounds the views' corrections are found anew; while the loss does not level
/// off, in each. A gradient before and one after tell nothing about the curvature, so that the
/// others give the pairs.
const CORRECT_EVERY: usize = 2;

/// Rounds in a row that hardly move the colors before they end: a single one may be short, and
/// one of two follows on a correction.
const SETTLED_ROUNDS: usize = 3;

/// Solves for chroma or RGB harmonics.
pub struct IrlsSolver<'a> {
    passes: Passes<'a>,
    steps: Steps,
    settings: ChromaSettings,
    /// Pixels of the largest view.
    pixels: usize,
    spent: f64,
    /// Seconds of earlier rounds.
    seconds: f64,
    /// Rounds done.
    done: usize,
    /// True until the loss levels off at large residuals.
    plain: bool,
    /// True if the colors are anchored.
    anchored: bool,
    /// Rounds of late, in a row, that hardly moved the colors.
    settled: usize,
    /// True if the last round's step was undone, for a shorter one to be tried.
    undone: bool,
    /// True if no round will follow.
    ended: bool,
    /// True if the views' corrections are not those of the accepted point.
    corrected: bool,
    /// Set by somebody who waits for the device: the round ends with [`ChromaError::Cancelled`].
    stop: Option<&'a AtomicBool>,
}

impl<'a> IrlsSolver<'a> {
    /// A solver for chroma, starting from gray.
    ///
    /// # Errors
    /// [`ChromaError::NoViews`] without tasks, [`ChromaError::WrongSize`] when a target
    /// has not its camera's size, [`ChromaError::Gpu`].
    pub fn new(
        frozen: &'a dyn FrozenField,
        settings: &ChromaSettings,
        targets: &'a Targets,
        tasks: Vec<Task>,
    ) -> Result<Self, ChromaError> {
        let start = ShField::zeros(frozen.primitives().count(), settings.sh_degree, 2);
        Self::starting_at(frozen, settings, targets, tasks, &start)
    }

    /// A solver for the harmonics up to the settings' degree of a/b or RGB, the others
    /// staying as they are in `start`.
    ///
    /// # Errors
    /// As [`IrlsSolver::new`].
    pub fn starting_at(
        frozen: &'a dyn FrozenField,
        settings: &ChromaSettings,
        targets: &'a Targets,
        tasks: Vec<Task>,
        start: &ShField,
    ) -> Result<Self, ChromaError> {
        let planes = start.channels * sh::coefficient_count(settings.sh_degree.min(start.degree));
        let sizes = [1, tasks.len()];
        let passes = Passes::new(frozen, targets, tasks, start, planes, Space::Rgb, sizes)?;
        let pixels = passes.tasks.iter().map(|task| frozen.pixels(task.view, 0));
        let pixels = pixels.max().unwrap_or(1);
        let units = match passes.field.kind {
            ColorKind::Rgb => RGB_UNITS * RGB_UNITS,
            ColorKind::Chroma | ColorKind::Luma => 1.0,
        };
        let ridge = units * settings.ridge * 0.5 / pixels as f64 * sh::C0 * sh::C0;
        let priors = Priors {
            ridge,
            anchor: settings.anchor,
        };
        Ok(Self {
            steps: Steps::new(&frozen.kernels().lbfgs, &passes, priors)?,
            passes,
            settings: settings.clone(),
            pixels,
            spent: 0.0,
            seconds: 0.0,
            done: 0,
            plain: settings.robust.is_some(),
            anchored: settings.anchor == 0.0,
            settled: 0,
            undone: false,
            ended: false,
            corrected: false,
            stop: None,
        })
    }

    /// Goes on from a solution of much the same targets, for so many rounds: residuals are doubted
    /// from the first on, views begin with these corrections, and nothing is anchored.
    pub(super) fn warm(&mut self, corrections: &[Correction], rounds: usize) {
        self.plain = false;
        self.anchored = true;
        self.done = FREE_ROUNDS;
        self.settings.rounds = FREE_ROUNDS + rounds;
        (self.passes.corrections.corrections).write(self.gpu(), corrections);
    }

    /// Returns true if a round is left.
    pub(super) fn goes_on(&self) -> bool {
        self.done < self.settings.rounds && !self.ended
    }

    /// So many rounds, ended between two views once `stop` is set.
    pub(super) fn run_within(
        &mut self,
        rounds: usize,
        stop: &'a AtomicBool,
        observe: &mut ChromaObserver<'_>,
    ) -> Result<(), ChromaError> {
        self.stop = Some(stop);
        self.run_to(self.done + rounds, observe)
    }

    fn gpu(&self) -> &'a Gpu {
        self.passes.frozen.gpu()
    }

    /// Lets no unknown fall below these, planes as the unknowns are.
    pub(super) fn set_floors(&mut self, floors: &[f32]) {
        self.steps.set_floors(self.gpu(), floors);
    }

    /// Residual at which the loss of a and b together levels off now; without one, each has
    /// its own.
    fn robust(&self) -> Option<f32> {
        let levels = |residual| if self.plain { f32::INFINITY } else { residual };
        self.settings.robust.map(levels)
    }

    /// Solves, telling `observe` after each round.
    ///
    /// # Errors
    /// [`ChromaError`] when the device is lost or targets cannot be read.
    pub fn run(&mut self, observe: &mut ChromaObserver<'_>) -> Result<(), ChromaError> {
        self.run_to(self.settings.rounds, observe)
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
        while self.done < until.min(self.settings.rounds) && !self.ended {
            let round = self.done;
            let ending = if self.correction_is_due(round) {
                LossOutput::GradientAndSums
            } else {
                LossOutput::Gradient
            };
            self.draw(self.robust(), ending)?;
            let mut state = self.steps.step(&mut self.passes)?;
            let accepted = state.moved.is_some();
            if !accepted {
                self.passes.frozen.restore(self.passes.field.degree);
            }
            self.correct(round, accepted);
            self.done = round + 1;
            if !self.anchored && !self.plain && accepted && self.done >= FREE_ROUNDS {
                self.anchored = true;
                self.steps.anchor(&self.passes);
            }
            let moves_less = |than| state.moved.is_some_and(|moved| moved < than);
            // What is left of an undone step is short whatever remains to be done, and so are
            // steps from few pairs.
            let whole = !std::mem::replace(&mut self.undone, state.moved.is_none());
            let free = self.plain || self.done <= FREE_ROUNDS;
            let settles = whole && !free && moves_less(self.settings.settled);
            self.settled = if settles { self.settled + 1 } else { 0 };
            self.ended = self.done == self.settings.rounds || self.settled == SETTLED_ROUNDS;
            let levels_off = self.plain && self.done >= PLAIN_ROUNDS && moves_less(PLAIN_MOVES);
            if self.ended || levels_off {
                state = self.end()?;
            }
            if levels_off && !self.ended {
                self.plain = false;
                self.steps.restart(gpu);
            }
            let told = observe(ChromaProgress {
                iteration: self.done,
                total: self.settings.rounds,
                loss: state.loss / self.passes.tasks.len() as f64,
                moved: state.moved,
                passes: self.spent,
                seconds: self.seconds + begun.elapsed().as_secs_f64(),
            });
            if told.is_break() {
                return Err(ChromaError::Cancelled);
            }
        }
        self.seconds += begun.elapsed().as_secs_f64();
        Ok(())
    }

    /// Finds the views' corrections anew where the point is accepted; undoes those that it was
    /// judged with where it is not.
    fn correct(&mut self, round: usize, accepted: bool) {
        let corrections = &self.passes.corrections;
        let mut recorder = Recorder::new(self.gpu());
        if std::mem::take(&mut self.corrected) && !accepted {
            corrections.undo(&mut recorder);
        }
        if accepted && self.correction_is_due(round) {
            corrections.solve(&self.passes.frozen.kernels().correction, &mut recorder);
            self.corrected = true;
            self.steps.changed(self.passes.frozen.gpu());
        }
        recorder.submit();
    }

    /// Returns true if a round solves for the views' corrections anew. The first image is gray and
    /// tells nothing about the teachers.
    fn correction_is_due(&self, round: usize) -> bool {
        let due = round > 0 && (round < PLAIN_ROUNDS || round.is_multiple_of(CORRECT_EVERY));
        self.settings.correct_views && due
    }

    /// Judges the last step.
    fn end(&mut self) -> Result<LbfgsState, ChromaError> {
        self.draw(self.robust(), LossOutput::Loss)?;
        let state = self.steps.end(&mut self.passes)?;
        let corrected = std::mem::take(&mut self.corrected);
        if state.moved.is_none() {
            self.passes.frozen.restore(self.passes.field.degree);
            if corrected {
                let mut recorder = Recorder::new(self.gpu());
                self.passes.corrections.undo(&mut recorder);
                recorder.submit();
            }
        }
        Ok(state)
    }

    /// The plain loss of `chroma` over all views at full size, in CIELAB units: what the
    /// solvers are compared by. Teachers count as corrected so far, which is not at all
    /// before the second round. Leaves the solver with this field.
    ///
    /// # Errors
    /// [`ChromaError`].
    pub fn objective(&mut self, chroma: &ShField) -> Result<f64, ChromaError> {
        let gpu = self.gpu();
        self.passes.put(chroma)?;
        let spent = self.spent;
        self.draw(None, LossOutput::Loss)?;
        self.spent = spent;
        self.steps.restart(gpu);
        self.passes.frozen.restore(self.passes.field.degree);
        Ok(mean(&self.passes.log.read_later(gpu).wait(gpu)?))
    }

    /// Weight of the views in each Gaussian's a/b, in pixels that show it fully and whose target
    /// color is about met.
    ///
    /// # Errors
    /// [`ChromaError`] when the device is lost or targets cannot be read.
    pub fn seen(&mut self) -> Result<Vec<f32>, ChromaError> {
        if self.undone {
            // The sums are of the step that was undone, where hardly a color was met.
            self.draw(self.robust(), LossOutput::Gradient)?;
        }
        let count = self.passes.frozen.primitives().count();
        let diagonal = self.passes.curvature()?;
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
        self.passes.harmonics()
    }

    /// Each view's correction, and what was wanted there.
    ///
    /// # Errors
    /// [`ChromaError::Gpu`] when the device is lost.
    pub fn corrections(&self) -> Result<Vec<(Task, Correction)>, ChromaError> {
        let found = self.passes.corrections.corrections.read(self.gpu())?;
        Ok(self.passes.tasks.iter().copied().zip(found).collect())
    }

    /// Work of a dispatch, the mean over the passes.
    pub fn load(&self) -> Load {
        self.passes.load(1)
    }

    /// Draws every view for its loss and what follows on it.
    fn draw(&mut self, robust: Option<f32>, ending: LossOutput) -> Result<(), ChromaError> {
        let adjoint = ending != LossOutput::Loss;
        self.passes.clear(adjoint);
        let loss_settings = LossSettings {
            robust,
            ..LossSettings::default()
        };
        for task in 0..self.passes.tasks.len() {
            if let Some(stop) = self.stop {
                // What is ordered cannot be called back.
                self.gpu().wait()?;
                if stop.load(Ordering::Relaxed) {
                    return Err(ChromaError::Cancelled);
                }
            }
            self.passes.draw(task, 0, loss_settings, task, ending)?;
        }
        self.spent += if adjoint { 1.0 } else { DRAWING } * self.passes.tasks.len() as f64;
        Ok(())
    }
}

impl Interruptible for IrlsSolver<'_> {
    fn go_on(&mut self, observe: &mut ChromaObserver<'_>) -> Result<bool, ChromaError> {
        let goes_on = self.goes_on();
        if goes_on {
            self.run_to(self.done + 1, observe)?;
        }
        Ok(goes_on)
    }

    fn so_far(&self) -> Result<ShField, ChromaError> {
        self.chroma()
    }

    fn state(&self) -> Result<SolverState, ChromaError> {
        let gpu = self.gpu();
        let StepStatus {
            newest,
            mut buffers,
            doubles,
        } = self.steps.kept(&self.passes)?;
        for (name, buffer) in self.passes.corrections.kept() {
            let values = bytemuck::cast_slice(&buffer.read(gpu)?).to_vec();
            buffers.insert(name.to_owned(), values);
        }
        let rounds = Rounds {
            done: self.done,
            plain: self.plain,
            settled: self.settled,
            undone: self.undone,
            corrected: self.corrected,
            anchored: self.anchored,
            ended: self.ended,
            newest,
            spent: self.spent,
            seconds: self.seconds,
        };
        Ok(SolverState {
            rounds,
            buffers,
            doubles,
        })
    }

    fn go_on_from(&mut self, state: &SolverState) -> bool {
        let gpu = self.gpu();
        let mut fits = self.steps.go_on_from(state, &mut self.passes);
        for (name, buffer) in self.passes.corrections.kept() {
            let values = state.buffers.get(name).map(Vec::as_slice);
            let found: Result<&[Correction], _> =
                bytemuck::try_cast_slice(values.unwrap_or_default());
            match found {
                Ok(found) if found.len() == buffer.len() => buffer.write(gpu, found),
                _ => fits = false,
            }
        }
        let rounds = state.rounds;
        self.done = rounds.done;
        self.plain = rounds.plain;
        self.settled = rounds.settled;
        self.undone = rounds.undone;
        self.corrected = rounds.corrected;
        self.anchored = rounds.anchored;
        self.ended = rounds.ended;
        self.spent = rounds.spent;
        self.seconds = rounds.seconds;
        fits
    }

    fn corrections(&self) -> Result<Vec<(Task, Correction)>, ChromaError> {
        Self::corrections(self)
    }

    fn uncorrect(&mut self) {
        let none = vec![Correction::NONE; self.passes.tasks.len()];
        for (_, corrections) in self.passes.corrections.kept() {
            corrections.write(self.gpu(), &none);
        }
        self.settings.correct_views = false;
        self.corrected = false;
        self.steps.restart(self.gpu());
    }
}

fn mean(losses: &[f32]) -> f64 {
    losses.iter().map(|&loss| f64::from(loss)).sum::<f64>() / losses.len() as f64
}

/// Cost of drawing a view, as a share of a pass over it, its adjoint included.
const DRAWING: f64 = 0.5;
