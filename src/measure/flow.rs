//! Optical flow between two views of a scene that stands still.

use glam::DVec3;

use crate::capture::Camera;

/// Optical flow: displacement of each pixel from one picture to another.
#[derive(Clone, Debug, PartialEq)]
pub struct Flow {
    /// Width in pixels.
    pub width: usize,
    /// Height in pixels.
    pub height: usize,
    /// Displacement right and down in pixels, `[height, width]`; NaN where it is
    /// not known.
    pub vectors: Vec<[f32; 2]>,
}

impl Flow {
    /// The flow from one camera's picture to another's, by the first one's depth
    /// (`[height, width]`, along the camera's z axis in world units).
    ///
    /// Not known where the depth is not positive and finite, and where the point
    /// lies behind the second camera.
    ///
    /// # Panics
    /// When the depth has not the first camera's size.
    pub fn geometric(from: &Camera, to: &Camera, depth: &[f32]) -> Self {
        let (width, height) = (from.width as usize, from.height as usize);
        assert_eq!(depth.len(), width * height, "a depth for every pixel");
        // One motion from camera to camera: world coordinates may be large.
        let rotation = to.rotation * from.rotation.transpose();
        let translation = to.translation - rotation * from.translation;
        let vectors = depth
            .iter()
            .enumerate()
            .map(|(i, &z)| {
                let z = f64::from(z);
                let (u, v) = ((i % width) as f64 + 0.5, (i / width) as f64 + 0.5);
                let ray = DVec3::new((u - from.cx) / from.fx, (v - from.cy) / from.fy, 1.0);
                let seen = rotation * (z * ray) + translation;
                // NaN fails both comparisons.
                if !(z > 0.0 && z < f64::INFINITY && seen.z > 0.0) {
                    return [f32::NAN; 2];
                }
                let x = to.fx * seen.x / seen.z + to.cx;
                let y = to.fy * seen.y / seen.z + to.cy;
                [(x - u) as f32, (y - v) as f32]
            })
            .collect();
        Self {
            width,
            height,
            vectors,
        }
    }

    /// The pixel of the first picture in which a world point lies, and by how many
    /// pixels the flow misses the point's place in the second; none where the point is
    /// not in front of both cameras, outside the first picture, or the flow is unknown.
    pub fn miss(&self, from: &Camera, to: &Camera, point: DVec3) -> Option<(usize, f64)> {
        let place = |camera: &Camera| {
            let seen = camera.rotation * point + camera.translation;
            (seen.z > 0.0).then(|| {
                [
                    camera.fx * seen.x / seen.z + camera.cx,
                    camera.fy * seen.y / seen.z + camera.cy,
                ]
            })
        };
        let ([x, y], [x2, y2]) = (place(from)?, place(to)?);
        let inside = x >= 0.0 && y >= 0.0 && x < self.width as f64 && y < self.height as f64;
        let index = inside.then(|| y as usize * self.width + x as usize)?;
        let [u, v] = self.vectors[index].map(f64::from);
        let miss = (x + u - x2).hypot(y + v - y2);
        miss.is_finite().then_some((index, miss))
    }

    /// Target of a pixel's center, in pixels from the top left corner.
    pub fn target(&self, index: usize) -> [f64; 2] {
        let [u, v] = self.vectors[index].map(f64::from);
        [
            (index % self.width) as f64 + 0.5 + u,
            (index / self.width) as f64 + 0.5 + v,
        ]
    }
}

