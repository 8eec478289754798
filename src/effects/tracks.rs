//! What the photos show at COLMAP's points: the same place of the scene, seen by
//! several views.

use glam::DVec3;

use crate::capture::{Camera, Capture, Photo};

/// Gray at which a sensor may have stopped counting, from below and from above: such
/// values say only that the scene is at least so dark or bright.
const CLIPPED: [f64; 2] = [2.0 / 255.0, 253.0 / 255.0];

/// What one view shows of a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Index of the view.
    pub view: usize,
    /// Encoded gray in [0, 1].
    pub luma: f64,
    /// Unit vector from the view's camera to the point.
    pub direction: DVec3,
}

/// Samples of each point that at least two views show, neither clipped nor masked.
///
/// `photos` are those of the capture's views at working size.
pub fn sample_tracks(capture: &Capture, photos: &[(Photo, Camera)]) -> Vec<Vec<Sample>> {
    (capture.points.iter())
        .map(|point| {
            (point.track.iter())
                .filter_map(|observation| {
                    let (photo, camera) = &photos[observation.view];
                    let of_model = &capture.views[observation.view].camera;
                    let at = [
                        observation.pixel[0] * f64::from(camera.width) / f64::from(of_model.width),
                        observation.pixel[1] * f64::from(camera.height)
                            / f64::from(of_model.height),
                    ];
                    let luma = luma_at(photo, at)?;
                    let direction = (point.position - camera.center()).try_normalize()?;
                    (luma > CLIPPED[0] && luma < CLIPPED[1]).then_some(Sample {
                        view: observation.view,
                        luma,
                        direction,
                    })
                })
                .collect::<Vec<Sample>>()
        })
        .filter(|samples| samples.len() >= 2)
        .collect()
}

/// The photo's gray at a place in pixels, between the four nearest pixels' centres;
/// `None` outside and where one of them is masked.
pub(super) fn luma_at(photo: &Photo, at: [f64; 2]) -> Option<f64> {
    let sides = [photo.width, photo.height].map(|side| side as usize);
    let inside = (0..2).all(|axis| at[axis] >= 0.0 && at[axis] <= sides[axis] as f64);
    if !inside {
        return None;
    }
    let corner: [f64; 2] = std::array::from_fn(|axis| (at[axis] - 0.5).floor());
    let mut luma = 0.0;
    for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
        let share = |axis: usize, step: usize| {
            let along = at[axis] - 0.5 - corner[axis];
            if step == 1 { along } else { 1.0 - along }
        };
        let place = |axis: usize, step: usize| {
            let place = corner[axis] as isize + step as isize;
            place.clamp(0, sides[axis] as isize - 1) as usize
        };
        let pixel = place(1, dy) * sides[0] + place(0, dx);
        if photo.mask.as_ref().is_some_and(|mask| mask[pixel] < 255) {
            return None;
        }
        luma += share(0, dx) * share(1, dy) * f64::from(photo.gray[pixel]) / 255.0;
    }
    Some(luma)
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
    fn lumas_lie_between_pixel_centres() {
        let at = |x, y| luma_at(&photo(), [x, y]);
        let close = |a: Option<f64>, b: f64| (a.unwrap() - b).abs() < 1e-12;
        assert!(close(at(1.5, 0.5), 0.2) && close(at(1.0, 0.5), 0.1));
        assert!(close(at(1.5, 1.0), 0.5));
        // At the border the nearest pixel counts alone.
        assert!(close(at(0.0, 0.0), 0.0) && close(at(3.0, 2.0), 1.0));
        assert_eq!(at(-0.1, 1.0), None);
        assert_eq!(at(1.0, 2.1), None);
    }

    #[test]
    fn a_masked_neighbour_says_nothing() {
        let mut photo = photo();
        photo.mask = Some(vec![255, 255, 0, 255, 255, 255]);
        assert_eq!(luma_at(&photo, [2.2, 0.5]), None);
        assert!(luma_at(&photo, [1.2, 0.5]).is_some());
    }
}
