//! Samples of the photos at COLMAP's points: the same place of the scene, seen by several views.

use glam::DVec3;

use super::patch_means::PatchMeans;
use crate::capture::{Camera, Capture, Point};

/// Gray at which a sensor may have stopped counting, from below and from above: such
/// values say only that the scene is at least so dark or bright.
const CLIPPED: [f64; 2] = [2.0 / 255.0, 253.0 / 255.0];

/// Side, in pixels of the coarsest view that sees a point, of the square over which a
/// view's luma is averaged: points are where luma has an extremum, and views that
/// resolve it differently would seem to differ in exposure.
const FOOTPRINT: f64 = 2.0;

/// Sample of a point in one view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Index of the view.
    pub view: usize,
    /// Encoded gray, or another channel brought to [0, 1].
    pub value: f64,
    /// Unit vector from the view's camera to the point.
    pub direction: DVec3,
}

/// Squares to average for the samples of the points, in the order of the points and their tracks.
/// `cameras` are those of the capture's views at working size.
pub(super) fn look_up_tracks(capture: &Capture, cameras: &[Camera]) -> PatchMeans {
    let mut patch_means = PatchMeans::of(cameras.len());
    for point in &capture.points {
        let coarsest = (point.track.iter())
            .map(|seen| sampling_rate(&cameras[seen.view], point))
            .fold(f64::INFINITY, f64::min);
        for seen in &point.track {
            let camera = &cameras[seen.view];
            let at = place_in(camera, &capture.views[seen.view].camera, seen.pixel);
            let side = FOOTPRINT * sampling_rate(camera, point) / coarsest;
            patch_means.ask(seen.view, at, side);
        }
    }
    patch_means
}

/// Samples of each point that at least two views show, neither clipped nor masked; `found`
/// is what the photos have where [`look_up_tracks`] asked.
pub(super) fn sample_tracks(
    capture: &Capture,
    cameras: &[Camera],
    found: &PatchMeans,
) -> Vec<Vec<Sample>> {
    let mut found = found.means();
    (capture.points.iter())
        .map(|point| {
            (point.track.iter().zip(&mut found))
                .filter_map(|(seen, luma)| {
                    let luma = luma?;
                    let from = point.position - cameras[seen.view].center();
                    let direction = from.try_normalize()?;
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
