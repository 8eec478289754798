//! One training, from settings to measured splats.

use std::{
    ops::ControlFlow,
    path::PathBuf,
    sync::Arc,
    time::{Duration, Instant},
};

use serde_json::Value;

use super::{
    BlockPlace, FitRequest, Init,
    budget::{Budget, ITERATIONS_MIN, WRITING},
    checkpoint::FoundTraining,
};
use crate::{
    capture::{CaptureError, Dataset, Exposure},
    effects::{Effect, Evidence},
    eval::{Progress, Reference, exposures, gray_rows, mean_quality, measure_luma},
    gpu::Gpu,
    luma::{Fit, Grows, LumaEvent, LumaProgress, LumaScene, LumaSettings},
    raster::{Raster, RasterOptions},
    report::{KernelReport, LumaQuality, LumaView, PhotoReport, Row, kernel_reports},
    run::RunError,
    splats::Splats,
    store::{
        RunFolder, StoreError,
        checkpoints::{CheckpointFiles, Journal},
        files,
        log::with_rows,
    },
    subject::{
        LiveCheckpoints, SceneKind,
        foreign::tell_unlike,
        scene::{Frame, of_trial, read_splats},
    },
    tell::{Event, Observer, Stage},
};

/// Runs that may take no longer, in seconds, do without a trial: on a slow device it would
/// take a good part of it.
const TRIAL_FROM: f64 = 300.0;

/// Share of the textured area that may lose its detail without a word: a draft of 75 aerial photos
/// loses 0.1, the fog that a draft makes of near-infrared fields 0.5.
const MUCH_LOST: f64 = 1.0 / 3.0;

/// Input of a training.
pub(super) struct Job<'a> {
    pub options: &'a FitRequest,
    pub gpu: &'a Gpu,
    pub raster: &'a Arc<Raster>,
    /// Photos at the size that is trained on.
    pub dataset: &'a Arc<Dataset>,
    /// Evidence from the photos.
    pub evidence: &'a Evidence,
    /// Their files.
    pub photos: &'a [PhotoReport],
    /// Initial Gaussians of a block among its neighbors.
    pub among: Option<Splats>,
    /// Photos at the size that is measured at.
    pub judge: &'a Arc<Dataset>,
    /// When the run began.
    pub begun: Instant,
    /// Seconds until it had its photos.
    pub loading: f64,
}

/// Result of a training.
pub(super) struct Trained {
    pub scene: LumaScene,
    /// `train.csv`.
    pub log: String,
    pub held_out_views: Vec<LumaView>,
    /// Rows of the contact sheet.
    pub rows: Vec<Row>,
    pub timings: Option<Vec<KernelReport>>,
    /// Seconds of measuring.
    pub measuring: f64,
}

impl Trained {
    /// Mean over the held-out views, if any.
    pub fn held_out(&self) -> Option<LumaQuality> {
        mean_quality(&self.held_out_views)
    }

    /// PSNR of the held-out views, after each photo's gain and offset where exposures are
    /// simulated; of some training views where none is held out.
    pub fn psnr(&self) -> Option<f64> {
        let exposed = self.scene.plan.has(Effect::Exposure);
        let of = |quality: LumaQuality| match exposed {
            true => quality.psnr_of_scene(),
            false => quality.psnr,
        };
        let watched = || self.scene.curve.last().map(|point| point.psnr);
        self.held_out().map(of).or_else(watched)
    }

    /// Writes pictures from its way into the run folder.
    pub fn write_album(&self, dataset: &Dataset, folder: &RunFolder) -> Result<(), StoreError> {
        for picture in self.scene.album.iter().cloned() {
            let path = folder.album(picture.iteration);
            files::make_folder_of(&path)?;
            let upright = dataset.capture.views[picture.view].stance.upright;
            files::write_png(&path, &upright.image(picture.image.into()).into_rgb8())?;
        }
        Ok(())
    }

    /// The error, if it does not reach so many dB.
    pub fn misses(&self, target: f64) -> Option<RunError> {
        let reached = self.psnr().unwrap_or(f64::NEG_INFINITY);
        (reached < target).then_some(RunError::TargetMissed { target, reached })
    }
}

