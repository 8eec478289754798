//! Reprojection errors of points.

use glam::DVec3;

use super::{
    contradiction::{Cause, Contradiction, Contradictory, distance},
    photos::{ENOUGH, photos},
};
use crate::{
    capture::{Camera, Capture, Rejected},
    effects::tracks::place_in,
};

/// Share of a photo's longer side that the median error may be: COLMAP drops observations that
/// are off by 4 pixels of the photos it saw, and one part in a hundred of photos of 400. What is
/// off by a hundredth blurs all that is smaller.
const SHARE: f64 = 0.01;

/// In small photos it may be so many pixels.
const PIXELS: f64 = 2.0;

/// The reprojection errors of a capture.
#[derive(Clone, Debug, PartialEq)]
pub struct Reprojection {
    /// The median over all observations in pixels at working size; infinite where most points
    /// are behind the cameras that saw them.
    pub error: f64,
    /// By photo.
    photos: Vec<(String, Median)>,
    all: Median,
}

/// The error in the middle of several.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Median {
    /// Observations.
    count: usize,
    error: Error,
}

/// Reprojection error of one observation; infinite if the point is behind the camera.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Error {
    pixels: f64,
    /// By what is tolerated in its photo.
    relative: f64,
}

impl Median {
    fn of(mut errors: Vec<Error>) -> Option<Self> {
        let count = errors.len();
        let by_size = |a: &Error, b: &Error| a.relative.total_cmp(&b.relative);
        let middle = count / 2;
        (count > 0).then(|| Self {
            count,
            error: *errors.select_nth_unstable_by(middle, by_size).1,
        })
    }

    /// Returns true if there are enough, and the median error is too large.
    fn is_off(&self) -> bool {
        self.count >= ENOUGH && self.error.relative > 1.0
    }
}

/// Projects a place in front of a camera to a pixel, inside its photo or not.
pub(super) fn project(camera: &Camera, place: DVec3) -> Option<[f64; 2]> {
    let at = camera.rotation * place + camera.translation;
    (at.z > 0.0).then(|| {
        [
            camera.fx * at.x / at.z + camera.cx,
            camera.fy * at.y / at.z + camera.cy,
        ]
    })
}

/// Moves every observation to where its point projects; drops those outside the photos.
pub fn observe_where_projected(capture: &mut Capture) {
    for point in &mut capture.points {
        point.track.retain_mut(|seen| {
            let pixel = capture.views[seen.view].camera.pixel_of(point.position);
            seen.pixel = pixel.unwrap_or(seen.pixel);
            pixel.is_some()
        });
    }
}

/// Distance of an observation from its point's projection.
fn error(camera: &Camera, seen: [f64; 2], projected: Option<[f64; 2]>) -> Error {
    let tolerated = (SHARE * f64::from(camera.width.max(camera.height))).max(PIXELS);
    let pixels = projected.map_or(f64::INFINITY, |[x, y]| (x - seen[0]).hypot(y - seen[1]));
    Error {
        pixels,
        relative: pixels / tolerated,
    }
}

impl Reprojection {
    /// Projects every point that was seen; `cameras` are those of the capture's views at
    /// working size. `None` where the model has no observations.
    pub fn of(capture: &Capture, cameras: &[Camera]) -> Option<Self> {
        let (names, photo_of) = photos(capture);
        let mut by_photo = vec![Vec::new(); names.len()];
        let mut all = Vec::new();
        for point in &capture.points {
            for seen in &point.track {
                let camera = &cameras[seen.view];
                let at = place_in(camera, &capture.views[seen.view].camera, seen.pixel);
                let error = error(camera, at, project(camera, point.position));
                by_photo[photo_of[seen.view]].push(error);
                all.push(error);
            }
        }
        let all = Median::of(all)?;
        let medians = names.iter().zip(by_photo);
        Some(Self {
            error: all.error.pixels,
            photos: medians
                .filter_map(|(name, errors)| Some(((*name).to_owned(), Median::of(errors)?)))
                .collect(),
            all,
        })
    }

    /// Contradiction in the model, if any; `capture` and `cameras` are those it was made of.
    pub fn contradictory(&self, capture: &Capture, cameras: &[Camera]) -> Option<Contradictory> {
        if self.all.is_off() {
            return Some(Contradictory::All(Contradiction::Model {
                root: capture.root.clone(),
                error: self.error,
                cause: Cause::find(capture, cameras),
            }));
        }
        let off = self.photos.iter().filter(|(_, median)| median.is_off());
        let photos: Vec<Rejected> = off
            .map(|(name, median)| Rejected {
                name: name.clone(),
                reason: format!(
                    "its pose contradicts the points: {}",
                    distance(median.error.pixels)
                ),
            })
            .collect();
        (!photos.is_empty()).then_some(Contradictory::Some(photos))
    }
}

/// Returns true if points project to their observations under `projected`.
pub(super) fn fits(
    capture: &Capture,
    cameras: &[Camera],
    projected: impl Fn(&Camera, DVec3) -> Option<[f64; 2]>,
) -> bool {
    let errors = capture.points.iter().flat_map(|point| {
        let projected = &projected;
        point.track.iter().map(move |seen| {
            let camera = &cameras[seen.view];
            let seen_at = place_in(camera, &capture.views[seen.view].camera, seen.pixel);
            error(camera, seen_at, projected(camera, point.position))
        })
    });
    Median::of(errors.collect()).is_some_and(|median| !median.is_off())
}
