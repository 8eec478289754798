//! What `colorize` colors.

use std::path::{Path, PathBuf};

use super::{ColorizeOptions, Preset, RunError, RunFolder, lock::RunLock, originals::Kept};
use crate::{
    capture::LoadOptions,
    effects::Overrules,
    gpu::Gpu,
    report::{CaptureReport, DeviceReport, LumaReport, REPORT_VERSION, Report},
    splats::{Format, is_splat_file},
};

/// Where the gray Gaussians come from.
pub(super) struct Source {
    pub folder: Option<RunFolder>,
    pub report: Option<Report>,
    pub splats: PathBuf,
    /// On the run folder.
    _lock: Option<RunLock>,
}

impl Source {
    pub fn find(options: &ColorizeOptions) -> Result<Self, RunError> {
        match &options.run {
            Some(path) if is_splat_file(path)? => Ok(Self {
                folder: None,
                report: None,
                splats: path.clone(),
                _lock: None,
            }),
            run => {
                let folder = RunFolder::find(run.as_deref())?;
                let (lock, report) = RunLock::of_run(&folder)?;
                Ok(Self {
                    report: Some(report),
                    _lock: Some(lock),
                    splats: folder.luma(),
                    folder: Some(folder),
                })
            }
        }
    }

    /// The run folder, where what is found is to be kept there.
    pub fn kept(&self, options: &ColorizeOptions) -> Option<&RunFolder> {
        self.folder.as_ref().filter(|_| !options.relight)
    }

    /// Files that are not written over.
    pub fn kept_files(&self, options: &ColorizeOptions, colmap_dir: &Path) -> Kept {
        let teach = &options.teach;
        let named = teach
            .teachers
            .iter()
            .map(|(path, _)| path)
            .chain(&teach.hints);
        let kept = Kept::default()
            .with_all(named, "a file of a teacher or a hint")
            .with_capture(colmap_dir, None)
            .with(&self.splats, "the gray scene");
        match (&self.folder, &self.report) {
            (Some(folder), Some(report)) => kept.with_run(folder, report),
            _ => kept,
        }
    }

    pub fn colmap_dir(&self, options: &ColorizeOptions) -> Result<PathBuf, RunError> {
        match (&options.colmap, &self.report) {
            (Some(path), _) => Ok(path.clone()),
            (None, Some(report)) => Ok(PathBuf::from(&report.capture.path)),
            (None, None) => Err(RunError::NoCameras(self.splats.clone())),
        }
    }

    /// The run's report, or an empty one for a splat file.
    pub fn report(&self, gpu: &Gpu) -> Report {
        let preset = Preset::for_device(gpu);
        self.report.clone().unwrap_or_else(|| Report {
            version: REPORT_VERSION,
            program: env!("CARGO_PKG_VERSION").to_owned(),
            capture: CaptureReport {
                path: String::new(),
                views: 0,
                train: 0,
                test: 0,
                points: 0,
                rejected: Vec::new(),
                load: preset.load_options(&LoadOptions::default(), &Overrules::default()),
                masked_views: 0,
                not_finite: 0,
                extent: 0.0,
                offset: [0.0; 3],
                photos: Vec::new(),
            },
            device: DeviceReport {
                name: gpu.describe(),
                backend: format!("{:?}", gpu.info().backend),
                software: gpu.is_software(),
            },
            preset,
            effects: Vec::new(),
            warnings: Vec::new(),
            files: Vec::new(),
            luma: LumaReport::default(),
            chroma: None,
        })
    }

    pub fn default_output(&self) -> PathBuf {
        match &self.folder {
            Some(folder) => folder.color(),
            None => {
                let mut path = Format::stem(&self.splats).into_os_string();
                path.push("-color.ply");
                path.into()
            }
        }
    }
}
