//! Lenses: how COLMAP's camera models bend rays, and how their photos become
//! pinhole pictures.
//!
//! The rasterizer draws pinholes only. A photo whose lens moves pixels visibly is
//! resampled when it is loaded: to one pinhole picture, or, where its field is too
//! wide for one, to several that share its center.

mod cuts;
mod distortion;
mod inverse;
mod model;
mod projection;
mod undistort;

#[cfg(test)]
mod colmap_tests;
#[cfg(test)]
mod quality_tests;
#[cfg(test)]
mod tests;

use glam::{DVec2, DVec3};

pub use cuts::Cut;
pub(super) use model::MOST_PARAMETERS;
pub use model::{MODELS, ModelName};
pub use undistort::Undistortion;

use distortion::Distortion;
use projection::Projection;

/// A lens that displaces no pixel by more than this, in pixels at working size, is
/// taken for a pinhole: COLMAP itself places features no better.
pub const IMPERCEPTIBLE: f64 = 0.5;

/// Samples across a photo, an odd number so that its middle is one: enough to find
/// bounds and extremes of mappings as smooth as a lens's.
const SAMPLES: usize = 17;

/// A camera's calibration: which ray of light meets which pixel.
///
/// Rays are in camera axes, x right, y down, z forward; pixels as in
/// [`Camera`](super::Camera), at the size of COLMAP's model.
#[derive(Clone, Debug, PartialEq)]
pub struct Lens {
    /// COLMAP's name of the camera model.
    pub model: &'static str,
    /// Width of its photos in pixels.
    pub width: u32,
    /// Height of its photos in pixels.
    pub height: u32,
    /// Focal lengths in pixels, horizontal and vertical.
    focal: DVec2,
    /// Principal point in pixels.
    center: DVec2,
    projection: Projection,
    distortion: Distortion,
    /// The largest radius on the plane up to which the distortion is one-to-one.
    limit: f64,
}

impl Lens {
    /// The pixel that a ray of any length meets, inside the image or not; none
    /// where the lens bends no such ray or no longer one-to-one.
    pub fn pixel(&self, ray: DVec3) -> Option<DVec2> {
        let plane = self.projection.plane(ray)?;
        // NaN fails the comparison.
        let within = plane.length_squared() <= self.limit * self.limit;
        within.then(|| self.center + self.focal * self.distortion.apply(plane))
    }

    /// The unit ray that meets a pixel; none where no ray does.
    pub fn ray(&self, pixel: DVec2) -> Option<DVec3> {
        let distorted = (pixel - self.center) / self.focal;
        let plane = inverse::undistorted(&self.distortion, self.limit, distorted)?;
        Some(self.projection.ray(plane))
    }

    /// The largest distance, in pixels, between where this lens and the pinhole of
    /// its focal length show a ray, over the photo; at most the photo's diagonal,
    /// which stands for what a pinhole cannot show. 0 for a pinhole.
    pub fn displacement(&self) -> f64 {
        if self.projection == Projection::Perspective && self.distortion.is_none() {
            return 0.0;
        }
        let diagonal = f64::from(self.width).hypot(f64::from(self.height));
        let pinhole = self.pinhole();
        let displaced = |pixel: DVec2| {
            let ray = self.ray(pixel).filter(|ray| ray.z > 0.0);
            ray.map_or(diagonal, |ray| pinhole.pixel(ray).distance(pixel))
        };
        // `min` takes the diagonal where the other is NaN.
        self.samples()
            .map(|pixel| diagonal.min(displaced(pixel)))
            .fold(0.0, f64::max)
    }

    /// The pinhole that shows the middle of the photo at the lens's own scale.
    fn pinhole(&self) -> Pinhole {
        Pinhole {
            focal: self.focal * self.distortion.scale_at_center(),
            center: self.center,
        }
    }

    /// A grid of places over the photo, its border included.
    fn samples(&self) -> impl Iterator<Item = DVec2> + use<> {
        let size = DVec2::new(f64::from(self.width), f64::from(self.height));
        (0..SAMPLES * SAMPLES).map(move |k| {
            size * DVec2::new((k % SAMPLES) as f64, (k / SAMPLES) as f64) / (SAMPLES - 1) as f64
        })
    }
}

/// A pinhole's calibration in pixels.
#[derive(Clone, Copy, Debug)]
struct Pinhole {
    focal: DVec2,
    center: DVec2,
}

impl Pinhole {
    fn pixel(&self, ray: DVec3) -> DVec2 {
        self.center + self.focal * ray.truncate() / ray.z
    }
}
