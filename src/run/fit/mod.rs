//! `fit`: photos to geometry and luma.

mod block;
mod budget;
mod checkpoint;
mod continued;
mod neighbors;
mod report;
mod request;
mod training;

use std::{cell::RefCell, sync::Arc, time::Instant};

use super::RunError;
use crate::{
    capture::LoadOptions,
    effects::Effect,
    eval::GRAY_COLUMNS,
    gpu::Gpu,
    raster::Raster,
    report::{Report, Row, contact_sheet},
    splats::{Splats, write_splats},
    store::{
        RunFolder,
        checkpoints::tell_given_up,
        commit::Commit,
        files,
        fingerprint::{check_poses, of_file, of_photos},
        lock::RunLock,
    },
    subject::{
        scene::{open, written_as},
        sound::open_examined,
    },
    tell::{Event, Observer, Stage, keeping},
};
pub use block::BlockPlace;
use budget::Budget;
use checkpoint::{found_in, question};
pub use request::{FitRequest, Init};
use training::Job;

/// Trains and writes the run folder.
///
/// # Errors
/// [`RunError`]; files of an earlier run stay as they were until training is done.
/// [`RunError::TargetMissed`] comes after the best that was reached is written.
pub fn fit(
    options: &FitRequest,
    observe: &mut Observer<'_>,
) -> Result<(RunFolder, Report), RunError> {
    let opened = Instant::now();
    let mut begun = opened;
    let warnings = RefCell::default();
    let observe = &mut keeping(&warnings, observe);
    observe(Event::begins(Stage::Device));
    let gpu = Gpu::open_timed(options.timings)?;
    let raster = Arc::new(Raster::new(&gpu));
    let folder = match &options.output {
        Some(path) => RunFolder::at(path),
        None => RunFolder::for_capture(&options.colmap_dir),
    };
    folder.make()?;
    let _lock = RunLock::take(folder.path())?;
    let found = match options.checkpoints.resume {
        true => found_in(&folder, observe)?,
        false => {
            tell_given_up(&folder.checkpoint(), observe);
            None
        }
    };
    // How much there is time for was found out once.
    let budget = match &found {
        Some(found) if options.goal.seconds().is_some() => found.started().clone(),
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
    let trained = job.train(&budget, &folder, question, found.as_ref(), observe)?;
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
    trained.write_album(&dataset, &folder)?;
    match options.goal.psnr().and_then(|psnr| trained.misses(psnr)) {
        Some(error) => Err(error),
        None => Ok((folder, report)),
    }
}

/// The files of a gray scene.
pub(super) struct GrayFiles<'a> {
    pub splats: &'a Splats,
    /// Rows of the contact sheet.
    pub rows: &'a [Row],
    /// `log.csv`.
    pub log: &'a str,
    /// Report, completed with the scene's file.
    pub report: &'a mut Report,
}

impl GrayFiles<'_> {
    /// Writes them in the place of those of an earlier run.
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
        Ok(commit.finish()?)
    }
}
