//! Loss of a splat file's format: the file is read back and compared with what was written.

use std::{path::Path, sync::Arc};

use glam::DVec3;
use serde::Serialize;

use super::RunError;
use crate::{
    capture::{Camera, Capture, split},
    gpu::{Gpu, GpuError},
    measure,
    raster::{Raster, RasterOptions, RenderedImage, SceneRenderer},
    report::CaptureReport,
    splats::{Format, Splats, WriteOptions, read_splats},
    tell::{Event, Observer, Stage},
    trajectory::{ball_of_splats, lens, orbit_of_ball},
};

/// Views that are drawn; an even choice.
const VIEWS: usize = 8;

/// Longer side of the pictures, in pixels: what is lost shows in small ones as well.
const SIDE: u32 = 480;

/// The share of the Gaussians within the ball that made-up cameras look at; those beyond are
/// background.
const WITHIN: f64 = 0.8;

/// Vertical field of view of made-up cameras, in degrees.
const FIELD_OF_VIEW: f64 = 50.0;

/// Loss of a format.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Loss {
    /// Peak signal-to-noise ratio of the pictures, against those of what was written, in dB;
    /// none where nothing was measured.
    pub psnr: Option<f64>,
    /// Their mean ΔE00.
    pub delta_e: Option<f64>,
    /// Views that were drawn.
    pub views: usize,
    /// Kind of the views: `held-out views`, `views` if none is held out, `made-up views` of a file;
    /// or the reason that nothing was measured.
    pub measured: String,
}

/// Cameras to render scenes from.
pub(super) enum Views {
    /// These, and what they are; with the capture's extent, in world units.
    Of(Vec<Camera>, &'static str, f64),
    /// No cameras are known.
    MadeUp,
}

impl Views {
    /// Those of a run: held-out ones if there are any. Made-up ones where its COLMAP folder is
    /// gone.
    pub fn of_run(report: &CaptureReport) -> Self {
        let Ok(capture) = Capture::load_with(Path::new(&report.path), &report.load) else {
            return Self::MadeUp;
        };
        let split = split(&capture.views, report.load.holdout);
        let (chosen, what) = match split.test.is_empty() {
            false => (split.test, "held-out views"),
            true => (split.train, "views"),
        };
        let step = chosen.len().div_ceil(VIEWS).max(1);
        let cameras = (chosen.iter().step_by(step))
            .map(|&view| shrunk(&capture.views[view].camera))
            .collect();
        Self::Of(cameras, what, capture.extent())
    }
}

/// Reads a file back and measures what its format has made of `splats`.
///
/// # Errors
/// [`RunError`] where the file cannot be read. A device that is missing or refuses is none.
pub(super) fn loss(
    splats: &Splats,
    drawn: RasterOptions,
    views: &Views,
    (path, written): (&Path, &WriteOptions),
    observe: &mut Observer<'_>,
) -> Result<Loss, RunError> {
    let none = |measured: &str| Loss {
        psnr: None,
        delta_e: None,
        views: 0,
        measured: measured.to_owned(),
    };
    match Format::of(path) {
        Some(Format::Ply) if written.added == DVec3::ZERO => return Ok(none("nothing is lost")),
        Some(format) if !format.is_read() => {
            return Ok(none("not measured: floats, not read back"));
        }
        _ => {}
    }
    let mut read = read_splats(path)?;
    for mean in &mut read.splats.means {
        *mean = (DVec3::from(mean.map(f64::from)) - written.added)
            .as_vec3()
            .to_array();
    }
    let made_up;
    let (cameras, what, extent) = match views {
        Views::Of(cameras, what, extent) => (cameras, *what, *extent),
        Views::MadeUp => {
            let (cameras, radius) = around(splats);
            made_up = cameras;
            (&made_up, "made-up views", radius)
        }
    };
    observe(Event::begins(Stage::Device));
    let back = RasterOptions {
        antialiased: read.antialiased,
        ..RasterOptions::default()
    };
    let scenes = [(splats, drawn), (&read.splats, back)];
    let found = compared(cameras, scenes, extent, observe);
    Ok(match found {
        Ok((psnr, delta_e)) => Loss {
            psnr: Some(psnr),
            delta_e: Some(delta_e),
            views: cameras.len(),
            measured: what.to_owned(),
        },
        Err(error) => none(&format!("not measured: {error}")),
    })
}

/// PSNR and mean ΔE00 of the second scene's pictures against the first's.
fn compared(
    cameras: &[Camera],
    scenes: [(&Splats, RasterOptions); 2],
    extent: f64,
    observe: &mut Observer<'_>,
) -> Result<(f64, f64), GpuError> {
    let gpu = Gpu::open()?;
    let [wrote, read] = scenes.map(|(splats, drawn)| {
        let raster = Arc::new(Raster::with(&gpu, drawn));
        SceneRenderer::of(&raster, splats, &[&splats.sh], extent)
    });
    let (mut wrote, mut read) = (wrote?, read?);
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    for (done, camera) in cameras.iter().enumerate() {
        observe(Event::progress(Stage::Measuring, done, cameras.len(), ""));
        let shown = |pictures: Vec<RenderedImage>| pictures[0].shown();
        ours.extend(shown(wrote.render(camera)?));
        theirs.extend(shown(read.render(camera)?));
    }
    let psnr = measure::reported_psnr(theirs.as_flattened(), ours.as_flattened());
    Ok((psnr, measure::mean_delta_e(&theirs, &ours).mean))
}

fn shrunk(camera: &Camera) -> Camera {
    let share = f64::from(SIDE) / f64::from(camera.width.max(camera.height));
    let side = |side: u32| ((f64::from(side) * share.min(1.0)).round() as u32).max(1);
    camera.resized(side(camera.width), side(camera.height))
}

/// Cameras around Gaussians with y down, and the radius of the ball that fills their pictures.
fn around(splats: &Splats) -> (Vec<Camera>, f64) {
    let ball = ball_of_splats(splats, WITHIN);
    let lens = lens([SIDE, SIDE * 3 / 4], FIELD_OF_VIEW);
    (orbit_of_ball(ball, &lens, VIEWS), ball.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_no_larger_than_their_cameras() {
        let large = lens([4000, 3000], 50.0);
        assert_eq!((shrunk(&large).width, shrunk(&large).height), (480, 360));
        let small = lens([64, 48], 50.0);
        assert_eq!(shrunk(&small), small);
    }
}
