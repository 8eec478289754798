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
    let sums: Vec<Sums> = photos.iter().map(|(photo, _)| Sums::of(photo)).collect();
    (capture.points.iter())
        .map(|point| {
            let coarsest = (point.track.iter())
                .map(|seen| sampling_rate(&photos[seen.view].1, point))
                .fold(f64::INFINITY, f64::min);
            (point.track.iter())
                .filter_map(|seen| {
                    let camera = &photos[seen.view].1;
                    let at = place_in(camera, &capture.views[seen.view].camera, seen.pixel);
                    let side = FOOTPRINT * sampling_rate(camera, point) / coarsest;
                    let luma = sums[seen.view].mean(at, side)?;
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

/// A photo's gray and mask summed from the top left corner on, so that the mean over
/// any rectangle takes four look-ups (Crow 1984).
pub(super) struct Sums {
    width: usize,
    height: usize,
    /// Gray and what does not count, `[height + 1, width + 1]`.
    sums: Vec<[f64; 2]>,
}

impl Sums {
    /// Sums up a photo.
    pub fn of(photo: &Photo) -> Self {
        let [width, height] = [photo.width, photo.height].map(|side| side as usize);
        let columns = width + 1;
        let mut sums = vec![[0.0; 2]; columns * (height + 1)];
        for y in 0..height {
            let mut row = [0.0; 2];
            for x in 0..width {
                let pixel = y * width + x;
                let masked = photo.mask.as_ref().is_some_and(|mask| mask[pixel] < 255);
                row[0] += f64::from(photo.gray[pixel]) / 255.0;
                row[1] += f64::from(u8::from(masked));
                let above = sums[y * columns + x + 1];
                sums[(y + 1) * columns + x + 1] = [above[0] + row[0], above[1] + row[1]];
            }
        }
        Self {
            width,
            height,
            sums,
        }
    }

    /// The mean over a square around a place, in pixels; `None` where it leaves the
    /// photo or meets a masked pixel.
    pub fn mean(&self, at: [f64; 2], side: f64) -> Option<f64> {
        let [left, top] = at.map(|along| along - 0.5 * side);
        let [right, bottom] = at.map(|along| along + 0.5 * side);
        let inside =
            left >= 0.0 && top >= 0.0 && right <= self.width as f64 && bottom <= self.height as f64;
        if !inside {
            return None;
        }
        let corners = [
            self.up_to(right, bottom),
            self.up_to(left, bottom),
            self.up_to(right, top),
            self.up_to(left, top),
        ];
        let sum = |k: usize| corners[0][k] - corners[1][k] - corners[2][k] + corners[3][k];
        (sum(1) < 1e-9).then(|| sum(0) / (side * side))
    }

    /// Sums over the rectangle from the corner to a place inside.
    fn up_to(&self, x: f64, y: f64) -> [f64; 2] {
        let (column, row) = (
            (x as usize).min(self.width - 1),
            (y as usize).min(self.height - 1),
        );
        let (dx, dy) = (x - column as f64, y - row as f64);
        let at = |dx: usize, dy: usize| self.sums[(row + dy) * (self.width + 1) + column + dx];
        let [a, b, c, d] = [at(0, 0), at(1, 0), at(0, 1), at(1, 1)];
        std::array::from_fn(|k| {
            (1.0 - dy) * ((1.0 - dx) * a[k] + dx * b[k]) + dy * ((1.0 - dx) * c[k] + dx * d[k])
        })
    }
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
        let sums = Sums::of(&photo());
        let close = |a: Option<f64>, b: f64| (a.unwrap() - b).abs() < 1e-12;
        assert!(close(sums.mean([1.5, 0.5], 1.0), 0.2));
        assert!(close(sums.mean([1.0, 1.0], 2.0), 0.4));
        assert!(close(sums.mean([2.0, 1.0], 1.0), 0.6));
        // A quarter of each.
        assert!(close(sums.mean([1.0, 0.5], 1.0), 0.1));
        assert!(close(sums.mean([2.75, 1.75], 0.5), 1.0));
        assert_eq!(sums.mean([0.4, 1.0], 1.0), None);
        assert_eq!(sums.mean([1.5, 1.6], 1.0), None);
    }

    #[test]
    fn a_masked_neighbour_says_nothing() {
        let mut photo = photo();
        photo.mask = Some(vec![255, 255, 0, 255, 255, 255]);
        let sums = Sums::of(&photo);
        assert_eq!(sums.mean([2.2, 1.0], 1.0), None);
        assert!(sums.mean([1.2, 1.0], 1.0).is_some());
    }
}
