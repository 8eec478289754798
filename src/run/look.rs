//! What there is to see of a run or a splat file.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use image::RgbImage;

use super::{
    Event, Observer, RunError, RunFolder, Stage,
    fingerprint::check_poses,
    originals::Kept,
    scene::{Frame, open, read_scene},
    teach::{TeachOptions, Teachers},
};
use crate::{
    capture::{CaptureError, Dataset, LoadOptions, Photo},
    chroma::{
        native_rgb,
        teacher::{GrayImage, Query},
    },
    disk::trust::Originals,
    input,
    raster::{Picture, RasterOptions, constants::NEAR_SHARE},
    report::{Report, to_image},
    splats::{Splats, is_splat_file},
};

/// Bytes of photos that are kept: those around the one that is looked at.
const CACHE_BYTES: usize = 64 << 20;

/// One of a run's scenes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SceneKind {
    /// `color.ply`.
    Color,
    /// `luma.ply`.
    Luma,
}

impl SceneKind {
    /// Name on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Color => "color",
            Self::Luma => "luma",
        }
    }
}

/// A run or a splat file that is looked at.
pub struct Look {
    /// Name in titles.
    pub name: String,
    /// The run's report; none of a splat file.
    pub report: Option<Report>,
    /// Views with cameras and photos; none where the COLMAP folder is not there.
    pub dataset: Option<Dataset>,
    /// The run's folder.
    folder: Option<RunFolder>,
    scenes: Vec<(SceneKind, PathBuf)>,
    frame: Frame,
    teachers: Mutex<Asked>,
    /// Files that are not written over.
    _kept: Originals,
}

/// The run's teachers, opened when they are asked for the first time.
enum Asked {
    NotYet,
    Opened(Box<Teachers>),
    Refused(String),
}

impl Look {
    /// Opens a run folder, by default the newest, or a splat file, with the cameras of a COLMAP
    /// folder: that which `fit` noted unless another is named.
    ///
    /// # Errors
    /// [`RunError`]. Where a run's photos are not there any more, there is a warning, and the
    /// scene without cameras.
    pub fn open(
        run: Option<&Path>,
        colmap: Option<&Path>,
        observe: &mut Observer<'_>,
    ) -> Result<Self, RunError> {
        observe(Event::begins(Stage::Model));
        match run {
            Some(path) if is_splat_file(path)? => Self::of_file(path, colmap, observe),
            run => Self::of_run(RunFolder::find(run)?, colmap, observe),
        }
    }

    fn of_file(
        path: &Path,
        colmap: Option<&Path>,
        observe: &mut Observer<'_>,
    ) -> Result<Self, RunError> {
        let dataset = colmap.map(|dir| open(dir, &LoadOptions::default(), observe));
        let dataset = dataset.transpose()?.map(|found| found.caching(CACHE_BYTES));
        let name = path.file_name().unwrap_or(path.as_os_str());
        Ok(Self {
            name: name.to_string_lossy().into_owned(),
            report: None,
            folder: None,
            // What it shows is only known once it is read; it is shown as it is.
            scenes: vec![(SceneKind::Color, path.to_owned())],
            frame: (dataset.as_ref()).map_or(Frame::Own, |d| Frame::World(d.capture.offset)),
            dataset,
            teachers: Mutex::new(Asked::NotYet),
            _kept: Kept::default().with(path, "the splat file").keep(),
        })
    }

    fn of_run(
        folder: RunFolder,
        colmap: Option<&Path>,
        observe: &mut Observer<'_>,
    ) -> Result<Self, RunError> {
        let report = folder.read_report()?;
        let load = LoadOptions {
            force: true,
            ..report.capture.load.clone()
        };
        let noted = PathBuf::from(&report.capture.path);
        let opened = open(colmap.unwrap_or(&noted), &load, &mut |_| {}).and_then(|dataset| {
            check_poses(&dataset.capture, &report.capture.photos)?;
            Ok(dataset)
        });
        let dataset = match opened {
            Ok(dataset) => Some(dataset.caching(CACHE_BYTES)),
            Err(error) if colmap.is_none() => {
                observe(Event::Warning(format!(
                    "no cameras and photos: {error} (name their folder with --colmap)"
                )));
                None
            }
            Err(error) => return Err(error),
        };
        let all = [
            (SceneKind::Color, folder.color()),
            (SceneKind::Luma, folder.luma()),
        ];
        let here = fs::canonicalize(folder.path());
        let here = here.unwrap_or_else(|_| folder.path().to_owned());
        let name = here.file_name().unwrap_or(here.as_os_str());
        Ok(Self {
            name: name.to_string_lossy().into_owned(),
            _kept: Kept::default().with_run(&folder, &report).keep(),
            report: Some(report),
            dataset,
            scenes: all.into_iter().filter(|(_, path)| path.exists()).collect(),
            folder: Some(folder),
            frame: Frame::Own,
            teachers: Mutex::new(Asked::NotYet),
        })
    }

