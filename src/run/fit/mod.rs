//! `fit`: photos to geometry and luma.

mod ahead;
mod attempt;
mod goal;
mod quality;
mod start;
mod target;
mod told;
mod trial;

use std::{path::PathBuf, sync::Arc, time::Instant};

use super::{
    Event, Observer, Preset, RunError, RunFolder, files,
    preset::Work,
    scene::{examine, open},
};
use crate::{
    capture::LoadOptions,
    effects::{Effect, Overrules},
    gpu::Gpu,
    luma::LumaSettings,
    raster::{Raster, RasterOptions},
    report::Report,
    splats::ply,
};
use ahead::Ahead;
pub use ahead::AheadOptions;
use attempt::Job;
use goal::{Family, SURELY, level_of, preset_below};
pub(super) use told::capture_report;
pub(super) use trial::planned;

/// Changes settings: what is asked for over what a preset or a time limit has chosen.
pub type Overlay = Box<dyn Fn(&mut LumaSettings)>;

/// What `fit` is asked to do; `None` leaves it to the preset.
pub struct FitOptions {
    /// The COLMAP folder.
    pub colmap_dir: PathBuf,
    /// The run folder; `runs/<folder name>` by default.
    pub output: Option<PathBuf>,
    /// Amount of work; `paper` on a GPU and `draft` on a software adapter by default.
    /// With a time limit or a target, the most that is tried, `paper` by default.
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
    pub init: Option<PathBuf>,
    /// Seconds that the whole run may take.
    pub time_limit: Option<f64>,
    /// PSNR of the held-out views, in dB, that is to be reached with as little work as it
    /// takes.
    pub target_psnr: Option<f64>,
    /// Whether the report says where the device's time went.
    pub timings: bool,
    /// Who is to colour the photos meanwhile.
    pub ahead: AheadOptions,
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
            time_limit: None,
            target_psnr: None,
            timings: false,
            ahead: AheadOptions::default(),
        }
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
    let begun = Instant::now();
    let gpu = open_gpu(options.timings)?;
    let preset = choose_preset(options, &gpu, observe);
    let raster = Arc::new(Raster::new(&gpu));
    let folder = match &options.output {
        Some(path) => RunFolder::at(path),
        None => RunFolder::for_capture(&options.colmap_dir),
    };
    files::make_folder(folder.path())?;
    let ahead = Ahead::open(&options.ahead, &folder)?;
    let asked = Work::asked(preset, &options.settings, options.load.max_side);
    let family = match options.time_limit.or(options.target_psnr) {
        Some(_) => Some(Family::of(options, asked.max_side)?),
        None => None,
    };
    let (mut level, mut each) = (level_of(preset), 0.0);
    let mut work = asked.clone();
    if let (Some(family), Some(limit), None) = (&family, options.time_limit, options.target_psnr) {
        let seconds = SURELY * limit - begun.elapsed().as_secs_f64();
        (level, each) = family.level_for(seconds, &raster, observe)?;
        work = family.work(level);
    }
    if options.timings {
        // What was rehearsed is no part of the run.
        gpu.timings()?;
    }

    let load = LoadOptions {
        max_side: work.max_side,
        lens: options.overrules.choice(Effect::Lens),
        ..options.load.clone()
    };
    let dataset = Arc::new(open(&options.colmap_dir, &load, observe)?);
    let judge = match options.measure_side {
        Some(_) => {
            let load = LoadOptions {
                max_side: options.measure_side,
                ..dataset.options.clone()
            };
            // What is to be said about the photos is said of those that are trained on.
            Some(open(&options.colmap_dir, &load, &mut |_| {})?)
        }
        None => None,
    };
    let evidence = examine(&dataset, observe)?;
    let job = Job {
        options,
        gpu: &gpu,
        raster: &raster,
        dataset: &dataset,
        evidence: &evidence,
        judge: judge.as_ref().unwrap_or(&*dataset),
        begun,
    };
    let loading = begun.elapsed().as_secs_f64();
    let (attempt, attempts) = ahead.meanwhile(&dataset, observe, |observe| {
        match (&family, options.target_psnr) {
            (Some(family), Some(target)) => {
                let reached = job.reach(target, family, observe)?;
                level = reached.level;
                Ok((reached.attempt, reached.attempts))
            }
            _ => {
                let limit = job.time_for_training(each)?;
                Ok((job.attempt(&work, limit, observe)?, 1))
            }
        }
    })?;
    let preset = match &family {
        Some(_) => preset_below(level),
        None => preset,
    };
    let missed = options
        .target_psnr
        .and_then(|target| attempt.misses(target));
    let report = job.report(preset, loading, attempts, &attempt);
    // The old colours do not belong to the new geometry.
    for stale in [folder.color(), folder.chroma(), folder.contact_sheet()] {
        files::remove(&stale)?;
    }
    folder.forget_evaluation()?;
    let comments = comments(attempt.settings.raster_options());
    let origin = glam::DVec3::ZERO;
    ply::write_ply(&folder.luma(), &attempt.splats, origin, &comments)?;
    files::write(&folder.log(), attempt.log.as_bytes())?;
    folder.write_report(&report)?;
    match missed {
        Some(error) => Err(error),
        None => Ok((folder, report)),
    }
}

/// The device; with `timed`, its dispatches are.
pub(crate) fn open_gpu(timed: bool) -> Result<Gpu, RunError> {
    let gpu = Gpu::open()?;
    Ok(if timed { gpu.timed()? } else { gpu })
}

/// Comments in the header of every splat file; one says how it wants to be drawn.
pub(super) fn comments(options: RasterOptions) -> Vec<String> {
    let program = format!("gs-chroma {}", env!("CARGO_PKG_VERSION"));
    let mode = options.antialiased.then(|| ply::ANTIALIASED.to_owned());
    std::iter::once(program).chain(mode).collect()
}

fn choose_preset(options: &FitOptions, gpu: &Gpu, observe: &mut Observer<'_>) -> Preset {
    options.preset.unwrap_or_else(|| {
        let goal = options.time_limit.or(options.target_psnr);
        if gpu.is_software() && goal.is_none() {
            observe(Event::Note(format!(
                "{} has no GPU behind it: preset draft (--preset paper overrules)",
                gpu.info().name
            )));
        }
        Preset::for_device(gpu)
    })
}
