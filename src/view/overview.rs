//! Where to look from at Gaussians without cameras.

use glam::{DMat3, DVec3};

use crate::{capture::Camera, raster::constants::NEAR_SHARE, splats::Splats};

/// Gaussians that are looked at, at most.
const SAMPLES: usize = 20_000;

/// Distance of the camera from the middle, in radii: the radius fills two thirds of the height.
const DISTANCE: f64 = 2.2;

/// Width, height and focal length of the picture in pixels.
const WIDTH: u32 = 1280;
const HEIGHT: u32 = 800;
const FOCAL: u32 = 1000;

/// A camera that has most of the Gaussians in its picture, level and a little above them, and
/// the nearest depth at which Gaussians are shown, in world units. Up is where COLMAP's y points
/// away from.
pub fn overview(splats: &Splats) -> (Camera, f64) {
    let step = splats.len().div_ceil(SAMPLES).max(1);
    let sorted = [0, 1, 2].map(|axis| {
        let means = splats.means.iter().step_by(step);
        let mut values: Vec<f32> = means
            .map(|mean| mean[axis])
            .filter(|value| value.is_finite())
            .collect();
        values.sort_unstable_by(f32::total_cmp);
        values
    });
    let at = |share: f64| {
        let value = |axis: usize| {
            let values: &[f32] = &sorted[axis];
            let place = (share * values.len().saturating_sub(1) as f64) as usize;
            values.get(place).map_or(0.0, |&value| f64::from(value))
        };
        DVec3::new(value(0), value(1), value(2))
    };
    let center = at(0.5);
    let radius = (at(0.9).distance(at(0.1)) / 2.0).max(1e-6);
    let from = DVec3::new(0.0, -0.4, -1.0).normalize();
    let eye = center + DISTANCE * radius * from;
    let forward = -from;
    let right = forward.cross(DVec3::NEG_Y).normalize();
    let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
    let camera = Camera {
        width: WIDTH,
        height: HEIGHT,
        fx: f64::from(FOCAL),
        fy: f64::from(FOCAL),
        cx: f64::from(WIDTH) / 2.0,
        cy: f64::from(HEIGHT) / 2.0,
        rotation,
        translation: -(rotation * eye),
    };
    (camera, NEAR_SHARE * radius)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn most_gaussians_are_in_the_picture() {
        let grid = (0..1000).map(|k| [k % 10, k / 10 % 10, k / 100].map(|v| 5.0 + 0.3 * v as f32));
        let mut splats = Splats {
            means: grid.collect(),
            ..Splats::default()
        };
        // One of them far away.
        splats.means[0] = [1e6, 1e6, -1e6];
        let (camera, near) = overview(&splats);
        let seen = splats.means[1..].iter().filter(|mean| {
            let place = DVec3::from(mean.map(f64::from));
            camera.pixel_of(place).is_some() && camera.depth(place) > near
        });
        assert_eq!(seen.count(), 999);
        // The right side up: what has a smaller y is higher.
        let [low, high] = [6.5, 6.0].map(|y| camera.pixel_of(DVec3::new(6.0, y, 6.0)).unwrap()[1]);
        assert!(high < low);
        assert!((camera.rotation.determinant() - 1.0).abs() < 1e-9);
        assert!(overview(&Splats::default()).1 > 0.0);
    }
}
