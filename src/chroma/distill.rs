//! A distillation as a whole, into any radiance field: degree, solver, corrections, saturation.

use std::{cell::Cell, ops::ControlFlow, time::Instant};

use super::{
    ChosenDegree, ChromaError, ChromaProgress, ChromaSettings, Correction, Degree, MemoryBudget,
    SolverKind, Supervision, Task,
    checkpoint::{ChromaCheckpoint, ChromaCheckpointing, Interruptible, SolveDecisions},
    choose_degree,
    field::FrozenField,
    irls::PLAIN_ROUNDS,
    match_saturation, plan,
    solve::solve_from,
    strokes::lay,
};
use crate::{
    capture::Dataset,
    effects::{Decider, Decision},
    raster::{ColorKind, Load},
    splats::{ShField, sh},
};

/// Rounds after which corrections of views show whether they are of use: with six pairs of scene and
/// teacher they lowered the views' disagreement by 8 to 17 % then and at the end, or by 0.1 % at most
/// (docs/experiments.md).
const DECIDED_AFTER: usize = PLAIN_ROUNDS;
const LEAST_AGREEMENT: f64 = 0.01;

/// Colors of a radiance field.
#[derive(Clone, Debug)]
pub struct Distilled {
    /// The a/b harmonics of the primitives.
    pub chroma: ShField,
    /// Settings of the solver, decisions of the plan included.
    pub settings: ChromaSettings,
    /// Plan: each effect, on or off, with the evidence.
    pub effects: [Decision; 2],
    /// Views that colors were learned from and that a teacher colored or that have strokes.
    pub colored_views: usize,
    /// In how many pixels of the colored views each primitive shows; see
    /// [`Solved`](super::Solved).
    pub seen: Option<Vec<f32>>,
    /// Share of the primitives that strokes claim by half or more; `None` without strokes.
    pub claimed: Option<f64>,
    /// Factor that makes colors as strong as the teachers'; in `chroma`.
    pub saturation: f64,
    /// The last report of the solver.
    pub last: Option<ChromaProgress>,
    /// Work of a dispatch of the solver, the mean over the passes.
    pub load: Load,
    /// Bytes that it took on the device at most, where the backend tells.
    pub peak_device_memory: Option<u64>,
    /// Seconds of solving.
    pub seconds: f64,
}

/// News while a scene is colored.
#[derive(Clone, Copy, Debug)]
pub enum ColorizeEvent<'a> {
    /// This view is asked about next.
    Asked {
        /// Index of the view.
        view: usize,
        /// Views in all.
        total: usize,
    },
    /// The Gaussians are projected before each view and listed.
    Listing,
    /// They wait on the host, and so many come to the device at a time at most.
    Streaming {
        /// Gaussians on the device at a time.
        at_a_time: usize,
    },
    /// The solver, at a degree that is tried.
    Trying {
        /// Degree of the chroma harmonics.
        degree: u32,
        /// Progress of the solver.
        progress: ChromaProgress,
    },
    /// The degree that held-back views prove useful.
    Chosen(&'a ChosenDegree),
    /// Plan of the effects that are modeled.
    Plan(&'a [Decision; 2]),
    /// Progress of the solver.
    Solving(ChromaProgress),
    /// Corrections of views were taken back, for views disagreed as much with them: shares of the
    /// colors' mean square about their mean.
    Uncorrected {
        /// Without them.
        without: f64,
        /// With them.
        with: f64,
    },
    /// The strength of the colors is compared with the teachers', view by view.
    Matching {
        /// Views that are compared.
        view: usize,
        /// Views in all.
        total: usize,
    },
    /// The bake's target is drawn, view by view.
    Drawing {
        /// Views that are drawn.
        view: usize,
        /// Views in all.
        total: usize,
    },
    /// The bake; its loss is in hundredths of the way from black to white.
    Baking(ChromaProgress),
}

/// Receiver of events; a [`ControlFlow::Break`] ends it with [`ChromaError::Cancelled`].
pub type ColorizeObserver<'a> = dyn FnMut(ColorizeEvent<'_>) -> ControlFlow<()> + 'a;

/// A distillation of which more is said than [`colorize`](super::colorize) asks for.
pub struct Distill<'a> {
    /// Photos that the radiance field was trained on.
    pub dataset: &'a Dataset,
    /// Colors that its views are to have.
    pub supervision: &'a Supervision,
    /// Degree of the chroma harmonics.
    pub sh_degree: Degree,
    /// True if each view's teacher is aligned with the others; by default if they disagree.
    pub correct_views: Option<bool>,
}

