//! `render`: pictures from the photographed viewpoints, and along a path.

mod path;
mod subject;

use std::{path::PathBuf, sync::Arc};

pub use path::{PathOptions, Rendered, Way, render_path};
use subject::Subject;

use super::{Event, Observer, RunError, Stage, files, foreign::tell_unlike, picture_names, scene};
use crate::{
    capture::{LoadOptions, Loader, Normalize, split},
    gpu::Gpu,
    raster::{Raster, SceneRenderer},
    report::to_image,
};

/// Longer side in pixels at which a splat file is compared with the photos.
const CHECKED_SIDE: u32 = 640;

/// Which of a capture's views.
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

/// What `render` is asked to do.
#[derive(Clone, Debug)]
pub struct RenderOptions {
    /// Run folder or splat file; the newest run by default.
    pub run: Option<PathBuf>,
    /// COLMAP folder, where it is not the one that `fit` noted.
    pub colmap: Option<PathBuf>,
    /// Which views; those held out by default, or all where none is.
    pub views: Option<Views>,
    /// Draw the luma although the scene is colored.
    pub luma: bool,
    /// Folder for the pictures.
    pub output: PathBuf,
}

/// Draws the scene and gives the number of pictures.
///
/// # Errors
/// [`RunError`].
pub fn render(options: &RenderOptions, observe: &mut Observer<'_>) -> Result<usize, RunError> {
    let colmap = options.colmap.as_deref();
    let subject = Subject::open(options.run.as_deref(), colmap, options.luma, observe)?;
    let capture = subject.cameras()?;
    let split = split(&capture.views, subject.load.holdout);
    let loader = Loader::new(subject.load.clone());
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
    let raster = Arc::new(Raster::with(&gpu, subject.drawn));
    let splats = &subject.splats;
    let mut renderer = SceneRenderer::of(&raster, splats, &[&splats.sh], capture.extent())?;
    for (done, &i) in chosen.iter().enumerate() {
        let view = &capture.views[i];
        observe(Event::Progress {
            stage: Stage::Rendering,
            done,
            total: chosen.len(),
            message: view.name.clone(),
        });
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

impl Subject {
    /// Warns where a splat file of others does not show what the photos show.
    fn tell_unlike(&self, gpu: &Gpu, observe: &mut Observer<'_>) -> Result<(), RunError> {
        let (true, Some(capture)) = (self.foreign, &self.capture) else {
            return Ok(());
        };
        let load = LoadOptions {
            max_side: Some(CHECKED_SIDE),
            normalize: Normalize::Off,
            ..LoadOptions::default()
        };
        // Pictures do not depend on what photos show: where they cannot be compared, they are not.
        if let Ok(dataset) = scene::open(&capture.root, &load, &mut |_| {}) {
            let luma = self.splats.to_luma();
            tell_unlike(gpu, &dataset, (&self.file, &luma), self.drawn, observe)?;
        }
        Ok(())
    }
}
