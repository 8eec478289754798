//! `merge`: the blocks of a scene put together.

use std::{
    cell::RefCell,
    path::{Path, PathBuf},
    time::Instant,
};

use super::{
    RunError,
    fit::GrayFiles,
    seams::{SeamViews, seam_views},
};
use crate::{
    blocks::{Block, BlockFile, COARSE, Job, Region},
    capture::{Dataset, LoadOptions},
    eval::{Progress, exposures, gray_rows, mean_quality, measure_luma},
    gpu::Gpu,
    input,
    luma::{LumaSettings, start::started},
    report::{CaptureReport, LumaReport, LumaSeconds, Report, ViewExposure},
    splats::Splats,
    store::{RunFolder, StoreError, fingerprint::of_photos, lock::RunLock},
    subject::{
        SubjectError,
        scene::{Frame, read_splats},
        sound::open_checked,
    },
    tell::{Event, Observer, Stage, keeping},
};

#[derive(Clone, Debug)]
pub struct MergeOptions {
    /// The job's folder.
    pub job: PathBuf,
    /// The run folder; `runs/<name of the job's folder>` by default.
    pub output: Option<PathBuf>,
}

/// A block that is trained.
struct Trained {
    block: Block,
    folder: RunFolder,
    /// Nobody trains it meanwhile.
    _lock: Option<RunLock>,
    report: Report,
}

/// Puts the blocks of a job together, measures the whole on the held-out views of all blocks
/// and writes a run folder that every command takes. Of each block it takes what lies in the
/// block's own cell; cells reach to infinity, so that each place is one block's.
///
/// # Errors
/// [`RunError`], where a block is not trained yet or blocks do not belong together.
pub fn merge(
    options: &MergeOptions,
    observe: &mut Observer<'_>,
) -> Result<(RunFolder, Report, SeamViews), RunError> {
    let begun = Instant::now();
    let warnings = RefCell::default();
    let observe = &mut keeping(&warnings, observe);
    let job = Job::read(&options.job)?;
    let blocks = trained(&options.job, &job, observe)?;
    let Some(first) = blocks.first() else {
        return Err(SubjectError::NoSplats(options.job.clone()).into());
    };
    observe(Event::begins(Stage::Device));
    let gpu = Gpu::open()?;
    let folder = match &options.output {
        Some(path) => RunFolder::at(path),
        None => RunFolder::for_capture(&options.job),
    };
    folder.make()?;
    let _lock = RunLock::take(folder.path())?;
    let coarse = options.job.join(COARSE);
    let load = LoadOptions {
        chosen: BlockFile::read(&coarse)?.map(|file| file.photos),
        ..first.report.capture.load.clone()
    };
    let dataset = open_checked(&job.capture, &load, observe)?;
    let (splats, surroundings) = together(&blocks, &job, &dataset, observe)?;
    let loading = begun.elapsed().as_secs_f64();

    observe(Event::begins(Stage::Measuring));
    let told = match RunFolder::at(&coarse).report().is_file() {
        true => RunFolder::at(&coarse).read_report()?.luma.exposures,
        false => of_all(&blocks),
    };
    let shown = exposures(&dataset, &told);
    let settings = &first.report.luma.settings;
    let raster = settings.raster(&gpu);
    let measuring = Instant::now();
    let mut tell = |progress: Progress<'_>| observe(progress.into());
    let views = measure_luma(&raster, &dataset, &splats, &mut tell)?;
    let rows = gray_rows(&raster, &dataset, &splats, &shown)?;
    let seams = seam_views(&dataset.capture, &job, &views);

    let mut report = Report {
        capture: CaptureReport {
            photos: of_photos(&dataset.capture, &[])?,
            ..CaptureReport::of(&job.capture, &dataset)
        },
        warnings: warnings.take(),
        luma: LumaReport {
            settings: LumaSettings {
                max_splats: splats.len(),
                sh_degree: splats.sh.degree,
                // Whoever goes on trains with all photos.
                rates: settings.rates.times(1.0 / job.haste(&first.block)),
                stream_photos: false,
                ..settings.clone()
            },
            splats: splats.len(),
            surroundings,
            exposures: told,
            held_out: mean_quality(&views),
            held_out_views: views,
            seconds: LumaSeconds {
                load: loading,
                measure: measuring.elapsed().as_secs_f64(),
                all: begun.elapsed().as_secs_f64(),
                ..sum_of_seconds(&blocks)
            },
            ..sums(&blocks)
        },
        chroma: None,
        ..first.report.clone()
    };
    observe(Event::begins(Stage::Saving));
    let log = log_of(&blocks);
    GrayFiles {
        splats: &splats,
        rows: &rows,
        log: &log,
        report: &mut report,
    }
    .write(&folder)?;
    Ok((folder, report, seams))
}

