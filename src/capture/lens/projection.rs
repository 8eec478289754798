//! Projections of lenses.

use glam::{DVec2, DVec3};

/// Projection of rays to the plane on which a lens distorts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Projection {
    /// Radius tan θ at the angle θ from the axis, 0 ≤ θ < 90°.
    Perspective,
    /// Radius θ. COLMAP's fisheyes see no more than the half-space in front, so
    /// nothing beyond 90° is ever calibrated.
    Fisheye,
    /// Azimuth and elevation (down positive) of the whole sphere.
    Equirectangular,
}

impl Projection {
    /// Intersection of a ray of any length with the plane, if any.
    pub fn plane(self, ray: DVec3) -> Option<DVec2> {
        let across = ray.truncate().length();
        match self {
            Self::Equirectangular => {
                let level = ray.x.hypot(ray.z);
                let plane = DVec2::new(ray.x.atan2(ray.z), ray.y.atan2(level));
                (level + ray.y.abs() > 0.0).then_some(plane)
            }
            _ if ray.z.is_nan() || ray.z <= 0.0 => None,
            Self::Perspective => Some(ray.truncate() / ray.z),
            Self::Fisheye if across == 0.0 => Some(DVec2::ZERO),
            Self::Fisheye => Some(ray.truncate() * (across.atan2(ray.z) / across)),
        }
    }

    /// The unit ray through a place on the plane.
    pub fn ray(self, plane: DVec2) -> DVec3 {
        match self {
            Self::Perspective => plane.extend(1.0).normalize(),
            Self::Fisheye => {
                let angle = plane.length();
                let (sin, cos) = angle.sin_cos();
                let across = if angle > 0.0 { sin / angle } else { 1.0 };
                (plane * across).extend(cos)
            }
            Self::Equirectangular => {
                let (azimuth, elevation) = (plane.x.sin_cos(), plane.y.sin_cos());
                DVec3::new(
                    elevation.1 * azimuth.0,
                    elevation.0,
                    elevation.1 * azimuth.1,
                )
            }
        }
    }

    /// The radius at an angle from the axis, in radians.
    pub fn radius(self, angle: f64) -> f64 {
        match self {
            Self::Perspective => angle.tan(),
            Self::Fisheye | Self::Equirectangular => angle,
        }
    }
}
