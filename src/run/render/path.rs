//! Pictures along a path, as files or as a film.

use std::{path::PathBuf, sync::Arc};

use glam::DVec3;
use image::{GenericImage, RgbImage};

use super::Subject;
use crate::{
    capture::{Camera, Loader, split},
    gpu::Gpu,
    raster::{Raster, SceneRenderer},
    report::to_image,
    run::RunError,
    store::{
        StoreError, files,
        film::{FRAME_RATE, FilmWriter, Purpose},
    },
    subject::SubjectError,
    tell::{Event, Observer, Stage},
    trajectory::{
        Coordinates, MOST_FRAMES, TrajectoryError, ball_of_splats, camera_path, framed, lens,
        orbit_of_ball, orbit_of_cameras, read_path, write_path,
    },
};

/// Size of pictures where neither cameras nor the user say one.
const SIZE: [u32; 2] = [1280, 720];

/// Vertical field of view where no camera says one, in degrees.
const FIELD_OF_VIEW: f64 = 50.0;

/// Default duration of a path, in seconds.
const SECONDS: f64 = 10.0;

/// Shape of a camera path.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PathShape {
    /// Around what the cameras look at, or around a splat file's Gaussians.
    Orbit,
    /// Through the photographed viewpoints.
    Photos,
    /// As a file says.
    File(PathBuf),
}

/// Options of `render --path`.
#[derive(Clone, Debug)]
pub struct PathOptions {
    /// Run folder or splat file; the newest run by default.
    pub run: Option<PathBuf>,
    /// COLMAP folder, where it is not the one that `fit` noted.
    pub colmap: Option<PathBuf>,
    pub way: PathShape,
    /// Duration, in seconds, above 0; 10 by default. A file has its own.
    pub seconds: Option<f64>,
    /// Frames a second, as a fraction; the file's by default, or 24.
    pub rate: Option<[u32; 2]>,
    /// Width and height of a picture in pixels; the file's or the photos' by default.
    pub size: Option<[u32; 2]>,
    /// Draw the luma although the scene is colored.
    pub luma: bool,
    /// Draw the luma left of the colors.
    pub side_by_side: bool,
    /// Folder for the pictures.
    pub output: Option<PathBuf>,
    /// Film to write, by FFmpeg.
    pub video: Option<PathBuf>,
    /// File to write the path to.
    pub save_path: Option<PathBuf>,
}

/// Result of `render --path`.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendered {
    /// Pictures of the path.
    pub frames: usize,
    /// Width and height of a picture in pixels.
    pub size: [u32; 2],
    /// Frames a second.
    pub rate: f64,
}

/// Draws a scene along a path.
pub fn render_path(
    options: &PathOptions,
    observe: &mut Observer<'_>,
) -> Result<Rendered, RunError> {
    let colmap = options.colmap.as_deref();
    let subject = Subject::open(options.run.as_deref(), colmap, options.luma, observe)?;
    let gray = options
        .side_by_side
        .then(|| subject.gray(observe))
        .transpose()?;
    let path = Path::of(options, &subject)?;
    let rate = f64::from(path.rate[0]) / f64::from(path.rate[1]);
    if let Some(file) = &options.save_path {
        files::make_folder_of(file)?;
        let back = |camera: &Camera| camera.recentered(-subject.scene.offset);
        let world: Vec<Camera> = path.cameras.iter().map(back).collect();
        write_path(file, &world, rate)?;
    }
    let mut out = PathOutput::open(options, path.rate)?;
    observe(Event::begins(Stage::Device));
    let gpu = Gpu::open()?;
    subject.tell_unlike(&gpu, observe)?;
    let raster = Arc::new(Raster::with(&gpu, subject.scene.drawn));
    let scenes = gray.iter().chain([&subject.scene.splats]);
    let renderers =
        scenes.map(|splats| SceneRenderer::of(&raster, splats, &[&splats.sh], path.extent));
    let mut renderers = renderers.collect::<Result<Vec<_>, _>>()?;
    let total = path.cameras.len();
    let mut size = [0; 2];
    for (done, camera) in path.cameras.iter().enumerate() {
        observe(Event::progress(Stage::Rendering, done, total, ""));
        let drawn = renderers.iter_mut().map(|renderer| {
            let picture = renderer.render(camera)?.remove(0);
            Ok::<_, RunError>(to_image(picture.width, picture.height, &picture.shown()))
        });
        let picture = beside(drawn.collect::<Result<Vec<_>, _>>()?);
        size = [picture.width(), picture.height()];
        out.write(&format!("frame-{done:04}.png"), &picture)?;
    }
    out.finish(observe)?;
    observe(Event::progress(Stage::Rendering, total, total, ""));
    Ok(Rendered {
        frames: total,
        size,
        rate,
    })
}

/// A path in the coordinates of a scene.
struct Path {
    cameras: Vec<Camera>,
    rate: [u32; 2],
    /// The size of the scene, in world units.
    extent: f64,
}

