//! Pinhole cameras.

use glam::{DMat3, DVec3};

use super::Orientation;

/// A pinhole camera with its pose, as COLMAP defines them.
///
/// Camera axes: x right, y down, z forward. A world point `X` lies at
/// `x = rotation · X + translation` in camera space and projects to
/// `u = fx·x/z + cx`, `v = fy·y/z + cy` in pixels. The center of the top left
/// pixel is at `(0.5, 0.5)`.
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    /// Image width in pixels, at least 1.
    pub width: u32,
    /// Image height in pixels, at least 1.
    pub height: u32,
    /// Horizontal focal length in pixels.
    pub fx: f64,
    /// Vertical focal length in pixels.
    pub fy: f64,
    /// Horizontal principal point in pixels.
    pub cx: f64,
    /// Vertical principal point in pixels.
    pub cy: f64,
    /// World-to-camera rotation.
    pub rotation: DMat3,
    /// World-to-camera translation, in world units.
    pub translation: DVec3,
}

/// From a camera's axes to those of one whose picture is turned clockwise by 90°.
const QUARTER: DMat3 = DMat3::from_cols(DVec3::Y, DVec3::NEG_X, DVec3::Z);

impl Camera {
    /// The camera's center in world space: `-Rᵀ·t`.
    pub fn center(&self) -> DVec3 {
        -(self.rotation.transpose() * self.translation)
    }

    /// Depth of a place: its z in camera space, world units.
    pub fn depth(&self, place: DVec3) -> f64 {
        (self.rotation * place + self.translation).z
    }

    /// The pixel at which a place is seen; `None` behind the camera or outside the image.
    pub fn pixel_of(&self, place: DVec3) -> Option<[f64; 2]> {
        let at = self.rotation * place + self.translation;
        let pixel = [
            self.fx * at.x / at.z + self.cx,
            self.fy * at.y / at.z + self.cy,
        ];
        let inside = |at: f64, side: u32| at >= 0.0 && at < f64::from(side);
        let seen = at.z > 0.0 && inside(pixel[0], self.width) && inside(pixel[1], self.height);
        seen.then_some(pixel)
    }

    /// The same view at another image size; intrinsics scale with each axis.
    pub fn resized(&self, width: u32, height: u32) -> Self {
        let (sx, sy) = (
            f64::from(width) / f64::from(self.width),
            f64::from(height) / f64::from(self.height),
        );
        Self {
            width,
            height,
            fx: self.fx * sx,
            fy: self.fy * sy,
            cx: self.cx * sx,
            cy: self.cy * sy,
            ..self.clone()
        }
    }

    /// The camera of the same picture turned; as it is where that would mirror the picture.
    pub fn turned(&self, orientation: Orientation) -> Self {
        let Some(turns) = orientation.quarter_turns() else {
            return self.clone();
        };
        let once = |camera: Self| Self {
            width: camera.height,
            height: camera.width,
            fx: camera.fy,
            fy: camera.fx,
            cx: f64::from(camera.height) - camera.cy,
            cy: camera.cx,
            rotation: QUARTER * camera.rotation,
            translation: QUARTER * camera.translation,
        };
        (0..turns).fold(self.clone(), |camera, _| once(camera))
    }

    /// The same view with the world's origin moved to `offset`: a point that
    /// was at `X` is now at `X - offset`.
    pub fn recentered(&self, offset: DVec3) -> Self {
        Self {
            translation: self.translation + self.rotation * offset,
            ..self.clone()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            width: 640,
            height: 480,
            fx: 500.0,
            fy: 510.0,
            cx: 322.0,
            cy: 238.0,
            rotation: DMat3::from_rotation_y(0.3) * DMat3::from_rotation_x(-0.2),
            translation: DVec3::new(0.5, -1.0, 4.0),
        }
    }

    fn project(camera: &Camera, point: DVec3) -> [f64; 2] {
        let at = camera.rotation * point + camera.translation;
        [
            camera.fx * at.x / at.z + camera.cx,
            camera.fy * at.y / at.z + camera.cy,
        ]
    }

    #[test]
    fn what_is_behind_is_not_seen() {
        let behind = camera().center() - camera().rotation.transpose() * DVec3::Z;
        assert_eq!(camera().pixel_of(behind), None);
    }

    #[test]
    fn center_is_where_camera_space_begins() {
        let camera = camera();
        let origin = camera.rotation * camera.center() + camera.translation;
        assert!(origin.length() < 1e-14);
    }

    #[test]
    fn resizing_scales_pixels() {
        let point = DVec3::new(0.2, 0.7, 1.0);
        let [u, v] = project(&camera(), point);
        let resized = camera().resized(320, 120);
        let [us, vs] = project(&resized, point);
        assert!((us - 0.5 * u).abs() < 1e-12 && (vs - 0.25 * v).abs() < 1e-12);
        assert_eq!((resized.width, resized.height), (320, 120));
    }

    #[test]
    fn turned_cameras_see_the_same_where_the_turned_picture_has_it() {
        let (point, [width, height]) = (DVec3::new(0.2, 0.7, 1.0), [640.0, 480.0]);
        let [u, v] = project(&camera(), point);
        for (tag, [wanted_u, wanted_v]) in [
            (1, [u, v]),
            (2, [u, v]),
            (3, [width - u, height - v]),
            (6, [height - v, u]),
            (8, [v, width - u]),
        ] {
            let turned = camera().turned(Orientation::of_tag(tag));
            let [found_u, found_v] = project(&turned, point);
            assert!((found_u - wanted_u).abs() < 1e-9, "{tag}");
            assert!((found_v - wanted_v).abs() < 1e-9, "{tag}");
            assert!(turned.center().distance(camera().center()) < 1e-12);
        }
    }

    #[test]
    fn recentering_moves_points_and_keeps_pixels() {
        let (point, offset) = (DVec3::new(0.2, 0.7, 1.0), DVec3::new(10.0, -4.0, 7.0));
        let moved = camera().recentered(offset);
        let [u, v] = project(&camera(), point);
        let [us, vs] = project(&moved, point - offset);
        assert!((us - u).abs() < 1e-10 && (vs - v).abs() < 1e-10);
        let center = camera().center() - offset;
        assert!(moved.center().distance(center) < 1e-12);
    }
}
