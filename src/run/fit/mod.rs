//! `fit`: photos to geometry and luma.

mod ahead;
mod block;
mod budget;
mod checkpoint;
mod continued;
mod neighbors;
mod report;
mod training;

use std::{cell::RefCell, path::PathBuf, sync::Arc, time::Instant};

use super::{
    Event, Live, Observer, Preset, RunError, RunFolder, Stage,
    checkpoints::{CheckpointOptions, tell_given_up},
    commit::Commit,
    files,
    fingerprint::{check_poses, of_file, of_photos},
    keeping,
    lock::RunLock,
    scene::{open, written_as},
    sound::open_examined,
};
use crate::{
    capture::LoadOptions,
    effects::{Effect, Overrules},
    eval::GRAY_COLUMNS,
    gpu::Gpu,
    luma::{Goal, LumaSettings},
    raster::Raster,
    report::{Report, Row, contact_sheet},
    splats::{Splats, write_splats},
};
use ahead::Ahead;
pub use ahead::AheadOptions;
pub use block::BlockPlace;
use budget::Budget;
use checkpoint::{found_in, question};
pub use neighbors::Neighbors;
pub(super) use report::capture_report;
use training::Job;

/// Changes settings: what is asked for over what a preset or a time limit has chosen.
pub type Overlay = Box<dyn Fn(&mut LumaSettings)>;

/// Gaussians to start from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Init {
    /// Those of a splat file.
    File(PathBuf),
    /// Those of a run that goes on.
    Run {
        /// The run.
        folder: RunFolder,
        /// Its iterations so far.
        iterations: usize,
        /// How many of its Gaussians, the last ones, are surroundings.
        surroundings: usize,
    },
}

impl Init {
    /// The splat file.
    pub fn path(&self) -> PathBuf {
        match self {
            Self::File(path) => path.clone(),
            Self::Run { folder, .. } => folder.luma(),
        }
    }

    /// Iterations that led to them, as far as the run's log has them.
    fn iterations(&self) -> usize {
        match self {
            Self::File(_) => 0,
            Self::Run { iterations, .. } => *iterations,
        }
    }

    /// How many of them are surroundings.
    fn surroundings(&self) -> usize {
        match self {
            Self::File(_) => 0,
            Self::Run { surroundings, .. } => *surroundings,
        }
    }
}

/// What `fit` is asked to do; `None` leaves it to the preset.
pub struct FitOptions {
    /// The COLMAP folder.
    pub colmap_dir: PathBuf,
    /// The run folder; `runs/<folder name>` by default.
    pub output: Option<PathBuf>,
    /// Amount of work; `paper` on a GPU and `draft` on a software adapter by default.
    /// With another goal than a fixed one, the most that is tried, `paper` by default.
    pub preset: Option<Preset>,
    /// What is asked for instead of the preset's settings. Not the iterations together with a
    /// time limit or a target, nor what the plan of effects decides.
    pub settings: Overlay,
    /// How photos are loaded; the longer side is the preset's where it is `None`.
    pub load: LoadOptions,
    /// Longer side at which held-out views are measured; that of training by default.
    pub measure_side: Option<u32>,
    /// Effects that are on or off whatever the evidence.
    pub overrules: Overrules,
    /// Gaussians to start from.
    pub init: Option<Init>,
    /// The block of a larger scene that it is.
    pub block: Option<BlockPlace>,
    /// What a trained block goes on among.
    pub around: Option<Neighbors>,
    /// What is to end the run; seconds are those of all of it. A PSNR is that of the held-out
    /// views, or of some training views where none is held out.
    pub goal: Goal,
    /// Whether the report says where the device's time went.
    pub timings: bool,
    /// Who is to color the photos meanwhile.
    pub ahead: AheadOptions,
    /// How it can go on where it is interrupted.
    pub checkpoints: CheckpointOptions,
    /// Who looks on.
    pub live: Option<Arc<Live>>,
}

impl FitOptions {
    /// All as the preset and the photos have it.
    pub fn new(colmap_dir: PathBuf) -> Self {
        Self {
            colmap_dir,
            output: None,
            preset: None,
            settings: Box::new(|_| {}),
            load: LoadOptions::default(),
            measure_side: None,
            overrules: Overrules::default(),
            init: None,
            block: None,
            around: None,
            goal: Goal::Fixed,
            timings: false,
            ahead: AheadOptions::default(),
            checkpoints: CheckpointOptions::default(),
            live: None,
        }
    }

    /// How many of the Gaussians to start from, the last ones, are surroundings.
    fn surroundings(&self) -> usize {
        self.init.as_ref().map_or(0, Init::surroundings)
    }
}

