//! Pinhole images that cover a lens's field of view.

use glam::{DMat3, DVec2, DVec3};

use super::{Lens, Pinhole, Projection, SAMPLES};
use crate::capture::Camera;

/// A pinhole picture may stretch the photo by this factor at most, in any
/// direction; beyond it most of its pixels would tell nothing. A fisheye is
/// stretched by it 51° from the axis.
const MAX_STRETCH: f64 = 2.5;

/// The part of the photo that may be lost beyond [`MAX_STRETCH`] before it is cut
/// into several pictures.
const MAX_LOSS: f64 = 0.05;

/// A photo of which less than this part can be shown has another lens than its
/// calibration says.
const LEAST_SHOWN: f64 = 0.1;

/// A face of the cube that shows less than this part of itself is left out.
const LEAST_FACE: f64 = 0.005;

/// All pictures together have at most so many times the photo's pixels; faces of a
/// fisheye of 180° have 1.2 times as many. Beyond it a calibration is no lens's.
const MAX_GROWTH: f64 = 16.0;

/// Samples across a face, an odd number: it is cut to those that show something.
const GRID: usize = 33;

/// Rays nearer to the picture's plane than this, of unit length, count as beside it.
const GRAZING: f64 = 1e-3;

/// A pinhole picture that a photo is resampled to.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// The face's name, if there are several.
    pub face: Option<&'static str>,
    /// From the photo's camera axes to the picture's.
    pub rotation: DMat3,
    /// Its size and calibration, at the size of COLMAP's model; the pose is the
    /// identity.
    pub camera: Camera,
}

impl Cut {
    /// Pixel of a ray of the photo's camera; none outside of the image.
    pub fn pixel(&self, ray: DVec3) -> Option<[f64; 2]> {
        let ray = self.rotation * ray;
        let camera = &self.camera;
        let (u, v) = (ray.x / ray.z, ray.y / ray.z);
        let (x, y) = (camera.fx * u + camera.cx, camera.fy * v + camera.cy);
        let inside = |c: f64, side: u32| (0.0..=f64::from(side)).contains(&c);
        let shown = ray.z > 0.0 && inside(x, camera.width) && inside(y, camera.height);
        shown.then_some([x, y])
    }
}

impl Lens {
    /// The photo itself as a pinhole's picture.
    pub fn as_pinhole(&self) -> Cut {
        let Pinhole { focal, center } = self.pinhole();
        Cut {
            face: None,
            rotation: DMat3::IDENTITY,
            camera: Camera {
                width: self.width,
                height: self.height,
                fx: focal.x,
                fy: focal.y,
                cx: center.x,
                cy: center.y,
                rotation: DMat3::IDENTITY,
                translation: DVec3::ZERO,
            },
        }
    }

    /// The pinhole pictures that together show the photo, at its own scale in the
    /// middle: one, or faces of a cube in the order of their names.
    ///
    /// # Errors
    /// In words, if the lens folds nearly the whole photo or squeezes a wide field
    /// into few pixels.
    pub fn cuts(&self) -> Result<Vec<Cut>, String> {
        let cuts = self.any_cuts()?;
        let pixels = |width: u32, height: u32| f64::from(width) * f64::from(height);
        let sizes = cuts
            .iter()
            .map(|cut| pixels(cut.camera.width, cut.camera.height));
        let growth = sizes.sum::<f64>() / pixels(self.width, self.height);
        if growth > MAX_GROWTH {
            return Err(format!(
                "without its distortion the photo would have {growth:.0} times as many pixels"
            ));
        }
        Ok(cuts)
    }

