//! Stage 2 as a whole: a gray scene and someone who colors photos in, a colored scene out.

use std::{cell::Cell, ops::ControlFlow, sync::Arc, time::Instant};

use super::{
    ChosenDegree, ChromaError, ChromaProgress, ChromaSettings, Colorizer, Correction, Degree,
    FrozenViews, MemoryBudget, SolverKind, Supervision, Task,
    bake::{BakeStep, bake_telling},
    checkpoint::{
        ChromaCheckpoint, ChromaCheckpointing, Interruptible, NoChromaCheckpoints, SolveDecisions,
    },
    choose_degree, match_saturation, plan,
    solve::solve_from,
    strokes::lay,
    teach,
};
use crate::{
    capture::{Camera, Dataset},
    effects::{Decider, Decision},
    raster::{ColorKind, Load, Raster},
    splats::{ShField, Splats, sh},
};

/// A colored scene.
#[derive(Clone, Debug)]
pub struct Colored {
    /// The Gaussians with RGB harmonics, as splat files have them.
    pub splats: Splats,
    /// The a/b harmonics from which they are made.
    pub chroma: ShField,
    /// Settings of the solver, decisions of the plan included.
    pub settings: ChromaSettings,
    /// Plan: each effect, on or off, with the evidence.
    pub effects: [Decision; 2],
    /// Views that colors were learned from and that a teacher colored or that have strokes.
    pub colored_views: usize,
    /// In how many pixels of the colored views each Gaussian shows; see [`Solved`](super::Solved).
    pub seen: Option<Vec<f32>>,
    /// Share of the Gaussians that strokes claim by half or more; `None` without strokes.
    pub claimed: Option<f64>,
    /// Factor that makes colors as strong as the teachers'; in `chroma` and `splats`.
    pub saturation: f64,
    /// The last report of the solver.
    pub last: Option<ChromaProgress>,
    /// Work of a dispatch of the solver, the mean over the passes.
    pub load: Load,
    /// Bytes that it was estimated to take on the device at most.
    pub estimated_device_memory: u64,
    /// Bytes that it took there at most, where the backend tells.
    pub peak_device_memory: Option<u64>,
    /// Views whose lists and targets stayed on the device.
    pub pinned_views: usize,
    /// Gaussians on the device at a time, where they waited on the host.
    pub splats_at_a_time: Option<usize>,
    /// Seconds of solving and of the bake.
    pub seconds: [f64; 2],
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
    /// Corrections of views are taken back, and all is solved anew without, for views
    /// disagree more with it: shares of the colors' mean square about their mean.
    Uncorrected {
        /// Without it.
        before: f64,
        /// With it.
        after: f64,
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

/// Colors the gray scene `luma`, which was trained on `dataset` and is drawn by `raster`.
///
/// # Errors
/// [`ChromaError`] of a photo, of the colorizer or of the device;
/// [`ChromaError::NoViews`] where no training view gets a color.
pub fn colorize(
    raster: &Arc<Raster>,
    dataset: &Dataset,
    luma: &Splats,
    colorizer: &mut dyn Colorizer,
    settings: &ChromaSettings,
    observe: &mut ColorizeObserver<'_>,
) -> Result<Colored, ChromaError> {
    let total = dataset.cameras.len();
    let supervision = teach(dataset, colorizer, settings.target_scales(), &mut |view| {
        observe(ColorizeEvent::Asked { view, total })
    })?;
    Distill {
        raster,
        dataset,
        luma,
        supervision: &supervision,
        sh_degree: Degree::Fixed(settings.sh_degree),
        correct_views: None,
    }
    .run(settings, observe)
}

/// A distillation of which more is said than [`colorize`] asks for.
pub struct Distill<'a> {
    /// Rasterizer of the scene.
    pub raster: &'a Arc<Raster>,
    /// Photos that it was trained on.
    pub dataset: &'a Dataset,
    /// The scene, one channel.
    pub luma: &'a Splats,
    /// Colors that its views are to have.
    pub supervision: &'a Supervision,
    /// Degree of the chroma harmonics.
    pub sh_degree: Degree,
    /// True if each view's teacher is aligned with the others; by default if they disagree.
    pub correct_views: Option<bool>,
}

impl Distill<'_> {
    /// Solves and bakes.
    ///
    /// # Errors
    /// As [`colorize`].
    pub fn run(
        &self,
        settings: &ChromaSettings,
        observe: &mut ColorizeObserver<'_>,
    ) -> Result<Colored, ChromaError> {
        self.run_from(None, &mut NoChromaCheckpoints, settings, observe)
    }