impl Path {
    fn of(options: &PathOptions, subject: &Subject) -> Result<Self, RunError> {
        let frames = |rate: [u32; 2]| {
            let seconds = options.seconds.unwrap_or(SECONDS);
            let frames = (seconds * f64::from(rate[0]) / f64::from(rate[1])).round();
            match frames <= MOST_FRAMES as f64 {
                true => Ok((frames as usize).max(1)),
                false => Err(TrajectoryError::Long { frames }),
            }
        };
        let ball = || ball_of_splats(&subject.scene.splats, 0.5);
        let extent = match &subject.capture {
            Some(capture) => capture.extent(),
            None => ball().1,
        };
        let rate = options.rate.unwrap_or(FRAME_RATE);
        let (cameras, rate) = match (&options.way, &subject.capture) {
            (PathShape::File(file), _) => {
                let read = read_path(file, options.size.unwrap_or(SIZE))?;
                let from = match read.coordinates {
                    Coordinates::Colmap => subject.scene.offset,
                    Coordinates::SplatFile => DVec3::ZERO,
                };
                let cameras = read.cameras.iter().map(|camera| camera.recentered(from));
                let rate = options.rate.or(read.rate.map(fraction)).unwrap_or(rate);
                (cameras.collect(), rate)
            }
            (PathShape::Orbit, None) => {
                let lens = lens(options.size.unwrap_or(SIZE), FIELD_OF_VIEW);
                (orbit_of_ball(ball(), &lens, frames(rate)?), rate)
            }
            (PathShape::Photos, None) => {
                return Err(SubjectError::NoCameras(subject.scene.file.clone()).into());
            }
            (way, Some(capture)) => {
                let loader = Loader::new(subject.opened.load());
                let train = split(&capture.views, subject.opened.load().holdout).train;
                let cameras = train.iter().map(|&i| loader.camera(&capture.views[i]));
                let cameras: Vec<Camera> = cameras.collect::<Result<_, _>>()?;
                let cameras: Vec<&Camera> = cameras.iter().collect();
                let path = match way {
                    PathShape::Orbit => {
                        let points = capture.points.iter().map(|point| point.position);
                        let points: Vec<DVec3> = points.collect();
                        orbit_of_cameras(&cameras, &points, frames(rate)?)
                    }
                    _ => camera_path(&cameras, capture.extent(), frames(rate)?),
                };
                (path, rate)
            }
        };
        let cameras: Vec<Camera> = cameras;
        // Films have no odd sides, and all their frames one size.
        let size = options.size.unwrap_or_else(|| {
            let first = &cameras[0];
            [first.width, first.height].map(|side| (side + side % 2).max(2))
        });
        let cameras = cameras.iter().map(|camera| framed(camera, size));
        Ok(Self {
            cameras: cameras.collect(),
            rate,
            extent,
        })
    }
}

/// A rate as a fraction, to the thousandth.
fn fraction(rate: f64) -> [u32; 2] {
    match rate.fract() == 0.0 {
        true => [rate.max(1.0) as u32, 1],
        false => [(1000.0 * rate).round().max(1.0) as u32, 1000],
    }
}

/// Pictures of one height side by side.
fn beside(pictures: Vec<RgbImage>) -> RgbImage {
    let width = pictures.iter().map(RgbImage::width).sum();
    let height = pictures.iter().map(RgbImage::height).max().unwrap_or(0);
    let mut all = RgbImage::new(width, height);
    let mut left = 0;
    for picture in &pictures {
        // Both sides are the sums of what is put there.
        let _ = all.copy_from(picture, left, 0);
        left += picture.width();
    }
    all
}

/// Outputs of the rendered images: a folder, a film or both.
struct PathOutput {
    folder: Option<PathBuf>,
    film: Option<FilmWriter>,
}

impl PathOutput {
    fn open(options: &PathOptions, rate: [u32; 2]) -> Result<Self, StoreError> {
        if let Some(folder) = &options.output {
            files::make_pictures_folder(folder)?;
        }
        let film = options.video.as_ref().map(|video| {
            files::make_folder_of(video)?;
            Ok::<_, StoreError>(FilmWriter::new(video, rate, Purpose::Viewing)?)
        });
        Ok(Self {
            folder: options.output.clone(),
            film: film.transpose()?,
        })
    }

    fn write(&mut self, name: &str, picture: &RgbImage) -> Result<(), StoreError> {
        if let Some(folder) = &self.folder {
            files::write_png(&folder.join(name), picture)?;
        }
        match &mut self.film {
            Some(film) => film.write(name, picture),
            None => Ok(()),
        }
    }

    fn finish(self, observe: &mut Observer<'_>) -> Result<(), StoreError> {
        self.film.map_or(Ok(()), |film| film.finish(observe))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_are_fractions() {
        assert_eq!(fraction(24.0), [24, 1]);
        assert_eq!(fraction(29.97), [29970, 1000]);
        assert_eq!(fraction(0.5), [500, 1000]);
    }

    #[test]
    fn pictures_stand_side_by_side() {
        let plain = |value| RgbImage::from_pixel(3, 2, image::Rgb([value; 3]));
        let both = beside(vec![plain(10), plain(200)]);
        assert_eq!(both.dimensions(), (6, 2));
        assert_eq!(
            (both.get_pixel(2, 1).0, both.get_pixel(3, 0).0),
            ([10; 3], [200; 3])
        );
    }
}
