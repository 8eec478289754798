//! Causes of large reprojection errors.

use glam::{DMat3, DVec3};

use super::{
    contradiction::Cause,
    photos::{ENOUGH, median},
    reprojection::{fits, project},
};
use crate::{
    capture::{Camera, Capture},
    effects::tracks::place_in,
};

/// From a camera that looks along z, y down, to one that looks along -z, y up.
const OPENGL: DMat3 = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));

/// By so much of a photo's side the principal point must be nearer to the middle for it to be
/// right rather than that of the observations.
const CLEARLY_NEARER: f64 = 0.05;

/// A scale so near to 1 is none.
const SAME_SCALE: f64 = 0.02;

impl Cause {
    /// Tries one after the other; `cameras` are those of the capture's views at working size.
    pub(super) fn find(capture: &Capture, cameras: &[Camera]) -> Self {
        let posed = |pose: fn(&Camera) -> Camera| {
            let mended: Vec<Camera> = (cameras.iter())
                // Poses as they are in the file.
                .map(|camera| pose(&camera.recentered(-capture.offset)).recentered(capture.offset))
                .collect();
            fits(capture, &mended, project)
        };
        if posed(inverted) {
            return Self::CameraToWorld;
        }
        if posed(turned_around) {
            return Self::OpenGl;
        }
        if posed(|camera| turned_around(&inverted(camera))) {
            return Self::CameraToWorldOpenGl;
        }
        Self::of_scale(capture, cameras).unwrap_or(Self::Unknown)
    }

    /// Cause if projections match the observations up to a scale and an offset along each axis, the
    /// same in all photos.
    fn of_scale(capture: &Capture, cameras: &[Camera]) -> Option<Self> {
        let mut pairs = [Vec::new(), Vec::new()];
        for point in &capture.points {
            for seen in &point.track {
                let camera = &cameras[seen.view];
                let at = place_in(camera, &capture.views[seen.view].camera, seen.pixel);
                if let Some(projected) = project(camera, point.position) {
                    let size = [camera.width, camera.height].map(f64::from);
                    for (axis, pairs) in pairs.iter_mut().enumerate() {
                        pairs.push([projected[axis], at[axis]].map(|along| along / size[axis]));
                    }
                }
            }
        }
        let [x, y] = [line(&pairs[0])?, line(&pairs[1])?];
        let moved = |camera: &Camera, pixel: [f64; 2]| {
            let [width, height] = [camera.width, camera.height].map(f64::from);
            [
                width * (x.scale * pixel[0] / width + x.offset),
                height * (y.scale * pixel[1] / height + y.offset),
            ]
        };
        let found = fits(capture, cameras, |camera, place| {
            Some(moved(camera, project(camera, place)?))
        });
        if !found {
            return None;
        }
        // Whichever has its principal point in the middle is right.
        let from_middle = |camera: &Camera, [x, y]: [f64; 2]| {
            let [width, height] = [camera.width, camera.height].map(f64::from);
            (x / width - 0.5).hypot(y / height - 0.5)
        };
        let of_cameras = cameras
            .iter()
            .map(|camera| from_middle(camera, [camera.cx, camera.cy]));
        let of_observations = cameras
            .iter()
            .map(|camera| from_middle(camera, moved(camera, [camera.cx, camera.cy])));
        let [cameras, observations] = [
            median(of_cameras.collect())?,
            median(of_observations.collect())?,
        ];
        let scale = (x.scale * y.scale).sqrt();
        Some(match cameras + CLEARLY_NEARER < observations {
            true => Self::Observations(scale),
            false if (scale - 1.0).abs() < SAME_SCALE => Self::PrincipalPoint,
            false => Self::Intrinsics(1.0 / scale),
        })
    }
}

/// A pose that was given as its inverse.
fn inverted(camera: &Camera) -> Camera {
    let rotation = camera.rotation.transpose();
    Camera {
        rotation,
        translation: -(rotation * camera.translation),
        ..camera.clone()
    }
}

/// A pose whose camera looks the other way, upside down.
fn turned_around(camera: &Camera) -> Camera {
    Camera {
        rotation: OPENGL * camera.rotation,
        translation: OPENGL * camera.translation,
        ..camera.clone()
    }
}

/// Linear map between coordinates.
struct Line {
    scale: f64,
    offset: f64,
}

/// The line through pairs of coordinates, by medians: a few wrong pairs do not move it. `None`
/// where there are too few, or nearly all are the same.
fn line(pairs: &[[f64; 2]]) -> Option<Line> {
    if pairs.len() < ENOUGH {
        return None;
    }
    let middle = |of: &dyn Fn(&[f64; 2]) -> f64| median(pairs.iter().map(of).collect());
    let centers = [middle(&|pair| pair[0])?, middle(&|pair| pair[1])?];
    let spread = |k: usize| middle(&|pair| (pair[k] - centers[k]).abs());
    let scale = spread(1)? / spread(0)?;
    let offset = middle(&|pair| pair[1] - scale * pair[0])?;
    (scale.is_finite() && scale > 0.0).then_some(Line { scale, offset })
}
