//! `render`: pictures from the photographed viewpoints, and along a path.

mod path;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

pub use path::{PathOptions, PathShape, Rendered, render_path};

use super::RunError;
use crate::{
    capture::{Capture, LoadOptions, Loader, Normalize, split},
    disk::trust::Originals,
    gpu::Gpu,
    raster::{Raster, SceneRenderer},
    report::to_image,
    splats::Splats,
    store::{files, originals::OriginalFiles, picture_names},
    subject::{LockMode, Opened, Scene, SubjectError, foreign::tell_unlike, scene},
    tell::{Event, Observer, Stage},
};

/// Longer side in pixels at which a splat file is compared with the photos.
const CHECKED_SIDE: u32 = 640;

/// Half an 8-bit step: what no viewer shows as a color.
const NO_COLOR: f32 = 0.5 / 255.0;

/// Some of a capture's views.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Views {
    /// Those trained on.
    Train,
    /// Those held out.
    Test,
    /// Views of training and held-out ones.
    All,
}

#[derive(Clone, Debug)]
pub struct RenderOptions {
    /// Run folder or splat file; the newest run by default.
    pub run: Option<PathBuf>,
    /// COLMAP folder, where it is not the one that `fit` noted.
    pub colmap: Option<PathBuf>,
    /// Views to render; held-out ones by default, or all if none is held out.
    pub views: Option<Views>,
    /// Draw the luma although the scene is colored.
    pub luma: bool,
    /// Folder for the pictures.
    pub output: PathBuf,
}

/// Draws the scene and gives the number of pictures.
pub fn render(options: &RenderOptions, observe: &mut Observer<'_>) -> Result<usize, RunError> {
    let colmap = options.colmap.as_deref();
    let subject = Subject::open(options.run.as_deref(), colmap, options.luma, observe)?;
    let capture = subject.cameras()?;
    let load = subject.opened.load();
    let split = split(&capture.views, load.holdout);
    let loader = Loader::new(load);
    let chosen: Vec<usize> = match options.views {
        Some(Views::Train) => split.train,
        Some(Views::Test) => split.test,
        None if !split.test.is_empty() => split.test,
        None | Some(Views::All) => (0..capture.views.len()).collect(),
    };
    if chosen.is_empty() {
        return Err(RunError::NoHeldOut);
    }
    files::make_pictures_folder(&options.output)?;
    let names = picture_names(&capture.views);
    observe(Event::begins(Stage::Device));
    let gpu = Gpu::open()?;
    subject.tell_unlike(&gpu, observe)?;
    let raster = Arc::new(Raster::with(&gpu, subject.scene.drawn));
    let splats = &subject.scene.splats;
    let mut renderer = SceneRenderer::of(&raster, splats, &[&splats.sh], capture.extent())?;
    for (done, &i) in chosen.iter().enumerate() {
        let view = &capture.views[i];
        observe(Event::progress(
            Stage::Rendering,
            done,
            chosen.len(),
            &view.name,
        ));
        // The photo decides the size, which the model's camera may miss by a pixel.
        let (camera, stance) = loader.standing(view)?;
        let picture = renderer.render(&camera)?.remove(0);
        let path = options.output.join(&names[i]);
        if let Some(folder) = path.parent() {
            files::make_folder(folder)?;
        }
        let image = to_image(picture.width, picture.height, &picture.shown());
        files::write_png(&path, &stance.upright.image(image.into()).into_rgb8())?;
    }
    Ok(chosen.len())
}

/// A scene that is drawn.
struct Subject {
    opened: Opened,
    /// Its Gaussians, with the colors that are wanted.
    scene: Scene,
    /// Cameras and points; none of a splat file without a COLMAP folder.
    capture: Option<Capture>,
    /// Files that are not written over.
    _kept: Originals,
}

impl Subject {
    /// Opens a run or a splat file, the newest run by default; without colors where `luma` is
    /// wanted.
    fn open(
        path: Option<&Path>,
        colmap: Option<&Path>,
        luma: bool,
        observe: &mut Observer<'_>,
    ) -> Result<Self, RunError> {
        let opened = Opened::find(path, LockMode::Free)?;
        observe(Event::begins(Stage::Model));
        let known = opened.run().is_some() || colmap.is_some();
        let capture = known.then(|| opened.capture(colmap)).transpose()?;
        let mut scene = opened.read(luma, capture.as_ref(), observe)?;
        if luma {
            scene.splats = scene.splats.to_luma();
        }
        if let Some(capture) = &capture {
            scene.offset = capture.offset;
        }
        let kept = OriginalFiles::default();
        let kept = colmap
            .iter()
            .fold(kept, |kept, dir| kept.with_capture(dir, None));
        Ok(Self {
            _kept: opened.keep(kept).keep(),
            opened,
            scene,
            capture,
        })
    }

    fn cameras(&self) -> Result<&Capture, SubjectError> {
        let none = || SubjectError::NoCameras(self.scene.file.clone());
        self.capture.as_ref().ok_or_else(none)
    }

    /// The same scene without colors.
    fn gray(&self, observe: &mut Observer<'_>) -> Result<Splats, SubjectError> {
        let splats = &self.scene.splats;
        match self.opened.run() {
            run if splats.is_gray(NO_COLOR) => {
                let path = run.map_or(&*self.scene.file, |run| run.folder.path());
                Err(SubjectError::NoColors(path.to_owned()))
            }
            Some(_) => Ok(self.opened.read(true, None, observe)?.splats.to_luma()),
            None => Ok(splats.to_luma()),
        }
    }

    /// Warns where a splat file of others does not show what the photos show.
    fn tell_unlike(&self, gpu: &Gpu, observe: &mut Observer<'_>) -> Result<(), RunError> {
        let (None, Some(capture)) = (self.opened.run(), &self.capture) else {
            return Ok(());
        };
        let load = LoadOptions {
            max_side: Some(CHECKED_SIDE),
            normalize: Normalize::Off,
            ..LoadOptions::default()
        };
        // Pictures do not depend on what photos show: where they cannot be compared, they are not.
        if let Ok(dataset) = scene::open(&capture.root, &load, &mut |_| {}) {
            let Scene {
                file,
                splats,
                drawn,
                ..
            } = &self.scene;
            tell_unlike(gpu, &dataset, (file, &splats.to_luma()), *drawn, observe)?;
        }
        Ok(())
    }
}