impl Distill<'_> {
    /// Memory that the device may be asked for.
    pub fn memory(&self, settings: &ChromaSettings) -> MemoryBudget {
        MemoryBudget {
            limit: settings.memory_limit,
            color: ColorKind::Chroma,
            sh_degree: match self.sh_degree {
                Degree::Fixed(degree) => degree,
                Degree::Auto => sh::MAX_DEGREE,
            },
            weighted: self.supervision.targets.weighted() || self.supervision.has_strokes(),
            streams: settings.solver == SolverKind::Irls,
        }
    }

    /// Solves for the colors of `frozen`, whose views are those of the supervision, in their order;
    /// from a checkpoint on, and with checkpoints for `checkpointing` after rounds.
    ///
    /// # Errors
    /// As [`colorize`](super::colorize), [`ChromaError::OtherCheckpoint`], and
    /// [`ChromaError::Cancelled`] where the checkpointing ends it.
    pub fn run(
        &self,
        frozen: &dyn FrozenField,
        checkpoint: Option<&ChromaCheckpoint>,
        checkpointing: &mut dyn ChromaCheckpointing,
        settings: &ChromaSettings,
        observe: &mut ColorizeObserver<'_>,
    ) -> Result<Distilled, ChromaError> {
        let begun = Instant::now();
        let before = checkpoint.map_or(0.0, |found| found.state.seconds);
        let (dataset, supervision, gpu) = (self.dataset, self.supervision, frozen.gpu());
        let mut settings = settings.clone();
        let laid = match supervision.has_strokes() {
            true => Some(lay(frozen, dataset, supervision)?),
            false => None,
        };
        let (targets, tasks) = match &laid {
            Some(laid) => (&laid.targets, laid.tasks.clone()),
            None => (&supervision.targets, supervision.tasks()),
        };
        let correction = plan::correction(supervision.spread, settings.solver, self.correct_views);
        settings.correct_views = correction.on;
        let last = Cell::new(checkpoint.and_then(|found| found.state.last));
        let mut peak = None;
        let mut chosen = checkpoint.and_then(|found| found.state.chosen.clone());
        settings.sh_degree = self.degree(&mut chosen, observe, |observe| {
            let tried = &mut |degree, progress| {
                peak = peak.max(gpu.allocated_bytes());
                observe(ColorizeEvent::Trying { degree, progress })
            };
            choose_degree(frozen, &settings, targets, &tasks, tried)
        })?;
        let mut effects = [correction, plan::degree(self.sh_degree, chosen.as_ref())];
        go_on(observe(ColorizeEvent::Plan(&effects)))?;
        let uncorrected = Cell::new(checkpoint.and_then(|found| found.state.uncorrected));
        settings.correct_views &= uncorrected.get().is_none();
        let between = &mut |solver: &mut dyn Interruptible| {
            let rounds = last.get().map(|last| last.iteration);
            let decides = rounds == Some(DECIDED_AFTER) && DECIDED_AFTER < settings.rounds;
            if settings.correct_views && uncorrected.get().is_none() && decides {
                uncorrected.set(self.useless(&solver.corrections()?));
                if uncorrected.get().is_some() {
                    solver.uncorrect();
                }
            }
            if checkpointing.looks_on() {
                let asked = Instant::now();
                checkpointing.show(&solver.so_far()?, asked.elapsed());
            }
            if !checkpointing.wants() {
                return Ok(true);
            }
            Ok(checkpointing.keep(ChromaCheckpoint {
                state: SolveDecisions {
                    chosen: chosen.clone(),
                    uncorrected: uncorrected.get(),
                    last: last.get(),
                    seconds: before + begun.elapsed().as_secs_f64(),
                },
                solver: solver.state()?,
            }))
        };
        let told = &mut |progress| {
            last.set(Some(progress));
            peak = peak.max(gpu.allocated_bytes());
            observe(ColorizeEvent::Solving(progress))
        };
        let of = (checkpoint.map(|found| &found.solver), between as _);
        let solved = solve_from(of, frozen, &settings, targets, tasks.clone(), told)?;
        if let Some([without, with]) = uncorrected.get() {
            settings.correct_views = false;
            effects[0].on = false;
            effects[0].decided_by = Decider::Trial;
            go_on(observe(ColorizeEvent::Uncorrected { without, with }))?;
        }
        checkpointing.end();
        let mut chroma = solved.chroma;
        let mut saturation = 1.0;
        // Where no point is seen twice nobody knows what views agree on.
        if let (true, Some(spread)) = (settings.match_saturation, supervision.spread) {
            let told = &mut |view, total| observe(ColorizeEvent::Matching { view, total });
            let agreed = spread.agreed;
            saturation = match_saturation(frozen, targets, &tasks, agreed, &mut chroma, told)?;
            peak = peak.max(gpu.allocated_bytes());
        }
        Ok(Distilled {
            chroma,
            seen: solved.seen,
            claimed: laid.as_ref().map(|laid| laid.claimed),
            saturation,
            effects,
            colored_views: supervision.colored_views(),
            last: last.get(),
            load: solved.load,
            peak_device_memory: peak,
            seconds: before + begun.elapsed().as_secs_f64(),
            settings,
        })
    }

    /// The degree that is asked for or was chosen, or the one that `choose` finds.
    fn degree(
        &self,
        chosen: &mut Option<ChosenDegree>,
        observe: &mut ColorizeObserver<'_>,
        choose: impl FnOnce(&mut ColorizeObserver<'_>) -> Result<ChosenDegree, ChromaError>,
    ) -> Result<u32, ChromaError> {
        if let Degree::Fixed(degree) = self.sh_degree {
            return Ok(degree);
        }
        let found = match chosen.take() {
            Some(found) => found,
            None => choose(observe)?,
        };
        go_on(observe(ColorizeEvent::Chosen(&found)))?;
        Ok(chosen.insert(found).degree)
    }

    /// Disagreement of the views without and with `corrections`, if these do not lower it by
    /// [`LEAST_AGREEMENT`].
    fn useless(&self, corrections: &[(Task, Correction)]) -> Option<[f64; 2]> {
        let (capture, learned) = (&self.dataset.capture, &self.supervision.views);
        let mut of_view = vec![Correction::NONE; capture.views.len()];
        for (task, correction) in corrections {
            of_view[learned[task.view]] = *correction;
        }
        let samples = &self.supervision.samples;
        let without = samples.disagreement(capture, |_, ab| ab)?;
        let with = samples.disagreement(capture, |view, ab| of_view[view].of(ab))?;
        (with > (1.0 - LEAST_AGREEMENT) * without).then_some([without, with])
    }
}

/// An error, if it is not to go on.
pub(super) fn go_on(flow: ControlFlow<()>) -> Result<(), ChromaError> {
    match flow {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(ChromaError::Cancelled),
    }
}
