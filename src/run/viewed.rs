//! A run or a splat file opened for viewing.

use std::{
    fs,
    path::Path,
    sync::{Arc, Mutex, PoisonError},
};

use image::RgbImage;

use super::{
    RunError,
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
    raster::{RasterOptions, RenderedImage, constants::NEAR_SHARE},
    report::{Report, to_image},
    splats::Splats,
    store::{RunFolder, StoreError, fingerprint::check_poses, originals::OriginalFiles},
    subject::{LockMode, Opened, Run, SceneKind, scene::open, sound::open_same},
    tell::{Event, Observer, Stage},
};

/// Bytes of photos that are kept: those around the one that is looked at, and those of which a
/// stroke changes the colors.
const CACHE_BYTES: usize = 256 << 20;

/// A run or a splat file that is looked at.
pub struct ViewedScene {
    /// Name in titles.
    pub name: String,
    /// Views with cameras and photos; none where the COLMAP folder is not there.
    pub dataset: Option<Arc<Dataset>>,
    opened: Opened,
    scenes: Vec<SceneKind>,
    teachers: Mutex<LazyTeachers>,
    /// Files that are not written over.
    _kept: Originals,
}

/// The run's teachers, opened when they are asked for the first time.
enum LazyTeachers {
    NotYet,
    Opened(Box<Teachers>),
    Refused(String),
}

