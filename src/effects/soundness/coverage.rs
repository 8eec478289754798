//! Number of points visible in the photos, for models without observations.

use super::photos::photos;
use crate::capture::{Camera, Capture};

/// A photo that has fewer points before it hardly sees the scene.
pub const FEW_POINTS: usize = 10;

/// Photos that hardly see a point.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SparsePhotos {
    /// Their names.
    pub photos: Vec<String>,
    /// Photos in all.
    pub total: usize,
    /// True if some camera's principal point lies outside its photo. With points before the cameras
    /// it would be a crop's.
    pub center_outside: bool,
}

impl SparsePhotos {
    /// Projects the points into the views until each photo has seen enough; `None` where all
    /// have.
    pub fn of(capture: &Capture, cameras: &[Camera]) -> Option<Self> {
        let (names, photo_of) = photos(capture);
        let mut seen = vec![0; names.len()];
        for (camera, &photo) in cameras.iter().zip(&photo_of) {
            let before = |place| camera.pixel_of(place).is_some();
            let points = capture.points.iter();
            let visible = points.filter(|point| before(point.position));
            seen[photo] += visible
                .take(FEW_POINTS - seen[photo].min(FEW_POINTS))
                .count();
        }
        let few = names.iter().zip(&seen);
        let photos: Vec<String> = few
            .filter(|(_, seen)| **seen < FEW_POINTS.min(capture.points.len()))
            .map(|(name, _)| (*name).to_owned())
            .collect();
        (!photos.is_empty()).then(|| Self {
            center_outside: photos.len() == names.len() && cameras.iter().any(is_off_center),
            photos,
            total: names.len(),
        })
    }
}

/// Returns true if a camera's principal point lies outside its photo.
fn is_off_center(camera: &Camera) -> bool {
    let inside = |at: f64, side: u32| at > 0.0 && at < f64::from(side);
    !(inside(camera.cx, camera.width) && inside(camera.cy, camera.height))
}
