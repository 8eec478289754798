//! The scene, the photos and the teachers of a coloring.

use std::{path::PathBuf, sync::Arc, time::Duration};

use glam::DVec3;

use super::request::{ColorizeRequest, Output};
use crate::{
    capture::{Dataset, LoadOptions},
    chroma::{
        ChromaSettings,
        teacher::{TeacherError, cache_folder},
    },
    disk::trust::Originals,
    effects::Overrules,
    gpu::Gpu,
    luma::{LumaSettings, Preset},
    raster::Raster,
    report::LumaReport,
    run::{
        RunError, TeacherCommand,
        teach::{TeacherAnswers, Teachers},
    },
    splats::{Format, Splats, WriteOptions},
    store::{RunFolder, files, fingerprint::check_poses, originals::OriginalFiles},
    subject::{
        LockMode, Opened, SceneKind,
        foreign::drawn_like_photos,
        scene::written_as,
        sound::{open_checked, open_examined, open_trusted},
    },
    tell::{Event, Observer, Stage},
};

/// Scene to color, with its inputs opened.
pub(super) struct Coloring<'a> {
    pub request: &'a ColorizeRequest,
    pub opened: Opened,
    pub colmap: PathBuf,
    pub teachers: Teachers,
    pub gpu: Gpu,
    pub raster: Arc<Raster>,
    pub preset: Preset,
    pub dataset: Arc<Dataset>,
    /// Photos are those that the scene was trained on.
    pub trusted: bool,
    /// The gray scene, one channel.
    pub luma: Splats,
    /// Stage 1, as far as the run or the splat file tells.
    pub trained: LumaReport,
    /// Iterations of Adam.
    pub iterations: usize,
    pub output: Output,
    /// Options for writing the colored scene.
    pub written: WriteOptions,
    _kept: Originals,
}

/// Supervision from the teachers, and settings of the solver.
pub(super) struct Supervised {
    pub taught: TeacherAnswers,
    pub settings: ChromaSettings,
}

impl<'a> Coloring<'a> {
    /// Opens all that is needed before the teachers are asked.
    pub fn open(
        request: &'a ColorizeRequest,
        observe: &mut Observer<'_>,
    ) -> Result<Self, RunError> {
        let opened = Opened::find(request.run.as_deref(), LockMode::Writing)?;
        let colmap = opened.colmap(request.colmap.as_deref())?;
        let named = request.teach.teachers.iter().map(|(path, _)| path);
        let kept = OriginalFiles::default()
            .with_all(
                named.chain(&request.teach.hints),
                "a file of a teacher or a hint",
            )
            .with_capture(&colmap, None)
            .with(&opened.file(true), "the gray scene");
        let kept = opened.keep(kept).keep();
        let cache = opened.folder().map(RunFolder::teacher);
        let mut teachers = Teachers::open(&request.teach, &colmap, cache.as_deref())?;
        observe(Event::begins(Stage::Device));
        let gpu = Gpu::open_timed(request.timings)?;
        let usual = Preset::for_device(&gpu);
        let preset = opened.report().map_or(usual, |report| report.preset);
        // `fit` has compared a run's photos with their model; in another light they may well
        // show something else.
        let trusted = request.relight || (opened.run().is_some() && request.colmap.is_none());
        let dataset = photos(request, &opened, preset, trusted, observe)?;
        if let Some((command, weight)) = &request.teach.command {
            let kept = cache.or_else(|| cache_folder("commands"));
            let kept = kept.ok_or(TeacherError::NoCacheFolder)?;
            let command = TeacherCommand::parse(command).map_err(RunError::Command)?;
            let folder = command.color(&dataset, &kept, observe)?;
            teachers.add(folder, *weight, &request.teach)?;
        }
        let read = opened.read(true, Some(&dataset.capture), observe)?;
        let luma = read.splats.to_luma();
        let trained = match opened.report() {
            Some(report) => report.luma.clone(),
            None => {
                let of = (read.file.as_path(), &luma);
                let drawn = drawn_like_photos(&gpu, &dataset, of, read.drawn, observe)?;
                LumaReport {
                    splats: luma.len(),
                    settings: LumaSettings {
                        sh_degree: luma.sh.degree,
                        antialiased: drawn.antialiased,
                        ..LumaSettings::default()
                    },
                    ..LumaReport::default()
                }
            }
        };
        let iterations = match request.until {
            Some(until) if until <= trained.iterations => {
                let luma = trained.iterations;
                return Err(RunError::NothingUntil { until, luma });
            }
            Some(until) => until - trained.iterations,
            // As many as the preset's, however many stage 1 really took.
            None => preset.adam_iterations(),
        };
        let drawn = trained.settings.raster_options();
        let moved = dataset.capture.offset;
        let written = match opened {
            // As the gray file has it.
            Opened::File(_) if read.offset == DVec3::ZERO => WriteOptions {
                added: moved,
                ..written_as(drawn, DVec3::ZERO)
            },
            _ => written_as(drawn, moved),
        };
        Ok(Self {
            output: output(request, &opened)?,
            raster: Arc::new(Raster::with(&gpu, drawn)),
            request,
            opened,
            colmap,
            teachers,
            gpu,
            preset,
            dataset,
            trusted,
            luma,
            trained,
            iterations,
            written,
            _kept: kept,
        })
    }

    /// The run folder, where the colors are to be kept there.
    pub fn kept(&self) -> Option<&RunFolder> {
        self.opened.folder().filter(|_| !self.request.relight)
    }

    /// Shows a scene to whoever looks on.
    pub fn show(&self, kind: SceneKind, splats: &Splats) {
        if let Some(live) = &self.request.live {
            live.show(kind, splats.clone(), Duration::ZERO);
        }
    }
}

/// The photos, of which each is looked at once from here on.
fn photos(
    request: &ColorizeRequest,
    opened: &Opened,
    preset: Preset,
    trusted: bool,
    observe: &mut Observer<'_>,
) -> Result<Arc<Dataset>, RunError> {
    let colmap = opened.colmap(request.colmap.as_deref())?;
    let mut load = match opened.report() {
        Some(report) => report.capture.load.clone(),
        None => preset.load_options(&LoadOptions::default(), &Overrules::default()),
    };
    load.force |= request.force;
    let dataset = match trusted {
        true if request.relight => open_checked(&colmap, &load, observe)?,
        true => open_trusted(&colmap, &load, opened.photos(), observe)?,
        false => open_examined(&colmap, &load, observe)?.dataset,
    };
    check_poses(&dataset.capture, opened.photos())?;
    Ok(Arc::new(dataset.caching(0)))
}

/// Paths of the output files; the folder of a separate splat file is created.
fn output(request: &ColorizeRequest, opened: &Opened) -> Result<Output, RunError> {
    let usual = match opened {
        Opened::Run(run) => run.folder.color(),
        Opened::File(path) => {
            let mut path = Format::stem(path).into_os_string();
            path.push("-color.ply");
            path.into()
        }
    };
    let own = (opened.folder())
        .filter(|_| !request.relight && request.output.as_ref().is_none_or(|path| *path == usual));
    let output = Output {
        contact_sheet: own.map(RunFolder::contact_sheet),
        ply: request.output.clone().unwrap_or(usual),
    };
    // Its own is replaced together with the run's other files.
    if output.contact_sheet.is_none() {
        files::format_of(&output.ply)?;
        files::make_folder_of(&output.ply)?;
    }
    Ok(output)
}