impl ViewedScene {
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
        let opened = Opened::find(run, LockMode::Free)?;
        let dataset = views(&opened, colmap, observe)?;
        Ok(Self::of(opened, dataset))
    }

    /// Opens a run whose photos are to be worked on: they have to be there, and those that were
    /// trained on.
    ///
    /// # Errors
    /// [`RunError`].
    pub(crate) fn open_run(
        run: Option<&Path>,
        colmap: Option<&Path>,
        observe: &mut Observer<'_>,
    ) -> Result<Self, RunError> {
        observe(Event::begins(Stage::Model));
        let run = Run::find(run, LockMode::Free)?;
        let capture = &run.report.capture;
        let load = LoadOptions {
            force: true,
            ..capture.load.clone()
        };
        let dataset = open_same(&run.colmap(colmap), &load, capture, observe)?;
        Ok(Self::of(Opened::Run(Box::new(run)), Some(dataset)))
    }

    fn of(opened: Opened, dataset: Option<Dataset>) -> Self {
        let (of, scenes) = match &opened {
            // What a file shows is only known once it is read; it is shown as it is.
            Opened::File(path) => (path.clone(), vec![SceneKind::Color]),
            Opened::Run(run) => {
                let all = [
                    (SceneKind::Color, run.folder.color()),
                    (SceneKind::Luma, run.folder.luma()),
                ];
                let there = all.into_iter().filter(|(_, path)| path.exists());
                let here = fs::canonicalize(run.folder.path());
                let here = here.unwrap_or_else(|_| run.folder.path().to_owned());
                (here, there.map(|(kind, _)| kind).collect())
            }
        };
        let name = of.file_name().unwrap_or(of.as_os_str()).to_string_lossy();
        Self {
            name: name.into_owned(),
            dataset: dataset.map(|dataset| Arc::new(dataset.caching(CACHE_BYTES))),
            scenes,
            teachers: Mutex::new(LazyTeachers::NotYet),
            _kept: opened.keep(OriginalFiles::default()).keep(),
            opened,
        }
    }

    /// The run's folder; none of a splat file.
    pub(crate) fn folder(&self) -> Option<&RunFolder> {
        self.opened.folder()
    }

    /// The run's report; none of a splat file.
    pub fn report(&self) -> Option<&Report> {
        self.opened.report()
    }

    /// The scenes that there are, the colored one first.
    pub fn scenes(&self) -> impl Iterator<Item = SceneKind> {
        self.scenes.iter().copied()
    }

    /// A scene, and how it is drawn; none where there is no such scene.
    pub fn read(
        &self,
        kind: SceneKind,
        observe: &mut Observer<'_>,
    ) -> Result<Option<(Splats, RasterOptions)>, RunError> {
        if !self.scenes.contains(&kind) {
            return Ok(None);
        }
        let capture = self.dataset.as_ref().map(|dataset| &dataset.capture);
        let scene = (self.opened).read(kind == SceneKind::Luma, capture, observe)?;
        let splats = match kind {
            // One channel, in luma's case, says all.
            SceneKind::Luma => scene.splats.to_luma(),
            SceneKind::Color => scene.splats,
        };
        Ok(Some((splats, scene.drawn)))
    }

    /// The nearest depth at which Gaussians are shown, in world units; none where no cameras say
    /// how large the scene is.
    pub fn near(&self) -> Option<f64> {
        (self.dataset.as_ref()).map(|dataset| NEAR_SHARE * dataset.extent)
    }

    /// Returns true if a teacher can be asked for the colors of photos.
    pub fn has_teacher(&self) -> bool {
        let chroma = self.report().and_then(|report| report.chroma.as_ref());
        self.dataset.is_some()
            && chroma.is_some_and(|chroma| chroma.teachers.iter().any(|t| t.path.is_some()))
    }

    /// The photo of a view in its teacher's colors: from the answers that the run has kept, or
    /// asked anew. None where the teacher has no answer, or there is no such view.
    pub fn teacher(&self, view: usize) -> Result<Option<RgbImage>, RunError> {
        let (Some(dataset), Some(photo)) = (&self.dataset, self.photo(view)?) else {
            return Ok(None);
        };
        let mut asked = self.teachers.lock().unwrap_or_else(PoisonError::into_inner);
        if matches!(*asked, LazyTeachers::NotYet) {
            *asked = match self.open_teachers(dataset) {
                Ok(teachers) => LazyTeachers::Opened(Box::new(teachers)),
                Err(error) => LazyTeachers::Refused(error.to_string()),
            };
        }
        let teachers = match &mut *asked {
            LazyTeachers::Opened(teachers) => teachers,
            LazyTeachers::Refused(reason) => {
                return Err(StoreError::file(
                    &self
                        .opened
                        .folder()
                        .map(RunFolder::teacher)
                        .unwrap_or_default(),
                    format!("the run's teacher cannot be used: {reason}"),
                )
                .into());
            }
            LazyTeachers::NotYet => return Ok(None),
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
        let channels = |channels, pixels| RenderedImage {
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
        let options = self.report().map(TeachOptions::of_run).unwrap_or_default();
        let cache = self.opened.folder().map(RunFolder::teacher);
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
        let log = self
            .opened
            .folder()
            .and_then(|folder| input::read_to_string(&folder.log()).ok())
            .unwrap_or_default();
        let until = self.report().map_or(0, |report| report.luma.iterations) as f64;
        let row = |line: &str| -> Option<[f64; 2]> {
            let mut fields = line.split(',').map(|field| field.parse().ok());
            Some([fields.next()??, fields.next()??])
        };
        let rows = log.lines().filter_map(row);
        rows.filter(|[iteration, _]| *iteration <= until).collect()
    }
}

/// Views of the scene, if there are any. Photos of a run that are not there any more are a
/// warning, unless their folder was named.
fn views(
    opened: &Opened,
    colmap: Option<&Path>,
    observe: &mut Observer<'_>,
) -> Result<Option<Dataset>, RunError> {
    let of_run = opened.run().is_some();
    if !of_run && colmap.is_none() {
        return Ok(None);
    }
    let mut load = opened.load();
    load.force |= of_run;
    let mut told = |event| {
        if !of_run {
            observe(event);
        }
    };
    let found = open(&opened.colmap(colmap)?, &load, &mut told).and_then(|dataset| {
        check_poses(&dataset.capture, opened.photos())?;
        Ok(dataset)
    });
    match found {
        Err(error) if colmap.is_none() => {
            observe(Event::Warning(format!(
                "no cameras and photos: {error} (name their COLMAP folder)"
            )));
            Ok(None)
        }
        found => Ok(Some(found?)),
    }
}