/// Trains and writes the run folder.
///
/// # Errors
/// [`RunError`]; files of an earlier run stay as they were until training is done.
/// [`RunError::TargetMissed`] comes after the best that was reached is written.
pub fn fit(
    options: &FitOptions,
    observe: &mut Observer<'_>,
) -> Result<(RunFolder, Report), RunError> {
    let opened = Instant::now();
    let mut begun = opened;
    let warnings = RefCell::default();
    let observe = &mut keeping(&warnings, observe);
    observe(Event::begins(Stage::Device));
    let gpu = open_gpu(options.timings)?;
    let raster = Arc::new(Raster::new(&gpu));
    let folder = match &options.output {
        Some(path) => RunFolder::at(path),
        None => RunFolder::for_capture(&options.colmap_dir),
    };
    files::make_run_folder(&folder)?;
    let _lock = RunLock::take(folder.path())?;
    let ahead = Ahead::open(&options.ahead, &folder)?;
    let found = match options.checkpoints.resume {
        true => found_in(&folder, observe)?,
        false => {
            tell_given_up(&folder.checkpoint(), observe);
            None
        }
    };
    // How much there is time for was found out once.
    let budget = match &found {
        Some(found) if options.goal.seconds().is_some() => found.started().budget(),
        _ => Budget::of(options, &raster, begun, observe)?,
    };
    let load = LoadOptions {
        max_side: budget.work.max_side,
        lens: options.overrules.choice(Effect::Lens),
        ..options.load.clone()
    };
    let examined = open_examined(&options.colmap_dir, &load, observe)?;
    let (mut dataset, evidence) = (examined.dataset, examined.evidence);
    if let Some(Init::Run { folder, .. }) = &options.init {
        check_poses(&dataset.capture, &folder.read_report()?.capture.photos)?;
    }
    // Rates are in proportion to it.
    let whole = options.block.as_ref().and_then(BlockPlace::extent);
    dataset.extent = whole.unwrap_or(dataset.extent);
    let (dataset, start) = options.among_neighbors(dataset, &raster, &folder, observe)?;
    let dataset = Arc::new(dataset);
    if let Some(live) = &options.live {
        live.begin(&dataset);
    }
    let question = question(
        options,
        &budget,
        &dataset.options,
        &gpu,
        &examined.fingerprint,
    )?;
    if let Some(found) = &found {
        found.check(&question)?;
        begun = found.begun();
    }
    let judge = match options.measure_side {
        Some(_) => {
            observe(Event::begins(Stage::Model));
            let load = LoadOptions {
                max_side: options.measure_side,
                ..dataset.options.clone()
            };
            // What is to be said about the photos is said of those that are trained on.
            Some(Arc::new(open(&options.colmap_dir, &load, &mut |_| {})?))
        }
        None => None,
    };
    let job = Job {
        options,
        gpu: &gpu,
        raster: &raster,
        dataset: &dataset,
        evidence: &evidence,
        photos: &of_photos(&dataset.capture, &[])?,
        among: start,
        judge: judge.as_ref().unwrap_or(&dataset),
        begun,
        loading: opened.elapsed().as_secs_f64(),
    };
    let trained = ahead.meanwhile(&dataset, observe, |observe| {
        job.train(&budget, &folder, question, found.as_ref(), observe)
    })?;
    let mut report = Report {
        warnings: warnings.take(),
        ..job.report(budget.preset, &trained)
    };
    observe(Event::begins(Stage::Saving));
    GrayFiles {
        splats: &trained.scene.splats,
        rows: &trained.rows,
        log: &trained.log,
        report: &mut report,
    }
    .write(&folder)?;
    match options.goal.psnr().and_then(|psnr| trained.misses(psnr)) {
        Some(error) => Err(error),
        None => Ok((folder, report)),
    }
}

/// The files of a gray scene.
pub(super) struct GrayFiles<'a> {
    pub splats: &'a Splats,
    /// Of the contact sheet.
    pub rows: &'a [Row],
    /// `log.csv`.
    pub log: &'a str,
    /// Told of the file with the scene.
    pub report: &'a mut Report,
}

impl GrayFiles<'_> {
    /// Writes them in the place of those of an earlier run.
    ///
    /// # Errors
    /// [`RunError::File`] and [`RunError::Splats`].
    pub fn write(self, folder: &RunFolder) -> Result<(), RunError> {
        let mut commit = Commit::new(folder.path())?;
        // The old colors do not belong to the new geometry.
        for stale in [
            folder.color(),
            folder.chroma(),
            folder.evaluation(),
            folder.checkpoint(),
            folder.color_checkpoint(),
        ] {
            commit.remove(&stale);
        }
        commit.remove_page(&folder.evaluation_page());
        let drawn = self.report.luma.settings.raster_options();
        let options = written_as(drawn, self.report.capture.offset.into());
        let luma = commit.place(&folder.luma());
        write_splats(&luma, self.splats, &options)?;
        self.report.files = vec![of_file(&luma)?];
        let sheet = contact_sheet(&GRAY_COLUMNS, self.rows);
        files::write_png(&commit.place(&folder.contact_sheet()), &sheet)?;
        files::write(&commit.place(&folder.log()), self.log.as_bytes())?;
        files::write(&commit.place(&folder.report()), &self.report.to_file())?;
        commit.finish()
    }
}

/// The device; with `timed`, its dispatches are.
pub(super) fn open_gpu(timed: bool) -> Result<Gpu, RunError> {
    let gpu = Gpu::open()?;
    Ok(if timed { gpu.timed()? } else { gpu })
}
