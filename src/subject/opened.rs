//! A run or a splat file, opened once.

use std::path::{Path, PathBuf};

use glam::DVec3;

use super::{
    SubjectError,
    scene::{Frame, read_scene},
};
use crate::{
    capture::{Capture, LoadOptions},
    raster::RasterOptions,
    report::{PhotoReport, Report},
    splats::{Splats, is_splat_file},
    store::{
        RunFolder, StoreError, fingerprint::check_poses, lock::RunLock, originals::OriginalFiles,
    },
    tell::Observer,
};

/// Lock on a run: the other commands that may use it meanwhile.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LockMode {
    /// Anybody.
    Free,
    /// Those who read it.
    Reading,
    /// Nobody.
    Writing,
}

/// A run with its report.
pub(crate) struct Run {
    pub folder: RunFolder,
    pub report: Report,
    _lock: Option<RunLock>,
}

impl Run {
    /// The run at a path, by default the newest.
    pub fn find(path: Option<&Path>, hold: LockMode) -> Result<Self, StoreError> {
        let folder = RunFolder::find(path)?;
        let (_lock, report) = match hold {
            LockMode::Free => (None, folder.read_report()?),
            LockMode::Reading => folder.lock_to_read()?,
            LockMode::Writing => {
                let (lock, report) = folder.lock()?;
                (Some(lock), report)
            }
        };
        Ok(Self {
            folder,
            report,
            _lock,
        })
    }

    /// The COLMAP folder that is named, or the one that `fit` noted.
    pub fn colmap(&self, named: Option<&Path>) -> PathBuf {
        named.map_or_else(|| PathBuf::from(&self.report.capture.path), Path::to_owned)
    }
}

/// A run or a splat file.
pub(crate) enum Opened {
    Run(Box<Run>),
    File(PathBuf),
}

/// The Gaussians of a run or a file.
pub(crate) struct Scene {
    /// The splat file.
    pub file: PathBuf,
    pub splats: Splats,
    /// Raster options of the scene.
    pub drawn: RasterOptions,
    /// Offset subtracted from COLMAP's coordinates, as far as run or file have it, in world units.
    pub offset: DVec3,
    /// Number of surroundings, the last of these Gaussians.
    pub surroundings: usize,
}

impl Opened {
    /// A run or a splat file, the newest run by default.
    ///
    /// # Errors
    /// As [`Run::find`], and [`SubjectError::Splats`] of a file of another format.
    pub fn find(path: Option<&Path>, hold: LockMode) -> Result<Self, SubjectError> {
        match path {
            Some(path) if is_splat_file(path)? => Ok(Self::File(path.to_owned())),
            run => Ok(Self::Run(Box::new(Run::find(run, hold)?))),
        }
    }

    pub fn run(&self) -> Option<&Run> {
        match self {
            Self::Run(run) => Some(run),
            Self::File(_) => None,
        }
    }

    pub fn folder(&self) -> Option<&RunFolder> {
        self.run().map(|run| &run.folder)
    }

    pub fn report(&self) -> Option<&Report> {
        self.run().map(|run| &run.report)
    }

    /// Photos and poses that the scene was trained with; none where nobody knows.
    pub fn photos(&self) -> &[PhotoReport] {
        self.report().map_or(&[], |report| &report.capture.photos)
    }

    /// Options for loading photos.
    pub fn load(&self) -> LoadOptions {
        let load = self.report().map(|report| report.capture.load.clone());
        load.unwrap_or_default()
    }

    /// The COLMAP folder that is named, or the one that `fit` noted.
    pub fn colmap(&self, named: Option<&Path>) -> Result<PathBuf, SubjectError> {
        match (self, named) {
            (_, Some(path)) => Ok(path.to_owned()),
            (Self::Run(run), None) => Ok(run.colmap(None)),
            (Self::File(path), None) => Err(SubjectError::NoCameras(path.clone())),
        }
    }

    /// Cameras and points, without photos.
    pub fn capture(&self, named: Option<&Path>) -> Result<Capture, SubjectError> {
        let capture = Capture::load_with(&self.colmap(named)?, &self.load())?;
        check_poses(&capture, self.photos())?;
        Ok(capture)
    }

    /// Adds the files that it consists of and was made from.
    pub fn keep(&self, kept: OriginalFiles) -> OriginalFiles {
        match self {
            Self::Run(run) => kept.with_run(&run.folder, &run.report),
            Self::File(path) => kept.with(path, "the splat file"),
        }
    }

    /// The splat file: the colored one unless the luma is wanted.
    pub fn file(&self, luma: bool) -> PathBuf {
        match self {
            Self::Run(run) if !luma && run.folder.color().exists() => run.folder.color(),
            Self::Run(run) => run.folder.luma(),
            Self::File(path) => path.clone(),
        }
    }

    /// Reads the Gaussians; those of a file move to where a capture's cameras are.
    pub fn read(
        &self,
        luma: bool,
        capture: Option<&Capture>,
        observe: &mut Observer<'_>,
    ) -> Result<Scene, SubjectError> {
        let file = self.file(luma);
        let frame = match (self, capture) {
            (Self::File(_), Some(capture)) => Frame::World(capture.offset),
            _ => Frame::Own,
        };
        let read = read_scene(&file, frame, observe)?;
        let (drawn, offset, surroundings) = match self.report() {
            Some(Report { capture, luma, .. }) => (
                luma.settings.raster_options(),
                DVec3::from(capture.offset),
                luma.surroundings,
            ),
            None => (read.drawn, read.offset, 0),
        };
        Ok(Scene {
            splats: match self {
                Self::File(_) if luma => read.splats.to_luma(),
                _ => read.splats,
            },
            file,
            drawn,
            offset,
            surroundings,
        })
    }
}
