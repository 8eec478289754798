//! The run whose photos are painted on.

use std::{
    ops::Range,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
};

use super::command::{Choices, words};
use crate::{
    capture::{Dataset, Exposure, Orientation},
    chroma::{
        ChromaSettings, SolverKind,
        teacher::{GrayImage, HintFolder, HintImage, Query, TeacherError},
    },
    eval::exposures,
    frames::{SceneDrawer, ViewOf, believable, places},
    gpu::Gpu,
    raster::Raster,
    report::Report,
    run::{RunError, TeachOptions, Teachers, ViewedScene},
    splats::{ShField, Splats},
    store::{RunFolder, StoreError, files, lock::RunLock},
    subject::scene::{Frame, read_scene},
    tell::{Event, Observer, Stage},
};

/// A photo that can be painted on.
pub struct PaintedPhoto {
    /// Its path below the folder of photos.
    pub name: String,
    /// Its views.
    pub views: Range<usize>,
    /// From its file's pixels to upright ones.
    pub of_file: Orientation,
    /// Width and height of the layer, upright.
    pub size: [u32; 2],
}

/// A run with its photos, as long as somebody paints.
pub struct PaintScene {
    pub viewed: Arc<ViewedScene>,
    pub folder: RunFolder,
    pub report: Report,
    pub dataset: Arc<Dataset>,
    pub photos: Vec<PaintedPhoto>,
    pub luma: Splats,
    pub raster: Arc<Raster>,
    /// The run's a and b; none where it has no colors yet.
    pub chroma: Option<ShField>,
    /// Field of the Gaussians that photos show.
    pub believed: ShField,
    pub exposures: Vec<Exposure>,
    pub teachers: Mutex<Teachers>,
    /// COLMAP folder, where one was named.
    colmap: Option<PathBuf>,
    _lock: RunLock,
}

impl PaintScene {
    /// Opens a run, by default the newest.
    ///
    /// # Errors
    /// [`RunError`], also where somebody paints on it already.
    pub fn open(
        run: Option<&Path>,
        colmap: Option<&Path>,
        observe: &mut Observer<'_>,
    ) -> Result<Self, RunError> {
        let viewed = ViewedScene::open_run(run, colmap, observe)?;
        let parts = viewed
            .folder()
            .zip(viewed.report())
            .zip(viewed.dataset.as_ref());
        let Some(((folder, report), dataset)) = parts else {
            return Err(StoreError::NoRun.into());
        };
        let (folder, report, dataset) = (folder.clone(), report.clone(), dataset.clone());
        files::make_folder(&folder.hints())?;
        let lock = RunLock::take(&folder.paint())?;
        let luma = read_scene(&folder.luma(), Frame::Own, observe)?
            .splats
            .to_luma();
        let teach = TeachOptions::of_run(&report);
        let cache = folder.teacher();
        let mut teachers = Teachers::open(&teach, &dataset.capture.root, Some(&cache))?;
        teachers.know(&dataset.capture);
        observe(Event::begins(Stage::Device));
        let gpu = Gpu::open()?;
        let of_run = report.chroma.is_some();
        Ok(Self {
            chroma: folder.read_chroma(luma.len())?.filter(|_| of_run),
            believed: believable(luma.len(), report.luma.surroundings),
            exposures: exposures(&dataset, &report.luma.exposures),
            raster: report.luma.settings.raster(&gpu),
            photos: photos(&dataset)?,
            dataset,
            teachers: Mutex::new(teachers),
            colmap: colmap.map(Path::to_owned),
            luma,
            viewed: Arc::new(viewed),
            folder,
            report,
            _lock: lock,
        })
    }

    /// Settings of the solver: the run's, or the usual ones where these are not of least squares.
    pub fn settings(&self) -> ChromaSettings {
        let chroma = self.report.chroma.as_ref();
        let own = chroma.map_or_else(ChromaSettings::irls, |chroma| chroma.settings.clone());
        match own.solver {
            SolverKind::Irls => own,
            SolverKind::Adam => ChromaSettings {
                sh_degree: own.sh_degree,
                ..ChromaSettings::irls()
            },
        }
    }

    /// Words of the command that colors the run, with the strokes in its folder if there are any.
    pub fn command(&self, choices: &Choices, painted: bool) -> Vec<String> {
        words(
            &self.folder,
            &self.report,
            self.colmap.as_deref(),
            choices,
            painted,
        )
    }

