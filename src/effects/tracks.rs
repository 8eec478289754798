//! What the photos show at COLMAP's points: the same place of the scene, seen by
//! several views.

use glam::DVec3;

use crate::capture::{Camera, Capture, Photo, Point};

/// Gray at which a sensor may have stopped counting, from below and from above: such
/// values say only that the scene is at least so dark or bright.
const CLIPPED: [f64; 2] = [2.0 / 255.0, 253.0 / 255.0];

/// Side, in pixels of the coarsest view that sees a point, of the square over which a
/// view's luma is averaged: points are where luma has an extremum, and views that
/// resolve it differently would seem to differ in exposure.
const FOOTPRINT: f64 = 2.0;

/// What one view shows of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Index of the view.
    pub view: usize,
    /// Encoded gray, or another channel brought to [0, 1].
    pub value: f64,
    /// Unit vector from the view's camera to the point.
    pub direction: DVec3,
}

/// Samples of each point that at least two views show, neither clipped nor masked.
///
/// `photos` are those of the capture's views at working size.
pub fn sample_tracks(capture: &Capture, photos: &[(Photo, Camera)]) -> Vec<Vec<Sample>> {
    (capture.points.iter())
        .map(|point| {
            let coarsest = (point.track.iter())
                .map(|seen| sampling_rate(&photos[seen.view].1, point))
                .fold(f64::INFINITY, f64::min);
            (point.track.iter())
                .filter_map(|seen| {
                    let (photo, camera) = &photos[seen.view];
                    let at = place_in(camera, &capture.views[seen.view].camera, seen.pixel);
                    let side = FOOTPRINT * sampling_rate(camera, point) / coarsest;
                    let luma = mean_around(photo, at, side)?;
                    let direction = (point.position - camera.center()).try_normalize()?;
                    (luma > CLIPPED[0] && luma < CLIPPED[1]).then_some(Sample {
                        view: seen.view,
                        value: luma,
                        direction,
                    })
                })
                .collect::<Vec<Sample>>()
        })
        .filter(|samples| samples.len() >= 2)
        .collect()
}

/// A pixel of the model's camera in that of the photo at working size.
pub(super) fn place_in(camera: &Camera, of_model: &Camera, [x, y]: [f64; 2]) -> [f64; 2] {
    [
        x * f64::from(camera.width) / f64::from(of_model.width),
        y * f64::from(camera.height) / f64::from(of_model.height),
    ]
}

/// Pixels on one world unit at a point; at least a little, wherever it lies.
fn sampling_rate(camera: &Camera, point: &Point) -> f64 {
    let distance = (point.position - camera.center()).length();
    (camera.fx * camera.fy).sqrt() / distance.max(f64::MIN_POSITIVE)
}

/// The mean gray of a photo, in [0, 1], over a square around a place in pixels; `None` where
/// the square leaves the photo or meets a masked pixel.
pub(super) fn mean_around(photo: &Photo, at: [f64; 2], side: f64) -> Option<f64> {
    let [left, top] = at.map(|along| along - 0.5 * side);
    let [right, bottom] = at.map(|along| along + 0.5 * side);
    let inside = left >= 0.0
        && top >= 0.0
        && right <= f64::from(photo.width)
        && bottom <= f64::from(photo.height);
    if !inside {
        return None;
    }
    // How much of a pixel's side lies between two places.
    let within = |pixel: usize, from: f64, to: f64| {
        let pixel = pixel as f64;
        (to.min(pixel + 1.0) - from.max(pixel)).max(0.0)
    };
    let mut sum = 0.0;
    for y in top as usize..bottom.ceil() as usize {
        for x in left as usize..right.ceil() as usize {
            let pixel = y * photo.width as usize + x;
            if photo.mask.as_ref().is_some_and(|mask| mask[pixel] < 255) {
                return None;
            }
            let area = within(x, left, right) * within(y, top, bottom);
            sum += area * f64::from(photo.gray[pixel]) / 255.0;
        }
    }
    Some(sum / (side * side))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn photo() -> Photo {
        Photo {
            width: 3,
            height: 2,
            gray: vec![0, 51, 102, 153, 204, 255],
            rgb: None,
            mask: None,
        }
    }

    #[test]
    fn means_cover_parts_of_pixels() {
        let photo = photo();
        let close = |a: Option<f64>, b: f64| (a.unwrap() - b).abs() < 1e-12;
        assert!(close(mean_around(&photo, [1.5, 0.5], 1.0), 0.2));
        assert!(close(mean_around(&photo, [1.0, 1.0], 2.0), 0.4));
        assert!(close(mean_around(&photo, [2.0, 1.0], 1.0), 0.6));
        // A quarter of each.
        assert!(close(mean_around(&photo, [1.0, 0.5], 1.0), 0.1));
        assert!(close(mean_around(&photo, [2.75, 1.75], 0.5), 1.0));
        assert_eq!(mean_around(&photo, [0.4, 1.0], 1.0), None);
        assert_eq!(mean_around(&photo, [1.5, 1.6], 1.0), None);
    }

    #[test]
    fn a_masked_neighbour_says_nothing() {
        let mut photo = photo();
        photo.mask = Some(vec![255, 255, 0, 255, 255, 255]);
        assert_eq!(mean_around(&photo, [2.2, 1.0], 1.0), None);
        assert!(mean_around(&photo, [1.2, 1.0], 1.0).is_some());
    }
}