    fn any_cuts(&self) -> Result<Vec<Cut>, String> {
        let rays: Vec<(DVec2, DVec3)> = self
            .samples()
            .filter_map(|pixel| Some((pixel, self.ray(pixel)?)))
            .collect();
        let samples = (SAMPLES * SAMPLES) as f64;
        if (rays.len() as f64) < LEAST_SHOWN * samples {
            return Err(format!(
                "its distortion folds {:.0} % of the photo over the rest",
                100.0 * (1.0 - rays.len() as f64 / samples)
            ));
        }
        if self.projection == Projection::Equirectangular {
            return Ok(self.faces());
        }
        let pinhole = self.pinhole();
        let shown: Vec<DVec2> = rays
            .iter()
            .filter(|(_, ray)| ray.z > GRAZING)
            .map(|&(_, ray)| pinhole.pixel(ray))
            .filter(|&place| self.stretch(&pinhole, place) <= MAX_STRETCH)
            .collect();
        if (shown.len() as f64) < (1.0 - MAX_LOSS) * rays.len() as f64 {
            return Ok(self.faces());
        }
        Ok(vec![Cut {
            face: None,
            rotation: DMat3::IDENTITY,
            camera: window(&pinhole, shown),
        }])
    }

    /// By how much a pinhole stretches the photo at a place of its own, the most in
    /// any direction.
    fn stretch(&self, pinhole: &Pinhole, place: DVec2) -> f64 {
        let photo = |place: DVec2| {
            let ray = ((place - pinhole.center) / pinhole.focal).extend(1.0);
            self.pixel(ray).unwrap_or(DVec2::NAN)
        };
        let [x, y] = [DVec2::X, DVec2::Y].map(|axis| {
            let half = 0.5 * axis;
            photo(place + half) - photo(place - half)
        });
        // The smaller singular value of the way back.
        let (sum, product) = (x.length_squared() + y.length_squared(), x.perp_dot(y));
        let larger = 0.5 * (sum + (sum * sum - 4.0 * product * product).max(0.0).sqrt());
        larger.sqrt() / product.abs()
    }

    /// The faces of a cube around the camera, each cut to what the photo shows of it.
    fn faces(&self) -> Vec<Cut> {
        let scale = self.distortion.scale_at_center();
        let pinhole = Pinhole {
            focal: DVec2::splat(scale * (self.focal.x * self.focal.y).sqrt()),
            center: DVec2::ZERO,
        };
        let size = DVec2::new(f64::from(self.width), f64::from(self.height));
        let cut = |(face, right, forward): (_, DVec3, DVec3)| {
            let down = forward.cross(right);
            let rotation = DMat3::from_cols(right, down, forward).transpose();
            // One step beyond the sample that still shows something.
            let step = 2.0 / (GRID - 1) as f64;
            let mut seen = Vec::new();
            let mut count = 0;
            for k in 0..GRID * GRID {
                let slope = step * DVec2::new((k % GRID) as f64, (k / GRID) as f64) - 1.0;
                let pixel = self.pixel(rotation.transpose() * slope.extend(1.0));
                if pixel.is_some_and(|p| p.cmpge(DVec2::ZERO).all() && p.cmple(size).all()) {
                    count += 1;
                    for corner in [-step, step] {
                        let corner = (slope + corner).clamp(DVec2::NEG_ONE, DVec2::ONE);
                        seen.push(pinhole.pixel(corner.extend(1.0)));
                    }
                }
            }
            let enough = f64::from(count) >= LEAST_FACE * (GRID * GRID) as f64;
            enough.then(|| Cut {
                face: Some(face),
                rotation,
                camera: window(&pinhole, seen),
            })
        };
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
        let faces = [
            ("back", -x, -z),
            ("down", x, y),
            ("front", x, z),
            ("left", z, -x),
            ("right", -z, x),
            ("up", x, -y),
        ];
        faces.into_iter().filter_map(cut).collect()
    }
}

/// The smallest picture of whole pixels that holds all places.
fn window(pinhole: &Pinhole, places: Vec<DVec2>) -> Camera {
    let bounds = places.into_iter().map(|place| (place, place));
    let (low, high) = bounds
        .reduce(|(low, high), (place, _)| (low.min(place), high.max(place)))
        .unwrap_or_default();
    // Rounding of a hundredth of a pixel is no reason for a row more.
    let low = (low + 0.01).floor();
    let size = ((high - 0.01).ceil() - low).max(DVec2::ONE);
    let center = pinhole.center - low;
    Camera {
        width: size.x as u32,
        height: size.y as u32,
        fx: pinhole.focal.x,
        fy: pinhole.focal.y,
        cx: center.x,
        cy: center.y,
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
    }
}