/// Bilinear value of a picture, `[height, width]`, at a place in pixels from the top
/// left corner; none where one of the four pixel centers around it is missing.
pub fn sample(
    pixels: &[[f32; 2]],
    [width, height]: [usize; 2],
    [x, y]: [f64; 2],
) -> Option<[f64; 2]> {
    let (x, y) = (x - 0.5, y - 0.5);
    // NaN fails both.
    if !((0.0..=(width as f64 - 1.0)).contains(&x) && (0.0..=(height as f64 - 1.0)).contains(&y)) {
        return None;
    }
    let (column, row) = (x as usize, y as usize);
    let (right, below) = ((column + 1).min(width - 1), (row + 1).min(height - 1));
    let (s, t) = (x - column as f64, y - row as f64);
    let mut sum = [0.0; 2];
    for (place, weight) in [
        (row * width + column, (1.0 - s) * (1.0 - t)),
        (row * width + right, s * (1.0 - t)),
        (below * width + column, (1.0 - s) * t),
        (below * width + right, s * t),
    ] {
        // A pixel without weight may be unknown.
        if weight > 0.0 {
            for c in 0..2 {
                sum[c] += weight * f64::from(pixels[place][c]);
            }
        }
    }
    Some(sum)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use glam::DMat3;

    pub fn camera(center: DVec3, turn: f64) -> Camera {
        let rotation = DMat3::from_rotation_y(turn);
        Camera {
            width: 40,
            height: 30,
            fx: 50.0,
            fy: 55.0,
            cx: 21.0,
            cy: 14.0,
            rotation,
            translation: -(rotation * center),
        }
    }

    #[test]
    fn a_plane_across_the_view_moves_by_focal_length_times_step_over_depth() {
        let (from, to) = (
            camera(DVec3::ZERO, 0.0),
            camera(DVec3::new(0.4, -0.2, 0.0), 0.0),
        );
        let flow = Flow::geometric(&from, &to, &[4.0; 1200]);
        for vector in &flow.vectors {
            assert!((vector[0] + 50.0 * 0.4 / 4.0).abs() < 1e-5, "{vector:?}");
            assert!((vector[1] - 55.0 * 0.2 / 4.0).abs() < 1e-5, "{vector:?}");
        }
        // Towards the plane everything grows about the principal point.
        let near = Flow::geometric(&from, &camera(DVec3::new(0.0, 0.0, 2.0), 0.0), &[4.0; 1200]);
        assert!((near.vectors[0][0] - (0.5 - 21.0)).abs() < 1e-5);
        assert!((near.vectors[0][1] - (0.5 - 14.0)).abs() < 1e-5);
    }

    #[test]
    fn a_turn_moves_pixels_whatever_their_depth() {
        let center = DVec3::new(3.0, -1.0, 2.0);
        let (from, to) = (camera(center, 0.0), camera(center, 0.1));
        for depth in [0.5, 80.0] {
            let flow = Flow::geometric(&from, &to, &[depth; 1200]);
            for (i, vector) in flow.vectors.iter().enumerate() {
                // The angle of a ray in the horizontal plane grows by the turn.
                let row = 14 * 40;
                if (row..row + 40).contains(&i) {
                    let angle = (((i - row) as f64 + 0.5 - 21.0) / 50.0).atan();
                    let want = 50.0 * (angle + 0.1).tan() + 21.0;
                    let got = flow.target(i)[0];
                    assert!((got - want).abs() < 1e-3, "{got} {want} {vector:?}");
                }
            }
        }
    }

    #[test]
    fn another_picture_size_and_a_moved_world() {
        let from = camera(DVec3::ZERO, 0.2);
        let to = camera(DVec3::new(0.3, 0.1, 0.2), -0.1).resized(80, 60);
        let offset = DVec3::new(1e6, -2e6, 3e6);
        let depth = [3.0; 1200];
        let flow = Flow::geometric(&from, &to, &depth);
        let moved = Flow::geometric(&from.recentered(offset), &to.recentered(offset), &depth);
        for (a, b) in flow.vectors.iter().zip(&moved.vectors) {
            assert!((a[0] - b[0]).abs() < 1e-3 && (a[1] - b[1]).abs() < 1e-3);
        }
        // The same point by hand.
        let ray = DVec3::new((0.5 - 21.0) / 50.0, (0.5 - 14.0) / 55.0, 1.0);
        let world = from.rotation.transpose() * (3.0 * ray - from.translation);
        let seen = to.rotation * world + to.translation;
        let want = [
            to.fx * seen.x / seen.z + to.cx,
            to.fy * seen.y / seen.z + to.cy,
        ];
        let got = flow.target(0);
        assert!((got[0] - want[0]).abs() < 1e-4 && (got[1] - want[1]).abs() < 1e-4);
    }

    #[test]
    fn unknown_depths_and_points_behind_are_unknown() {
        let from = camera(DVec3::ZERO, 0.0);
        for depth in [0.0, -1.0, f32::NAN, f32::INFINITY] {
            let flow = Flow::geometric(&from, &from, &[depth; 1200]);
            assert!(flow.vectors.iter().flatten().all(|v| v.is_nan()), "{depth}");
        }
        let beyond = camera(DVec3::new(0.0, 0.0, 5.0), 0.0);
        let flow = Flow::geometric(&from, &beyond, &[4.0; 1200]);
        assert!(flow.vectors.iter().flatten().all(|v| v.is_nan()));
        let still = Flow::geometric(&from, &from, &[4.0; 1200]);
        assert!(still.vectors.iter().flatten().all(|v| v.abs() < 1e-6));
    }

    #[test]
    fn a_points_way_tells_how_good_the_flow_is() {
        let from = camera(DVec3::ZERO, 0.0);
        let to = camera(DVec3::new(0.4, 0.0, 0.0), 0.0);
        let flow = Flow::geometric(&from, &to, &[4.0; 1200]);
        // In the middle of the pixel (25, 20), on the plane, and twice as far.
        let at = |z: f64| DVec3::new(z * (25.5 - 21.0) / 50.0, z * (20.5 - 14.0) / 55.0, z);
        let (index, miss) = flow.miss(&from, &to, at(4.0)).unwrap();
        assert_eq!(index, 20 * 40 + 25);
        assert!(miss < 1e-5, "{miss}");
        let (_, miss) = flow.miss(&from, &to, at(8.0)).unwrap();
        assert!((miss - 2.5).abs() < 1e-5, "{miss}");
        for unseen in [
            at(-4.0),
            DVec3::new(9.0, 0.0, 4.0),
            DVec3::new(0.0, -9.0, 4.0),
        ] {
            assert_eq!(flow.miss(&from, &to, unseen), None);
        }
        let unknown = Flow::geometric(&from, &to, &[f32::NAN; 1200]);
        assert_eq!(unknown.miss(&from, &to, at(4.0)), None);
    }

    #[test]
    fn samples_between_pixels() {
        let pixels = [[0.0, 10.0], [1.0, 20.0], [4.0, f32::NAN], [5.0, 0.0]];
        let at = |x, y| sample(&pixels, [2, 2], [x, y]);
        assert_eq!(at(0.5, 0.5), Some([0.0, 10.0]));
        assert_eq!(at(1.0, 0.5), Some([0.5, 15.0]));
        assert_eq!(at(1.0, 1.0).map(|v| v[0]), Some(2.5));
        assert!(at(1.0, 1.0).is_some_and(|v| v[1].is_nan()));
        assert_eq!(at(1.5, 1.5), Some([5.0, 0.0]));
        for outside in [
            [0.4, 1.0],
            [1.0, 1.6],
            [f64::NAN, 1.0],
            [1.0, f64::INFINITY],
        ] {
            assert_eq!(sample(&pixels, [2, 2], outside), None);
        }
        assert_eq!(sample(&pixels[..1], [1, 1], [0.5, 0.5]), Some([0.0, 10.0]));
    }
}
