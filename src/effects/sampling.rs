//! Sampling rates of the same places in several views.

use crate::capture::{Camera, Capture, Point};

/// Share of the points whose spread the figure is not below: a few points seen from
/// oddly near or far do not make a scene of mixed distances.
const PERCENTILE: f64 = 0.9;

/// Ratio of the finest to the coarsest sampling rate of a place (focal length by depth, pixels on
/// one world unit), 90th percentile over the points. At least 1; `None` if no point has two views.
///
/// `cameras` are those of the capture's views at working size.
pub fn sampling_spread(capture: &Capture, cameras: &[Camera]) -> Option<f64> {
    let mut spreads: Vec<f64> = (capture.points.iter())
        .filter_map(|point| spread(point, cameras))
        .collect();
    let last = spreads.len().checked_sub(1)?;
    let at = (last as f64 * PERCENTILE) as usize;
    Some(*spreads.select_nth_unstable_by(at, f64::total_cmp).1)
}

/// The highest by the lowest sampling rate of a point, if two views see it.
fn spread(point: &Point, cameras: &[Camera]) -> Option<f64> {
    let rate = |camera: &Camera| {
        let depth = camera.depth(point.position);
        (depth > 0.0).then(|| (camera.fx * camera.fy).sqrt() / depth)
    };
    let rates: Vec<f64> = if point.track.is_empty() {
        let inside = cameras.iter();
        let inside = inside.filter(|camera| camera.pixel_of(point.position).is_some());
        inside.filter_map(rate).collect()
    } else {
        let seen = point.track.iter().map(|seen| &cameras[seen.view]);
        seen.filter_map(rate).collect()
    };
    let highest = rates.iter().copied().fold(0.0, f64::max);
    let lowest = rates.iter().copied().fold(f64::INFINITY, f64::min);
    (rates.len() >= 2).then(|| highest / lowest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::fixtures::{capture, looking_along_z, photo};
    use glam::DVec3;

    /// Views along z from these distances, all of the same points at 0, in photos as wide.
    fn spread_of(distances: &[(f64, u32)]) -> Option<f64> {
        let photos: Vec<_> = (distances.iter())
            .map(|&(distance, width)| {
                let camera = looking_along_z(DVec3::new(0.0, 0.0, -distance), width);
                (photo(&camera, |_, _| 0), camera)
            })
            .collect();
        let points = (0..20).map(|i| DVec3::new(0.0, 0.0, 1e-6 * f64::from(i)));
        let cameras: Vec<Camera> = photos.iter().map(|(_, camera)| camera.clone()).collect();
        sampling_spread(&capture(&photos, points), &cameras)
    }

    #[test]
    fn distance_and_size_count() {
        let is = |views: &[(f64, u32)], wanted: f64| {
            let found = spread_of(views).expect("two views");
            assert!((found - wanted).abs() < 1e-4, "{found} for {views:?}");
        };
        is(&[(2.0, 64), (2.0, 64)], 1.0);
        is(&[(2.0, 64), (6.0, 64), (3.0, 64)], 3.0);
        is(&[(2.0, 64), (2.0, 16)], 4.0);
        // Far, but with so many more pixels.
        is(&[(2.0, 16), (8.0, 64)], 1.0);
    }

    #[test]
    fn one_view_has_no_spread() {
        assert_eq!(spread_of(&[(2.0, 64)]), None);
        assert_eq!(spread_of(&[(2.0, 64), (-5.0, 64)]), None);
    }
}
