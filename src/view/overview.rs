//! Viewpoint of Gaussians without cameras.

use crate::{
    capture::Camera,
    raster::constants::NEAR_SHARE,
    splats::Splats,
    trajectory::{ball_of_splats, lens, orbit_of_ball},
};

/// The share of the Gaussians within the ball that fills the picture.
const WITHIN: f64 = 0.9;

/// Width and height of the picture in pixels, and its vertical field of view in degrees.
const SIZE: [u32; 2] = [1280, 800];
const FIELD_OF_VIEW: f64 = 44.0;

/// A camera that has most of the Gaussians in its picture, level and a little above them, and
/// the nearest depth at which Gaussians are shown, in world units. Up is where COLMAP's y points
/// away from.
pub fn overview(splats: &Splats) -> (Camera, f64) {
    let ball = ball_of_splats(splats, WITHIN);
    let mut around = orbit_of_ball(ball, &lens(SIZE, FIELD_OF_VIEW), 1);
    (around.remove(0), NEAR_SHARE * ball.1)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn most_gaussians_are_in_the_picture() {
        let grid = (0..1000).map(|k| [k % 10, k / 10 % 10, k / 100].map(|v| 5.0 + 0.3 * v as f32));
        let mut splats = Splats {
            means: grid.collect(),
            opacity_logits: vec![0.0; 1000],
            ..Splats::default()
        };
        // One of them far away.
        splats.means[0] = [1e6, 1e6, -1e6];
        let (camera, near) = overview(&splats);
        let seen = splats.means[1..].iter().filter(|mean| {
            let place = DVec3::from(mean.map(f64::from));
            camera.pixel_of(place).is_some() && camera.depth(place) > near
        });
        assert!(seen.count() > 950);
        // The right side up: what has a smaller y is higher.
        let [low, high] = [6.5, 6.0].map(|y| camera.pixel_of(DVec3::new(6.0, y, 6.0)).unwrap()[1]);
        assert!(high < low);
        assert!((camera.rotation.determinant() - 1.0).abs() < 1e-9);
        assert!(overview(&Splats::default()).1 > 0.0);
    }
}