    /// The run's a and b as they would be with hints but without any: these are not made stronger.
    /// None where strokes are in them.
    pub fn unpainted(&self) -> Option<ShField> {
        let of_run = self.report.chroma.as_ref();
        let of_run = of_run.filter(|chroma| chroma.hints == 0)?;
        Some(scaled(self.chroma.clone()?, 1.0 / of_run.saturation))
    }

    /// Colors as `colorize` would have them: without strokes as strong as the teachers'.
    pub fn finished(&self, chroma: ShField, painted: bool) -> ShField {
        let of_run = self.report.chroma.as_ref().filter(|_| !painted);
        let factor = of_run.map_or(1.0, |chroma| chroma.saturation);
        scaled(chroma, factor)
    }

    /// The photo that a view shows, and where a place of the view lies in it upright, in shares of
    /// its sides.
    pub fn mark(&self, view: usize, place: [f32; 2]) -> Option<([f32; 2], usize)> {
        let photo = (self.photos.iter()).position(|photo| photo.views.contains(&view))?;
        let of_photo = &self.photos[photo];
        let seen = self.views(photo).swap_remove(view - of_photo.views.start);
        let upright = seen.view.stance.upright;
        let lying = upright.inverse().size(of_photo.size);
        let side = [seen.camera.width, seen.camera.height];
        let [x, y] = [0, 1].map(|k| place[k] * side[k] as f32);
        let far = places(&seen, lying)
            .into_iter()
            .map(|[u, v]| (u - x).hypot(v - y));
        let far = upright.turned(far.collect(), 1, lying);
        let (nearest, _) = (far.iter().enumerate()).min_by(|a, b| a.1.total_cmp(b.1))?;
        let [width, height] = of_photo.size.map(|side| side as usize);
        let pixel = [nearest % width, nearest / width];
        let share = |k: usize, side: usize| (pixel[k] as f32 + 0.5) / side as f32;
        Some(([share(0, width), share(1, height)], photo))
    }

    /// Views of a photo.
    pub fn views(&self, photo: usize) -> Vec<ViewOf<'_>> {
        let of = |i: usize| ViewOf {
            view: &self.dataset.capture.views[i],
            camera: &self.dataset.cameras[i],
            exposure: self.exposures[i],
            is_estimated: false,
        };
        self.photos[photo].views.clone().map(of).collect()
    }

    /// The strokes on a photo or a view, as `colorize` reads them from the run's folder.
    pub fn hint(&self, query: Query<'_>, gray: GrayImage<'_>) -> Result<HintImage, RunError> {
        let (width, height) = (gray.width, gray.height);
        let nothing = HintImage {
            width,
            height,
            paint: vec![[0.0; 3]; gray.pixels.len()],
        };
        let mut folder = match HintFolder::open(&self.folder.hints()) {
            Err(TeacherError::EmptyFolder { .. }) => return Ok(nothing),
            folder => folder?,
        };
        folder.know(&self.dataset.capture);
        let paint = folder.load(query, gray)?;
        Ok(paint.map_or(nothing, |paint| paint.resized(width, height)))
    }

    /// Lets `ask` ask the teachers.
    pub fn teachers<T>(&self, ask: impl FnOnce(&mut Teachers) -> T) -> T {
        ask(&mut self.teachers.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

fn scaled(mut chroma: ShField, factor: f64) -> ShField {
    (chroma.coefficients.iter_mut()).for_each(|value| *value *= factor as f32);
    chroma
}

/// The photos of a dataset, in the order of its views.
fn photos(dataset: &Dataset) -> Result<Vec<PaintedPhoto>, RunError> {
    let mut start = 0;
    let views = &dataset.capture.views;
    let photos = views.chunk_by(|a, b| a.photo == b.photo).map(|of_photo| {
        let range = start..start + of_photo.len();
        start = range.end;
        let first = &of_photo[0];
        let seen = ViewOf {
            view: first,
            camera: &dataset.cameras[range.start],
            exposure: Exposure::NONE,
            is_estimated: false,
        };
        let size = SceneDrawer::size(&[seen]).unwrap_or_default();
        // As a canvas has it: no larger than the photo.
        let (most, _) = dataset.loader().seen(first)?;
        let size = [size[0].min(most[0]), size[1].min(most[1])];
        Ok(PaintedPhoto {
            name: first.photo.clone(),
            views: range,
            of_file: first.stance.of_file(),
            size: first.stance.upright.size(size),
        })
    });
    photos.collect()
}
