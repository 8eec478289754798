//! One training, from settings to measured splats.

use std::{fmt::Write, sync::Arc, time::Instant};

use super::super::{Event, Observer, RunError, Stage, preset::Work, yardstick::Yardstick};
use super::{
    FitOptions,
    goal::{ITERATIONS_MIN, WRITING},
    quality::{mean_quality, measure_luma},
    start::first_splats,
    trial::{TRIAL_FROM, planned},
};
use crate::{
    capture::{CaptureError, Dataset, Exposure},
    effects::{Effect, Evidence, Plan},
    gpu::{Gpu, GpuError},
    luma::{
        CurvePoint, Demand, Goal, LumaProgress, LumaSettings, LumaTrainer, PlannedViews,
        TrainingView, carve::carved,
    },
    raster::Raster,
    report::{KernelReport, LumaQuality, LumaView, kernel_reports},
    splats::Splats,
};

/// Views that are looked at while training goes on, at most.
const WATCHED: usize = 3;

/// What all attempts share.
pub(super) struct Job<'a> {
    pub options: &'a FitOptions,
    pub gpu: &'a Gpu,
    pub raster: &'a Arc<Raster>,
    /// Photos at the size that is trained on.
    pub dataset: &'a Arc<Dataset>,
    /// What they say.
    pub evidence: &'a Evidence,
    /// Photos at the size that is measured at.
    pub judge: &'a Dataset,
    /// When the run began.
    pub begun: Instant,
}

/// What came of one.
pub(super) struct Attempt {
    pub settings: LumaSettings,
    /// Iterations that led to the splats.
    pub iterations: usize,
    pub plan: Plan,
    pub splats: Splats,
    /// `train.csv`.
    pub log: String,
    pub curve: Vec<CurvePoint>,
    pub given_up: Option<usize>,
    pub last: Option<LumaProgress>,
    pub peak_device_memory: Option<u64>,
    pub estimated_device_memory: u64,
    pub held_out_views: Vec<LumaView>,
    pub timings: Option<Vec<KernelReport>>,
    /// Seconds of examining the photos and placing the first Gaussians.
    pub preparing: f64,
    /// Seconds of training, of watching and of measuring.
    pub seconds: [f64; 3],
}

impl Attempt {
    /// Mean over the held-out views, if any.
    pub fn held_out(&self) -> Option<LumaQuality> {
        mean_quality(&self.held_out_views)
    }

    /// PSNR of the held-out views; of some training views where none is held out.
    pub fn psnr(&self) -> Option<f64> {
        let watched = || self.curve.last().map(|point| point.psnr);
        self.held_out().map(|quality| quality.psnr).or_else(watched)
    }

    /// The error, if it does not reach so many dB.
    pub fn misses(&self, target: f64) -> Option<RunError> {
        let reached = self.psnr().unwrap_or(f64::NEG_INFINITY);
        (reached < target).then_some(RunError::TargetMissed { target, reached })
    }
}