/// The blocks' runs.
///
/// # Errors
/// [`StoreError::File`] where one is not there, was trained for another plan, or is drawn or was
/// loaded otherwise than the first; [`StoreError::InUse`].
fn trained(folder: &Path, job: &Job, observe: &mut Observer<'_>) -> Result<Vec<Trained>, RunError> {
    let mut blocks: Vec<Trained> = Vec::new();
    for block in &job.blocks {
        let path = folder.join(&block.name);
        let run = RunFolder::at(&path);
        let refused = |reason: String| RunError::from(StoreError::file(&path, reason));
        if !run.report().is_file() {
            return Err(refused(format!(
                "is not trained yet: run `gs-chroma fit {}`",
                path.display()
            )));
        }
        let (lock, report) = run.lock_to_read()?;
        let file = BlockFile::read(&path)?;
        let plan = file.map(|file| job.plan_of(block, &file));
        match &report.luma.plan {
            None => observe(Event::Warning(format!(
                "{}: its report does not say which plan it was trained for",
                path.display()
            ))),
            trained if *trained != plan => {
                return Err(refused(format!(
                    "was trained for another plan than {}: run `gs-chroma fit {}` again",
                    Job::path(folder).display(),
                    path.display()
                )));
            }
            Some(_) => {}
        }
        if let Some(first) = blocks.first() {
            let alike = |report: &Report| {
                (
                    report.capture.load.max_side,
                    report.capture.load.normalize,
                    report.luma.settings.antialiased,
                )
            };
            if alike(&first.report) != alike(&report) {
                return Err(refused(format!(
                    "does not go with {}: photos' sizes, their range of values, or antialiasing differ; train both with the same options",
                    first.block.name
                )));
            }
        }
        blocks.push(Trained {
            block: block.clone(),
            folder: run,
            _lock: lock,
            report,
        });
    }
    Ok(blocks)
}

/// Gaussians of each block in its own cell, in the dataset's coordinates, and the number of
/// surroundings, the last of these.
fn together(
    blocks: &[Trained],
    job: &Job,
    dataset: &Dataset,
    observe: &mut Observer<'_>,
) -> Result<(Splats, usize), RunError> {
    let offset = dataset.capture.offset;
    let degrees = blocks
        .iter()
        .map(|block| block.report.luma.settings.sh_degree);
    let settings = LumaSettings {
        sh_degree: degrees.max().unwrap_or(0),
        max_splats: usize::MAX,
        ..LumaSettings::default()
    };
    let [mut all, mut around] = [(); 2].map(|()| Splats::with_capacity(0, settings.sh_degree, 1));
    for block in blocks {
        let path = block.folder.luma();
        let (splats, _) = read_splats(&path, Frame::World(offset), observe)?;
        let core = Region {
            ground: job.ground,
            area: block.block.core,
            offset,
        };
        let inner = (splats.len()).saturating_sub(block.report.luma.surroundings);
        for (into, range) in [(&mut all, 0..inner), (&mut around, inner..splats.len())] {
            let own: Vec<usize> = range.filter(|&i| core.holds(splats.means[i])).collect();
            into.append(started(&splats.chosen(&own), &settings));
        }
    }
    if all.is_empty() {
        return Err(SubjectError::NoSplats(dataset.capture.root.clone()).into());
    }
    let surroundings = around.len();
    all.append(around);
    Ok((all, surroundings))
}

/// The exposures that the blocks found, each photo's by the first block that has it.
fn of_all(blocks: &[Trained]) -> Vec<ViewExposure> {
    let mut all: Vec<ViewExposure> = Vec::new();
    for exposure in blocks.iter().flat_map(|block| &block.report.luma.exposures) {
        if !all.iter().any(|known| known.name == exposure.name) {
            all.push(exposure.clone());
        }
    }
    all.sort_by(|a, b| a.name.cmp(&b.name));
    all
}

/// Totals of all blocks, and the maximum memory of one.
fn sums(blocks: &[Trained]) -> LumaReport {
    let reports = || blocks.iter().map(|block| &block.report.luma);
    let splats: usize = reports().map(|luma| luma.splats).sum();
    let weighted = reports().map(|luma| luma.loss * luma.splats as f64);
    LumaReport {
        iterations: reports().map(|luma| luma.iterations).sum(),
        poisoned: reports().map(|luma| luma.poisoned).sum(),
        refused: reports().map(|luma| luma.refused).sum(),
        loss: weighted.sum::<f64>() / splats.max(1) as f64,
        peak_host_memory: reports().filter_map(|luma| luma.peak_host_memory).max(),
        peak_device_memory: reports().filter_map(|luma| luma.peak_device_memory).max(),
        estimated_device_memory: (reports().map(|luma| luma.estimated_device_memory))
            .max()
            .unwrap_or(0),
        curve_on: "none".to_owned(),
        ..LumaReport::default()
    }
}

fn sum_of_seconds(blocks: &[Trained]) -> LumaSeconds {
    let seconds = || blocks.iter().map(|block| &block.report.luma.seconds);
    LumaSeconds {
        train: seconds().map(|seconds| seconds.train).sum(),
        curve: seconds().map(|seconds| seconds.curve).sum(),
        ..LumaSeconds::default()
    }
}

/// The header of a log, which the blocks have.
fn log_of(blocks: &[Trained]) -> String {
    let logs = blocks.iter().map(|block| block.folder.log());
    let read = logs.filter_map(|path| input::read_to_string(&path).ok());
    let header = read
        .filter_map(|log| Some(log.lines().next()?.to_owned()))
        .next();
    header.unwrap_or_default() + "\n"
}
