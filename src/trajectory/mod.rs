//! Paths of cameras: through photographed viewpoints, around a scene, and in files of other
//! programs.

mod file;
mod orbit;
mod spline;
mod supersplat;
mod world;

pub use file::{Coordinates, MOST_FRAMES, PathFile, TrajectoryError, read_path, write_path};
pub use orbit::{ball_of_splats, orbit_of_ball, orbit_of_cameras};
pub use spline::camera_path;

use glam::{DMat3, DVec3};

use crate::capture::Camera;

/// A camera at `place` that looks at `target`, with `up` as far up in its picture as can be; of
/// `like`'s size and lens.
fn looking(place: DVec3, target: DVec3, up: DVec3, like: &Camera) -> Camera {
    let forward = (target - place).try_normalize().unwrap_or(DVec3::Z);
    let right = forward.cross(up).try_normalize();
    // Looking straight up or down, any side is right.
    let right = right.unwrap_or_else(|| forward.any_orthonormal_vector());
    let rotation = DMat3::from_cols(right, forward.cross(right), forward).transpose();
    Camera {
        rotation,
        translation: -(rotation * place),
        ..like.clone()
    }
}

/// A camera's picture cut or enlarged to another size: all of it is filled, and nothing is shown
/// that the camera does not see.
pub fn framed(camera: &Camera, [width, height]: [u32; 2]) -> Camera {
    let [from, to] =
        [[camera.width, camera.height], [width, height]].map(|size| size.map(f64::from));
    let scale = (to[0] / from[0]).max(to[1] / from[1]);
    let middle = |at: f64, axis: usize| (at - 0.5 * from[axis]) * scale + 0.5 * to[axis];
    Camera {
        width,
        height,
        fx: camera.fx * scale,
        fy: camera.fy * scale,
        cx: middle(camera.cx, 0),
        cy: middle(camera.cy, 1),
        ..camera.clone()
    }
}

/// A camera of a size with square pixels that sees so many degrees up and down.
///
/// # Panics
/// Where the size is empty.
pub fn lens([width, height]: [u32; 2], degrees: f64) -> Camera {
    let focal = 0.5 * f64::from(height) / (0.5 * degrees.to_radians()).tan();
    Camera {
        width,
        height,
        fx: focal,
        fy: focal,
        cx: 0.5 * f64::from(width),
        cy: 0.5 * f64::from(height),
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
    }
}

#[cfg(test)]
mod fixtures {
    use glam::{DMat3, DVec3};

    use crate::capture::Camera;

    /// A small camera at a place, turned about y by an angle in radians.
    pub fn camera(center: DVec3, turn: f64) -> Camera {
        let rotation = DMat3::from_rotation_y(turn);
        Camera {
            width: 40,
            height: 30,
            fx: 50.0,
            fy: 50.0,
            cx: 20.0,
            cy: 15.0,
            rotation,
            translation: -(rotation * center),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_camera_looks_where_it_should() {
        let like = lens([64, 48], 50.0);
        let (place, target) = (DVec3::new(1.0, -2.0, 3.0), DVec3::new(4.0, 0.0, -5.0));
        let camera = looking(place, target, DVec3::NEG_Y, &like);
        assert!(camera.center().distance(place) < 1e-12);
        assert!((camera.rotation.determinant() - 1.0).abs() < 1e-12);
        let [u, v] = camera.pixel_of(target).unwrap();
        assert!((u - 32.0).abs() < 1e-9 && (v - 24.0).abs() < 1e-9);
        // What is above is above in the picture.
        let above = camera.pixel_of(target + 0.5 * DVec3::NEG_Y).unwrap();
        assert!(above[1] < v - 1.0 && (above[0] - u).abs() < 1e-9);
        let down = looking(DVec3::ZERO, DVec3::Y, DVec3::NEG_Y, &like);
        assert!(down.rotation.is_finite() && down.rotation.determinant() > 0.99);
    }

    #[test]
    fn another_size_shows_nothing_more() {
        let camera = lens([400, 300], 50.0);
        for size in [[1920, 1080], [300, 400], [400, 300], [200, 150]] {
            let other = framed(&camera, size);
            assert_eq!([other.width, other.height], size);
            let edge = |camera: &Camera| [camera.cx / camera.fx, camera.cy / camera.fy];
            let ([x, y], [whole_x, whole_y]) = (edge(&other), edge(&camera));
            assert!(x <= whole_x + 1e-12 && y <= whole_y + 1e-12, "{size:?}");
            let touches = (x - whole_x).abs() < 1e-12 || (y - whole_y).abs() < 1e-12;
            assert!(touches, "{size:?}");
        }
    }
}