impl Job<'_> {
    /// Seconds for training within the time limit, measuring and writing taken off; an
    /// iteration takes about `each`.
    ///
    /// # Errors
    /// [`RunError::TimeTooShort`].
    pub fn time_for_training(&self, each: f64) -> Result<Option<f64>, RunError> {
        let Some(limit) = self.options.time_limit else {
            return Ok(None);
        };
        let before = self.begun.elapsed().as_secs_f64();
        let left = (1.0 - WRITING) * limit - before - self.measuring(each)?;
        let least = ITERATIONS_MIN as f64 * each;
        if left < least {
            return Err(RunError::TimeTooShort {
                limit,
                iterations: ITERATIONS_MIN,
                needed: limit - left + least,
            });
        }
        Ok(Some(left))
    }

    /// Seconds that measuring will take, where an iteration takes about `each`.
    fn measuring(&self, each: f64) -> Result<f64, CaptureError> {
        let views = &self.judge.split.test;
        let Some(&first) = views.first() else {
            return Ok(0.0);
        };
        let photo = self.judge.photo(first)?;
        let yardstick = Yardstick {
            photo: &photo,
            exposure: Exposure::NONE,
        };
        let gray = yardstick.gray();
        let begun = Instant::now();
        // Of the photo against itself: it is only about the time.
        std::hint::black_box(yardstick.luma_quality(&gray));
        let pixels = |dataset: &Dataset| {
            let camera = &dataset.cameras[first];
            f64::from(camera.width) * f64::from(camera.height)
        };
        let drawing = each * pixels(self.judge) / pixels(self.dataset).max(1.0);
        Ok(views.len() as f64 * (begun.elapsed().as_secs_f64() + drawing))
    }

    /// Trains and measures, within `time_limit` seconds if there is one.
    ///
    /// # Errors
    /// [`RunError`].
    pub fn attempt(
        &self,
        work: &Work,
        time_limit: Option<f64>,
        observe: &mut Observer<'_>,
    ) -> Result<Attempt, RunError> {
        let begun = Instant::now();
        let (options, dataset) = (self.options, self.dataset);
        let room = work.room();
        let plan = match options.time_limit {
            Some(limit) if limit < TRIAL_FROM => {
                self.evidence.decide(room, &options.overrules, None)
            }
            _ => planned(
                dataset,
                self.evidence,
                room,
                &options.overrules,
                || Ok(self.raster.clone()),
                observe,
            )?,
        };
        if options.timings {
            // A trial is no part of the run.
            self.gpu.timings()?;
        }
        observe(Event::Note(plan.to_string()));
        let mut settings = settings(work, &plan);
        let demand = self.fit_memory(&mut settings, &plan, observe)?;
        let start = first_splats(options, dataset, self.evidence, &settings, observe)?;
        let preparing = begun.elapsed().as_secs_f64();

        let begun = Instant::now();
        let views = PlannedViews::new(dataset.clone(), self.evidence, &plan);
        let raster = self.raster.clone();
        let mut trainer = LumaTrainer::new(raster, settings, dataset.extent, &start, views)?;
        if let Some(limit) = time_limit {
            let seconds = limit - preparing;
            trainer.aim(Goal::Within { seconds });
        }
        trainer.watch(self.watched_views(&plan)?)?;
        let mut log = String::from("iteration,loss,splats,seconds,poisoned\n");
        let (mut last, mut peak_device_memory) = (None, None);
        trainer.train(&mut |progress| {
            // Writing to a string cannot fail.
            let _ = writeln!(
                log,
                "{},{:.6},{},{:.3},{}",
                progress.iteration,
                progress.loss,
                progress.splats,
                progress.seconds,
                progress.poisoned
            );
            observe(Event::Progress {
                stage: Stage::Luma,
                done: progress.iteration,
                total: progress.end,
                message: in_words(&progress),
            });
            last = Some(progress);
            peak_device_memory = peak_device_memory.max(self.gpu.allocated_bytes());
        })?;
        let mut splats = trainer.splats()?;
        if dataset.removes_masked() {
            splats = carved(dataset, &splats)?;
        }
        let timings = (options.timings)
            .then(|| Ok::<_, RunError>(kernel_reports(&self.gpu.timings()?, &trainer.load())))
            .transpose()?;
        let watching = trainer.watched_seconds();
        let training = begun.elapsed().as_secs_f64() - watching;

        let begun = Instant::now();
        let settings = trainer.settings().clone();
        let iterations = trainer.schedule().end;
        let curve = trainer.curve().to_vec();
        let given_up = trainer.given_up();
        // What it holds on the device is not needed for measuring.
        drop(trainer);
        let drawn = self.raster.drawing(settings.raster_options());
        let held_out_views = measure_luma(&drawn, self.judge, &splats, &plan.exposures)?;
        Ok(Attempt {
            estimated_device_memory: demand.peak_bytes(splats.len()),
            preparing,
            seconds: [training, watching, begun.elapsed().as_secs_f64()],
            settings,
            iterations,
            plan,
            splats,
            log,
            curve,
            given_up,
            last,
            peak_device_memory,
            held_out_views,
            timings,
        })
    }

    /// Lowers the cap on Gaussians to what there is memory for.
    fn fit_memory(
        &self,
        settings: &mut LumaSettings,
        plan: &Plan,
        observe: &mut Observer<'_>,
    ) -> Result<Demand, RunError> {
        let (dataset, limit) = (self.dataset, settings.memory_limit);
        let ignores = plan.has(Effect::Masks) || plan.has(Effect::Robust);
        let cameras = dataset.split.train.iter().map(|&i| &dataset.cameras[i]);
        let watched = self.watched();
        let demand = Demand::of(cameras, ignores, settings.sh_degree, limit)
            .watching(watched.iter().map(|&i| &dataset.cameras[i]));
        let binding = self.gpu.binding_limit();
        let fits = demand.largest_set(limit, binding);
        if fits == 0 {
            return Err(RunError::Gpu(GpuError::OverLimit {
                splats: 1,
                needed: demand.peak_bytes(1),
                limit: limit.unwrap_or(binding),
            }));
        }
        if fits < settings.max_splats {
            observe(Event::Note(match limit {
                Some(limit) => format!("at most {fits} Gaussians fit into {} MiB", limit >> 20),
                None => format!("at most {fits} Gaussians fit into the adapter's bindings"),
            }));
            settings.max_splats = fits;
        }
        Ok(demand)
    }

    /// A few of the photos that are measured, evenly spread.
    fn watched(&self) -> Vec<usize> {
        let measured = self.dataset.measured().1;
        let count = measured.len().min(WATCHED);
        (0..count)
            .map(|k| measured[k * measured.len() / count])
            .collect()
    }

    fn watched_views(&self, plan: &Plan) -> Result<Vec<TrainingView>, CaptureError> {
        let view = |i: usize| {
            let photo = self.dataset.photo(i)?;
            Ok(TrainingView {
                camera: self.dataset.cameras[i].clone(),
                gray: photo.gray.clone(),
                mask: photo.mask.clone(),
                exposure: plan.exposures[i],
            })
        };
        self.watched().into_iter().map(view).collect()
    }
}

/// What goes into training: of some settings the plan decides.
fn settings(work: &Work, plan: &Plan) -> LumaSettings {
    LumaSettings {
        sh_degree: plan.sh_degree,
        robust: plan.has(Effect::Robust),
        antialiased: plan.has(Effect::Antialias),
        background: plan.has(Effect::Background),
        ..work.settings.clone()
    }
}

/// The figures beside a progress bar.
fn in_words(progress: &LumaProgress) -> String {
    let looked = progress.looked.map_or(String::new(), |look| {
        let rise = look
            .per_minute
            .map_or(String::new(), |rise| format!(" ({rise:+.1}/min)"));
        format!(", {:.2} dB{rise}", look.psnr)
    });
    format!(
        "loss {:.4}, {} splats{looked}",
        progress.loss, progress.splats
    )
}
