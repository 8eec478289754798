//! `render`: pictures from the photographed viewpoints.

use std::{path::PathBuf, sync::Arc};

use super::{
    Event, Observer, RunError, RunFolder, Stage, files,
    foreign::tell_unlike,
    picture_names,
    scene::{Frame, open, read_splats},
};
use crate::{
    capture::{Capture, LoadOptions, Loader, Normalize, split},
    gpu::Gpu,
    raster::{Raster, Renderer},
    report::to_image,
    splats::is_splat_file,
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
    /// All.
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
    let (file, colmap, load, run) = match &options.run {
        Some(path) if is_splat_file(path)? => {
            let colmap = options
                .colmap
                .clone()
                .ok_or_else(|| RunError::NoCameras(path.clone()))?;
            (path.clone(), colmap, LoadOptions::default(), None)
        }
        run => {
            let folder = match run {
                Some(path) => RunFolder::at(path),
                None => RunFolder::newest()?,
            };
            let report = folder.read_report()?;
            let (capture, drawn) = (report.capture, report.luma.settings.raster_options());
            let colored = !options.luma && folder.color().exists();
            let file = if colored {
                folder.color()
            } else {
                folder.luma()
            };
            let noted = PathBuf::from(&capture.path);
            let colmap = options.colmap.clone().unwrap_or(noted);
            (file, colmap, capture.load, Some(drawn))
        }
    };
    observe(Event::begins(Stage::Model));
    let capture = Capture::load_with(&colmap, &load.capture())?;
    let frame = match run {
        Some(_) => Frame::Own,
        None => Frame::World(capture.offset),
    };
    let (splats, drawn) = read_splats(&file, frame, observe)?;
    let splats = if options.luma {
        splats.to_luma()
    } else {
        splats
    };
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
    files::make_folder(&options.output)?;
    let names = picture_names(&capture.views);
    observe(Event::begins(Stage::Device));
    let gpu = Gpu::open()?;
    if run.is_none() {
        let load = LoadOptions {
            max_side: Some(CHECKED_SIDE),
            normalize: Normalize::Off,
            ..LoadOptions::default()
        };
        // Pictures do not depend on what photos show: where they cannot be compared, they are not.
        if let Ok(dataset) = open(&colmap, &load, &mut |_| {}) {
            tell_unlike(&gpu, &dataset, (&file, &splats.to_luma()), drawn, observe)?;
        }
    }
    let raster = Arc::new(Raster::with(&gpu, run.unwrap_or(drawn)));
    let mut renderer = Renderer::of(&raster, &splats, &[&splats.sh], capture.extent())?;
    for (done, &i) in chosen.iter().enumerate() {
        let view = &capture.views[i];
        observe(Event::Progress {
            stage: Stage::Rendering,
            done,
            total: chosen.len(),
            message: view.name.clone(),
        });
        // The photo decides the size, which the model's camera may miss by a pixel.
        let camera = loader.camera(view)?;
        let picture = renderer.render(&camera)?.remove(0);
        let path = options.output.join(&names[i]);
        if let Some(folder) = path.parent() {
            files::make_folder(folder)?;
        }
        files::write_png(
            &path,
            &to_image(picture.width, picture.height, &picture.shown()),
        )?;
    }
    Ok(chosen.len())
}
