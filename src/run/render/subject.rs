//! What is drawn: a run or a splat file, and the cameras that there are.

use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::{
    capture::{Capture, LoadOptions},
    disk::trust::Originals,
    raster::RasterOptions,
    run::{
        Event, Observer, RunError, RunFolder, Stage,
        fingerprint::check_poses,
        originals::Kept,
        scene::{Frame, read_scene},
    },
    splats::{Splats, is_splat_file},
};

/// Half an 8-bit step: what no viewer shows as a color.
const NO_COLOR: f32 = 0.5 / 255.0;

/// A scene that is drawn.
pub(super) struct Subject {
    /// The splat file.
    pub file: PathBuf,
    /// Its Gaussians, with the colors that are wanted.
    pub splats: Splats,
    /// How they are drawn.
    pub drawn: RasterOptions,
    /// Cameras and points; none of a splat file without a COLMAP folder.
    pub capture: Option<Capture>,
    /// How photos are loaded.
    pub load: LoadOptions,
    /// Whether no run says how it was made.
    pub foreign: bool,
    /// What was subtracted from COLMAP's coordinates, in world units.
    pub offset: DVec3,
    /// Run folder, unless a splat file was named.
    pub run: Option<RunFolder>,
    /// Files that are not written over.
    _kept: Originals,
}

impl Subject {
    /// Opens a run or a splat file, the newest run by default; without colors where `luma` is
    /// wanted.
    ///
    /// # Errors
    /// [`RunError`].
    pub fn open(
        path: Option<&Path>,
        colmap: Option<&Path>,
        luma: bool,
        observe: &mut Observer<'_>,
    ) -> Result<Self, RunError> {
        let subject = match path {
            Some(path) if is_splat_file(path)? => Self::of_file(path, colmap, observe),
            run => Self::of_run(run, colmap, luma, observe),
        };
        let mut subject = subject?;
        if luma {
            subject.splats = subject.splats.to_luma();
        }
        Ok(subject)
    }

    fn of_file(
        path: &Path,
        colmap: Option<&Path>,
        observe: &mut Observer<'_>,
    ) -> Result<Self, RunError> {
        observe(Event::begins(Stage::Model));
        let load = LoadOptions::default();
        let load_capture = |dir| Capture::load_with(dir, &load.capture());
        let capture = colmap.map(load_capture).transpose()?;
        let kept = colmap.map_or_else(Kept::default, |dir| Kept::default().with_capture(dir, None));
        let frame = match &capture {
            Some(capture) => Frame::World(capture.offset),
            None => Frame::Own,
        };
        let scene = read_scene(path, frame, observe)?;
        Ok(Self {
            file: path.to_owned(),
            offset: capture
                .as_ref()
                .map_or(scene.offset, |capture| capture.offset),
            splats: scene.splats,
            drawn: scene.drawn,
            capture,
            load,
            foreign: true,
            run: None,
            _kept: kept.with(path, "the splat file").keep(),
        })
    }

    fn of_run(
        path: Option<&Path>,
        colmap: Option<&Path>,
        luma: bool,
        observe: &mut Observer<'_>,
    ) -> Result<Self, RunError> {
        let folder = RunFolder::find(path)?;
        let report = folder.read_report()?;
        let colored = !luma && folder.color().exists();
        let file = match colored {
            true => folder.color(),
            false => folder.luma(),
        };
        observe(Event::begins(Stage::Model));
        let kept = Kept::default().with_run(&folder, &report);
        let load = report.capture.load;
        let noted = PathBuf::from(&report.capture.path);
        let capture = Capture::load_with(colmap.unwrap_or(&noted), &load.capture())?;
        check_poses(&capture, &report.capture.photos)?;
        let scene = read_scene(&file, Frame::Own, observe)?;
        Ok(Self {
            file,
            splats: scene.splats,
            drawn: report.luma.settings.raster_options(),
            offset: capture.offset,
            capture: Some(capture),
            load,
            foreign: false,
            _kept: kept.keep(),
            run: Some(folder),
        })
    }

    /// The capture.
    ///
    /// # Errors
    /// [`RunError::NoCameras`].
    pub fn cameras(&self) -> Result<&Capture, RunError> {
        let none = || RunError::NoCameras(self.file.clone());
        self.capture.as_ref().ok_or_else(none)
    }

    /// The same scene without colors.
    ///
    /// # Errors
    /// [`RunError::NoColors`] where it has none, and those of the run's file.
    pub fn gray(&self, observe: &mut Observer<'_>) -> Result<Splats, RunError> {
        match &self.run {
            _ if self.splats.is_gray(NO_COLOR) => Err(RunError::NoColors(match &self.run {
                Some(run) => run.path().to_owned(),
                None => self.file.clone(),
            })),
            Some(run) => Ok(read_scene(&run.luma(), Frame::Own, observe)?
                .splats
                .to_luma()),
            None => Ok(self.splats.to_luma()),
        }
    }
}