    /// The same from a checkpoint on, and with checkpoints for `checkpointing` after rounds.
    ///
    /// # Errors
    /// As [`colorize`], [`ChromaError::OtherCheckpoint`], and [`ChromaError::Cancelled`] where
    /// the checkpointing ends it.
    pub fn run_from(
        &self,
        checkpoint: Option<&ChromaCheckpoint>,
        checkpointing: &mut dyn ChromaCheckpointing,
        settings: &ChromaSettings,
        observe: &mut ColorizeObserver<'_>,
    ) -> Result<Colored, ChromaError> {
        let begun = Instant::now();
        let before = checkpoint.map_or(0.0, |found| found.state.seconds);
        // No photo is looked at any more.
        self.dataset.release();
        let (dataset, supervision, gpu) = (self.dataset, self.supervision, &self.raster.gpu);
        let mut settings = settings.clone();
        let frozen = self.freeze(&settings, observe)?;
        let laid = match supervision.has_strokes() {
            true => Some(lay(&frozen, dataset, supervision, self.luma)?),
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
            choose_degree(&frozen, &settings, targets, &tasks, self.luma, tried)
        })?;
        let mut effects = [correction, plan::degree(self.sh_degree, chosen.as_ref())];
        go_on(observe(ColorizeEvent::Plan(&effects)))?;
        let mut solved = |settings: &ChromaSettings, from, uncorrected| {
            let between = &mut |solver: &dyn Interruptible| {
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
                        uncorrected,
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
            let (of, tasks, luma) = ((from, between as _), tasks.clone(), self.luma);
            solve_from(of, &frozen, settings, targets, tasks, luma, told)
        };
        let mut from = checkpoint.map(|found| &found.solver);
        let mut worse = checkpoint.and_then(|found| found.state.uncorrected);
        let mut corrected = None;
        if worse.is_none() {
            let found = solved(&settings, from.take(), None)?;
            worse = self.worse(&found.corrections);
            corrected = Some(found);
        }
        let solved = match (corrected, worse) {
            (Some(found), None) => found,
            (_, worse) => {
                settings.correct_views = false;
                effects[0].on = false;
                effects[0].decided_by = Decider::Trial;
                let found = solved(&settings, from, worse)?;
                let [before, after] = worse.unwrap_or_default();
                go_on(observe(ColorizeEvent::Uncorrected { before, after }))?;
                found
            }
        };
        checkpointing.end();
        let mut chroma = solved.chroma;
        let mut saturation = 1.0;
        // Where no point is seen twice nobody knows what views agree on.
        if let (true, Some(spread)) = (settings.match_saturation, supervision.spread) {
            let told = &mut |view, total| observe(ColorizeEvent::Matching { view, total });
            let agreed = spread.agreed;
            saturation = match_saturation(&frozen, targets, &tasks, agreed, &mut chroma, told)?;
            peak = peak.max(gpu.allocated_bytes());
        }
        let solving = before + begun.elapsed().as_secs_f64();
        let begun = Instant::now();
        let splats = bake_telling(&frozen, self.luma, &chroma, &mut |step| {
            peak = peak.max(gpu.allocated_bytes());
            observe(match step {
                BakeStep::Drawing { view, total } => ColorizeEvent::Drawing { view, total },
                BakeStep::Solving(progress) => ColorizeEvent::Baking(progress),
            })
        })?;
        Ok(Colored {
            splats,
            chroma,
            seen: solved.seen,
            claimed: laid.as_ref().map(|laid| laid.claimed),
            saturation,
            effects,
            colored_views: supervision.colored_views(),
            last: last.get(),
            load: solved.load,
            estimated_device_memory: frozen.demand(),
            peak_device_memory: peak,
            pinned_views: frozen.pinned(),
            splats_at_a_time: frozen.streamed(),
            seconds: [solving, begun.elapsed().as_secs_f64()],
            settings,
        })
    }
}

impl Distill<'_> {
    /// The gray scene as the learned views see it.
    fn freeze(
        &self,
        settings: &ChromaSettings,
        observe: &mut ColorizeObserver<'_>,
    ) -> Result<FrozenViews, ChromaError> {
        let (dataset, supervision) = (self.dataset, self.supervision);
        let learned = supervision.views.iter();
        let cameras: Vec<Camera> = learned.map(|&i| dataset.cameras[i].clone()).collect();
        let room = MemoryBudget {
            limit: settings.memory_limit,
            color: ColorKind::Chroma,
            sh_degree: match self.sh_degree {
                Degree::Fixed(degree) => degree,
                Degree::Auto => sh::MAX_DEGREE,
            },
            weighted: supervision.targets.weighted() || supervision.has_strokes(),
            streams: settings.solver == SolverKind::Irls,
        };
        let scales = settings.target_scales();
        go_on(observe(ColorizeEvent::Listing))?;
        let (raster, luma, extent) = (self.raster, self.luma, dataset.extent);
        let frozen = FrozenViews::new(raster, luma, extent, &cameras, scales, room)?;
        if let Some(at_a_time) = frozen.streamed() {
            go_on(observe(ColorizeEvent::Streaming { at_a_time }))?;
        }
        Ok(frozen)
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

    /// Disagreement of the views without and with `corrections`, if these make it larger.
    fn worse(&self, corrections: &[(Task, Correction)]) -> Option<[f64; 2]> {
        let (capture, learned) = (&self.dataset.capture, &self.supervision.views);
        let mut of_view = vec![Correction::NONE; capture.views.len()];
        for (task, correction) in corrections {
            of_view[learned[task.view]] = *correction;
        }
        let samples = &self.supervision.samples;
        let before = samples.disagreement(capture, |_, ab| ab)?;
        let after = samples.disagreement(capture, |view, ab| of_view[view].of(ab))?;
        (after > before).then_some([before, after])
    }
}

/// An error, if it is not to go on.
fn go_on(flow: ControlFlow<()>) -> Result<(), ChromaError> {
    match flow {
        ControlFlow::Continue(()) => Ok(()),
        ControlFlow::Break(()) => Err(ChromaError::Cancelled),
    }
}