    /// The scenes that there are, the colored one first.
    pub fn scenes(&self) -> impl Iterator<Item = SceneKind> {
        self.scenes.iter().map(|(kind, _)| *kind)
    }

    /// A scene, and how it is drawn; none where there is no such scene.
    ///
    /// # Errors
    /// [`RunError`] of the file.
    pub fn read(
        &self,
        kind: SceneKind,
        observe: &mut Observer<'_>,
    ) -> Result<Option<(Splats, RasterOptions)>, RunError> {
        let path = self.scenes.iter().find(|(known, _)| *known == kind);
        let Some((_, path)) = path else {
            return Ok(None);
        };
        let scene = read_scene(path, self.frame, observe)?;
        let drawn = (self.report.as_ref())
            .map_or(scene.drawn, |report| report.luma.settings.raster_options());
        let splats = match kind {
            // One channel, in luma's case, says all.
            SceneKind::Luma => scene.splats.to_luma(),
            SceneKind::Color => scene.splats,
        };
        Ok(Some((splats, drawn)))
    }

    /// The nearest depth at which Gaussians are shown, in world units; none where no cameras say
    /// how large the scene is.
    pub fn near(&self) -> Option<f64> {
        (self.dataset.as_ref()).map(|dataset| NEAR_SHARE * dataset.extent)
    }

    /// Whether somebody can say what color photos are.
    pub fn has_teacher(&self) -> bool {
        let chroma = self
            .report
            .as_ref()
            .and_then(|report| report.chroma.as_ref());
        self.dataset.is_some()
            && chroma.is_some_and(|chroma| chroma.teachers.iter().any(|t| t.path.is_some()))
    }

    /// The photo of a view in its teacher's colors: from the answers that the run has kept, or
    /// asked anew. None where the teacher has no answer, or there is no such view.
    ///
    /// # Errors
    /// [`RunError`] of the photo, or where the teacher is not there any more.
    pub fn teacher(&self, view: usize) -> Result<Option<RgbImage>, RunError> {
        let (Some(dataset), Some(photo)) = (&self.dataset, self.photo(view)?) else {
            return Ok(None);
        };
        let mut asked = self.teachers.lock().unwrap_or_else(PoisonError::into_inner);
        if matches!(*asked, Asked::NotYet) {
            *asked = match self.open_teachers(dataset) {
                Ok(teachers) => Asked::Opened(Box::new(teachers)),
                Err(error) => Asked::Refused(error.to_string()),
            };
        }
        let teachers = match &mut *asked {
            Asked::Opened(teachers) => teachers,
            Asked::Refused(reason) => {
                return Err(RunError::File {
                    path: self
                        .folder
                        .as_ref()
                        .map(RunFolder::teacher)
                        .unwrap_or_default(),
                    reason: format!("the run's teacher cannot be asked: {reason}"),
                });
            }
            Asked::NotYet => return Ok(None),
        };
        let gray = GrayImage {
            width: photo.width,
            height: photo.height,
            pixels: &photo.gray,
        };
        let query = Query::view(&dataset.capture.views[view], &dataset.cameras[view]);
        let Some(answer) = teachers.color(query, gray)? else {
            return Ok(None);
        };
        let channels = |channels, pixels| Picture {
            width: photo.width,
            height: photo.height,
            channels,
            pixels,
        };
        let (luma, ab) = (photo.gray_values(), answer.ab.into_flattened());
        let rgb = native_rgb(&channels(1, luma), &channels(2, ab));
        Ok(Some(to_image(photo.width, photo.height, &rgb)))
    }

    fn open_teachers(&self, dataset: &Dataset) -> Result<Teachers, RunError> {
        let options = (self.report.as_ref())
            .map(TeachOptions::of_run)
            .unwrap_or_default();
        let cache = self.folder.as_ref().map(RunFolder::teacher);
        let mut teachers = Teachers::open(&options, &dataset.capture.root, cache.as_deref())?;
        teachers.know(&dataset.capture);
        Ok(teachers)
    }

    /// The gray photo of a view, as it was trained on.
    ///
    /// # Errors
    /// [`CaptureError`]; none where there is no such view.
    pub fn photo(&self, view: usize) -> Result<Option<Arc<Photo>>, CaptureError> {
        match &self.dataset {
            Some(dataset) if view < dataset.cameras.len() => dataset.photo(view).map(Some),
            _ => Ok(None),
        }
    }

    /// The rows of the run's log: iterations and losses of the luma.
    pub fn losses(&self) -> Vec<[f64; 2]> {
        let log = (self.folder.as_ref())
            .and_then(|folder| input::read_to_string(&folder.log()).ok())
            .unwrap_or_default();
        let until = (self.report.as_ref()).map_or(0, |report| report.luma.iterations) as f64;
        let row = |line: &str| -> Option<[f64; 2]> {
            let mut fields = line.split(',').map(|field| field.parse().ok());
            Some([fields.next()??, fields.next()??])
        };
        let rows = log.lines().filter_map(row);
        rows.filter(|[iteration, _]| *iteration <= until).collect()
    }
}
