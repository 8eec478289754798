//! The paper's distillation: Adam on per-Gaussian a/b against the teacher,
//! coarse to fine (ChromaDistill, WACV 2025, algorithm 1).

use std::time::Instant;

use super::{
    ChromaError, ChromaObserver, ChromaProgress, ChromaSettings, FrozenViews, Targets, Task,
    passes::{Ending, Judging, Passes},
};
use crate::{
    capture::view_at,
    gpu::{Gpu, Recorder},
    raster::{Adam, Field, Load},
    splats::{ShField, sh},
};

/// Iterations between two reports.
const REPORT_EVERY: usize = 50;

/// Distills a teacher into chroma harmonics by Adam.
pub struct AdamSolver<'a> {
    passes: Passes<'a>,
    settings: ChromaSettings,
    adam: Adam,
    /// Iterations done.
    done: usize,
}

impl<'a> AdamSolver<'a> {
    /// A solver starting from gray.
    ///
    /// # Errors
    /// As [`IrlsSolver::new`](super::IrlsSolver::new).
    pub fn new(
        frozen: &'a FrozenViews,
        settings: ChromaSettings,
        targets: &'a Targets,
        tasks: Vec<Task>,
    ) -> Result<Self, ChromaError> {
        let gpu = &frozen.raster.gpu;
        let count = frozen.geometry.count;
        let field = Field::upload(gpu, &ShField::zeros(count, settings.sh_degree, 2))?;
        let planes = 2 * sh::coefficient_count(settings.sh_degree);
        let sizes = [1 + settings.scales as usize, REPORT_EVERY];
        let passes = Passes::new(frozen, targets, tasks, field, planes, sizes)?;
        let adam = Adam::new(
            gpu,
            &frozen.kernels.adam,
            &passes.status,
            &passes.gradient,
            &passes.field.planes,
            count,
        )?;
        Ok(Self {
            passes,
            settings,
            adam,
            done: 0,
        })
    }

    fn gpu(&self) -> &'a Gpu {
        &self.passes.frozen.raster.gpu
    }

    /// Distills to the last iteration, telling `observe` now and then.
    ///
    /// # Errors
    /// [`ChromaError`] when the device is lost or targets cannot be read.
    pub fn run(&mut self, observe: &mut ChromaObserver<'_>) -> Result<(), ChromaError> {
        self.run_to(self.settings.iterations, observe)
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
        let until = until.min(self.settings.iterations);
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
                    total: self.settings.iterations,
                    moved: None,
                    loss: recent.iter().map(|&loss| f64::from(loss)).sum::<f64>()
                        / recent.len() as f64,
                    passes: done as f64
                        * (0..=self.settings.scales as usize).map(share).sum::<f64>(),
                    seconds: begun.elapsed().as_secs_f64(),
                });
                if told.is_break() {
                    return Err(ChromaError::Cancelled);
                }
            }
        }
        Ok(())
    }

    /// Reads the chroma distilled so far.
    ///
    /// # Errors
    /// [`ChromaError::Gpu`] when the device is lost.
    pub fn chroma(&self) -> Result<ShField, ChromaError> {
        Ok(self.passes.field.download(self.gpu())?)
    }

    /// What a dispatch works on, the mean over the passes.
    pub fn load(&self) -> Load {
        self.passes.load(1 + self.settings.scales as usize)
    }

    /// One view through all scales, one step of Adam a scale.
    fn step(&mut self, iteration: usize) -> Result<(), ChromaError> {
        let gpu = self.gpu();
        let task = view_at(self.settings.seed, self.passes.tasks.len(), iteration);
        let rate = self.settings.rate(iteration);
        let mut rates = vec![
            (rate * self.settings.rest_share) as f32;
            2 * sh::coefficient_count(self.settings.sh_degree)
        ];
        rates[..2].fill(rate as f32);
        let coarsest = self.settings.scales as usize;
        for scale in (0..=coarsest).rev() {
            let mut recorder = Recorder::new(gpu);
            recorder.clear(self.passes.gradient.raw());
            recorder.submit();
            let judging = Judging {
                agreement: if scale < coarsest {
                    self.settings.agreement
                } else {
                    0.0
                },
                robust: self.settings.robust,
            };
            // The finest scale is drawn last, and its loss stays.
            self.passes
                .draw(task, scale, judging, iteration, Ending::Gradient)?;
            let done = iteration * (coarsest + 1) + coarsest - scale;
            let step = u32::try_from(done + 1).unwrap_or(u32::MAX);
            let mut recorder = Recorder::new(gpu);
            let kernel = &self.passes.frozen.kernels.adam;
            self.adam.record(gpu, kernel, &mut recorder, step, &rates);
            recorder.submit();
        }
        Ok(())
    }
}

/// What a pass over one scale is of a pass at full size.
fn share(scale: usize) -> f64 {
    0.25_f64.powi(scale as i32)
}