impl Job<'_> {
    /// Seconds for training within the time limit, measuring and writing taken off; an
    /// iteration takes about `each`. Of a training that goes on, its seconds so far are among
    /// them.
    fn time_for_training(
        &self,
        each: f64,
        found: Option<&FoundTraining>,
    ) -> Result<Option<f64>, RunError> {
        let Some(limit) = self.options.goal.seconds() else {
            return Ok(None);
        };
        let before = self.begun.elapsed().as_secs_f64();
        let left = (1.0 - WRITING) * limit - before - self.measuring(each)?;
        if let Some(found) = found {
            // Its training counts from its beginning, and ends however little is left.
            return Ok(Some(left.max(0.0) + found.checkpoint.seconds()));
        }
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
        let reference = Reference {
            photo: &photo,
            exposure: Exposure::NONE,
        };
        let gray = reference.gray();
        let begun = Instant::now();
        // Of the photo against itself: it is only about the time.
        std::hint::black_box(reference.luma_quality(&gray));
        let pixels = |dataset: &Dataset| {
            let camera = &dataset.cameras[first];
            f64::from(camera.width) * f64::from(camera.height)
        };
        let drawing = each * pixels(self.judge) / pixels(self.dataset).max(1.0);
        Ok(views.len() as f64 * (begun.elapsed().as_secs_f64() + drawing))
    }

    /// Trains towards the goal and measures.
    pub fn train(
        &self,
        budget: &Budget,
        folder: &RunFolder,
        question: Value,
        found: Option<&FoundTraining>,
        observe: &mut Observer<'_>,
    ) -> Result<Trained, RunError> {
        let (options, dataset) = (self.options, self.dataset);
        let limit = self.time_for_training(budget.each, found)?;
        let mut settings = budget.work.settings.clone();
        let begin = self.begin(&settings, found, observe)?;
        let (init, placed) = (begin.init.as_ref(), begin.placed.as_ref());
        if let (Some((splats, _)), Some(_)) = (placed, &self.among) {
            // What neighbors have in the margin may be more than the block has there.
            settings.max_splats = settings.max_splats.max(splats.len());
        }
        let block = options.block.as_ref();
        let told = block.and_then(BlockPlace::exposures);
        let shared = told.map(|told| exposures(dataset, told));
        let near = block.map(|block| block.near(dataset.capture.offset));
        let seconds = options.goal.seconds();
        // Held-out views have to be seen as they are measured, where they are to be reached.
        let reaches = options.goal.psnr().is_some() && !self.judge.split.test.is_empty();
        let fit = Fit {
            raster: self.raster,
            dataset,
            evidence: self.evidence,
            overrules: &options.overrules,
            goal: limit.map_or(options.goal, |limit| options.goal.with_seconds(limit)),
            tries: seconds.is_none_or(|limit| limit >= TRIAL_FROM),
            start: (placed.map(|(splats, _)| splats)).or(init.map(|init| &init.splats)),
            surroundings: placed.map_or(options.surroundings(), |(_, around)| *around),
            exposures: shared.as_deref(),
            // More Gaussians would only learn what the others lack beyond.
            grows: match self.among {
                Some(_) => Some(Arc::new(|_| false) as Grows),
                None => near.map(|near| Arc::new(move |place| near.holds(place)) as Grows),
            },
            watched: reaches.then(|| (self.judge, self.judge.split.test.clone())),
            album: options.album,
        };
        let journal = &Journal::new(self.log(found), observe);
        let mut checkpointing = CheckpointFiles::new(
            folder.checkpoint(),
            question,
            budget.clone(),
            &options.checkpoints,
            journal,
            self.begun,
        );
        let checkpoint = found.map(|found| &found.checkpoint);
        let mut showing = LiveCheckpoints {
            checkpointing: &mut checkpointing,
            live: options.live.as_deref(),
            luma: None,
        };
        let scene = fit.run_from(checkpoint, &mut showing, &settings, &mut |event| {
            self.tell(event, init, settings.memory_limit, journal);
            ControlFlow::Continue(())
        });
        checkpointing.close()?;
        self.measure(scene?, journal)
    }

    /// Reads and places the Gaussians to start from.
    fn begin(
        &self,
        settings: &LumaSettings,
        found: Option<&FoundTraining>,
        observe: &mut Observer<'_>,
    ) -> Result<Begin, RunError> {
        let (options, dataset) = (self.options, self.dataset);
        let init = options.init.as_ref().map(|init| {
            let frame = match init {
                Init::File(_) => Frame::World(dataset.capture.offset),
                Init::Run { .. } => Frame::Own,
            };
            let path = init.path();
            let (splats, drawn) = read_splats(&path, frame, observe)?;
            Ok::<_, RunError>(ReadInit {
                path,
                splats,
                drawn,
            })
        });
        let init = init.transpose()?;
        if let (
            Some(ReadInit {
                path,
                splats,
                drawn,
            }),
            None,
        ) = (&init, &self.among)
        {
            let splats = (path.as_path(), &splats.to_luma());
            tell_unlike(self.gpu, dataset, splats, *drawn, observe)?;
        }
        let placed = match (&options.block, &init, found) {
            // One that goes on has its Gaussians.
            (Some(block), None, None) => block.start(dataset, settings, observe)?,
            (_, _, None) => (self.among.clone()).map(|splats| (splats, options.surroundings())),
            _ => None,
        };
        Ok(Begin { init, placed })
    }

    /// Rows of the log so far.
    fn log(&self, found: Option<&FoundTraining>) -> String {
        match (found, &self.options.init) {
            (Some(found), _) => found.log(),
            (
                None,
                Some(Init::Run {
                    folder, iterations, ..
                }),
            ) => with_rows(&folder.log(), *iterations, ""),
            (None, _) => String::from("iteration,loss,splats,seconds,poisoned\n"),
        }
    }

    /// Tells an event in words, and notes the losses.
    fn tell(
        &self,
        event: LumaEvent<'_>,
        init: Option<&ReadInit>,
        memory_limit: Option<u64>,
        journal: &Journal<'_>,
    ) {
        let live = self.options.live.as_deref();
        journal.tell(match event {
            // Not asked for: the evidence is there.
            LumaEvent::Examined { .. } => return,
            LumaEvent::Placing => Event::begins(Stage::Placing),
            LumaEvent::Starting { iteration, end } => {
                Event::progress(Stage::Training, iteration, end, "")
            }
            LumaEvent::Trial(progress) => of_trial(&progress),
            LumaEvent::Plan(plan) => {
                let antialiased = plan.has(Effect::Antialias);
                if let Some(live) = live {
                    let drawn = RasterOptions {
                        antialiased,
                        ..RasterOptions::default()
                    };
                    live.plan(plan, drawn);
                }
                journal.tell(Event::Note(plan.to_string()));
                match init {
                    Some(init) if init.drawn.antialiased != antialiased => {
                        let [is, is_not] = ["antialiased", "not antialiased"];
                        let named = |is_so| if is_so { is } else { is_not };
                        Event::Warning(format!(
                            "{} was trained {}, this run is {}: small Gaussians will have to adapt",
                            init.path.display(),
                            named(init.drawn.antialiased),
                            named(antialiased),
                        ))
                    }
                    _ => return,
                }
            }
            LumaEvent::Capped(fits) => Event::Note(match memory_limit {
                Some(limit) => format!("at most {fits} Gaussians fit into {} MiB", limit >> 20),
                None => format!("at most {fits} Gaussians fit into the adapter's bindings"),
            }),
            LumaEvent::Training(progress) => {
                if let Some(live) = live {
                    live.note(&progress);
                }
                let before = self.options.init.as_ref().map_or(0, Init::iterations);
                journal.row(format_args!(
                    "{},{:.6},{},{:.3},{}",
                    before + progress.iteration,
                    progress.loss,
                    progress.splats,
                    progress.seconds,
                    progress.poisoned
                ));
                let (done, total) = (progress.iteration, progress.end);
                Event::progress(Stage::Training, done, total, in_words(&progress))
            }
        });
    }

    /// Measures what was trained.
    fn measure(&self, scene: LumaScene, journal: &Journal<'_>) -> Result<Trained, RunError> {
        if let Some(live) = &self.options.live {
            live.show(SceneKind::Luma, scene.splats.clone(), Duration::ZERO);
        }
        let timings = match self.options.timings {
            true => Some(kernel_reports(&self.gpu.timings()?, &scene.load)),
            false => None,
        };
        let begun = Instant::now();
        let drawn = self.raster.drawing(scene.settings.raster_options());
        journal.tell(Event::begins(Stage::Measuring));
        let mut told = |progress: Progress<'_>| journal.tell(progress.into());
        let (splats, exposures) = (&scene.splats, scene.exposures());
        let held_out_views = measure_luma(&drawn, self.judge, splats, &mut told)?;
        let rows = gray_rows(&drawn, self.judge, splats, exposures)?;
        let lost = mean_quality(&held_out_views).and_then(|quality| quality.lost_detail);
        if let Some(lost) = lost.filter(|lost| *lost > MUCH_LOST) {
            journal.tell(Event::Warning(format!(
                "{:.0} % of the held-out photos' textured area shows hardly any of its detail: {} Gaussians after {} iterations are too few for these photos; a larger preset, or more of both, would show it",
                100.0 * lost,
                splats.len(),
                scene.iterations,
            )));
        }
        Ok(Trained {
            rows,
            scene,
            log: journal.rows(),
            held_out_views,
            timings,
            measuring: begun.elapsed().as_secs_f64(),
        })
    }
}

/// Gaussians of a splat file.
struct ReadInit {
    path: PathBuf,
    splats: Splats,
    drawn: RasterOptions,
}

/// Gaussians that a training starts from.
struct Begin {
    init: Option<ReadInit>,
    /// Those of a block, and how many of them, the last ones, are surroundings.
    placed: Option<(Splats, usize)>,
}

/// The figures beside a progress bar.
fn in_words(progress: &LumaProgress) -> String {
    let looked = progress.looked.map_or(String::new(), |look| {
        let rise = look
            .per_minute
            .map_or(String::new(), |rise| format!(" ({rise:+.1}/min)"));
        format!("PSNR {:.1} dB{rise}, ", look.psnr)
    });
    format!(
        "{looked}loss {:.4}, {} splats",
        progress.loss, progress.splats
    )
}
