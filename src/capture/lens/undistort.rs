//! Resampling a photo to a pinhole picture.

use std::sync::Arc;

use glam::{DMat3, DVec2, DVec3, UVec2};

use super::Lens;
use crate::capture::{Camera, Photo, downscale};

/// A picture smaller than its photo is sampled this finely along each axis, from a
/// photo shrunk to that scale, and then averaged. Sampling a photo of the picture's
/// own scale blurs it; docs/experiments.md has the figures.
const OVERSAMPLING: u32 = 2;

/// Mapping from a photo to a view's image.
#[derive(Clone, Debug, PartialEq)]
pub struct Undistortion {
    /// The lens that took the photo.
    pub lens: Arc<Lens>,
    /// From the photo's camera axes to the view's.
    pub rotation: DMat3,
}

impl Undistortion {
    /// Longest side of the photo for which the image of `camera` keeps to `max_side`: at most
    /// [`OVERSAMPLING`] times the image's scale.
    pub fn photo_side(&self, camera: &Camera, max_side: Option<u32>) -> Option<u32> {
        let photo = f64::from(self.lens.width.max(self.lens.height));
        let picture = f64::from(camera.width.max(camera.height));
        let scale = f64::from(OVERSAMPLING) * photo / picture;
        max_side.map(|side| ((f64::from(side) * scale).ceil() as u32).max(1))
    }

    /// Width and height of the photo at which its middle has the scale of `camera`,
    /// which is the view's at any size.
    pub fn photo_size(&self, camera: &Camera) -> [u32; 2] {
        let focal = self.lens.pinhole().focal;
        let side = |length: u32, scale: f64| ((f64::from(length) * scale).round() as u32).max(1);
        // Faces have one focal length for both axes: their mean.
        let scale = ((camera.fx * camera.fy) / (focal.x * focal.y)).sqrt();
        [side(self.lens.width, scale), side(self.lens.height, scale)]
    }

    /// The view's picture of a photo of any size, and its camera, `camera` being the
    /// view's at the size of COLMAP's model. No side exceeds `max_side`.
    ///
    /// Pixels that show nothing of the photo do not count in the mask.
    pub fn apply(&self, photo: &Photo, camera: &Camera, max_side: Option<u32>) -> (Photo, Camera) {
        let size = [photo.width, photo.height];
        let full = f64::from(camera.width) * f64::from(size[0]) / f64::from(self.lens.width);
        let camera = self.camera(size, camera, max_side);
        let finer = full / f64::from(camera.width);
        let times = (finer.round() as u32).clamp(1, OVERSAMPLING);
        let large = camera.resized(times * camera.width, times * camera.height);
        let sources = self.sources(&large, size);
        let from = [large.width as usize, large.height as usize];
        let to = [camera.width as usize, camera.height as usize];
        let mut mask: Vec<[u8; 1]> = match &photo.mask {
            Some(mask) => sampled(mask, size, &sources, |&counts| [counts]),
            None => vec![[255]; sources.len()],
        };
        for (counts, source) in mask.iter_mut().zip(&sources) {
            if !shows(*source, size) {
                *counts = [0];
            }
        }
        let mask = downscale(&mask, from, to).into_flattened();
        let gray = sampled(&photo.gray, size, &sources, |&value| [value]);
        let rgb = photo.rgb.as_ref();
        let undistorted = Photo {
            width: camera.width,
            height: camera.height,
            gray: downscale(&gray, from, to).into_flattened(),
            rgb: rgb.map(|rgb| downscale(&sampled(rgb, size, &sources, |&c| c), from, to)),
            mask: mask.iter().any(|&counts| counts < 255).then_some(mask),
        };
        (undistorted, camera)
    }

    /// The camera that [`Self::apply`] gives for a photo of this width and height.
    pub fn camera(&self, size: [u32; 2], camera: &Camera, max_side: Option<u32>) -> Camera {
        let width = f64::from(camera.width) * f64::from(size[0]) / f64::from(self.lens.width);
        let height = f64::from(camera.height) * f64::from(size[1]) / f64::from(self.lens.height);
        let longest = max_side.map_or(f64::INFINITY, f64::from);
        let shrink = (longest / width.max(height)).min(1.0);
        let side = |length: f64| ((length * shrink).round() as u32).max(1);
        camera.resized(side(width), side(height))
    }

    /// Any picture of `N` channels of the photo, `size` being its width and height,
    /// as the view's picture of `camera`, that camera being of any size; zeros where
    /// the photo shows nothing.
    pub fn resample<const N: usize>(
        &self,
        picture: &[[f32; N]],
        size: [u32; 2],
        camera: &Camera,
    ) -> Vec<[f32; N]> {
        let sources = self.sources(camera, size);
        let seen = sources.iter().map(|&source| shows(source, size));
        sample(picture, size, &sources, |&value| value)
            .zip(seen)
            .map(|(value, seen)| if seen { value } else { [0.0; N] })
            .collect()
    }

    /// Position of each pixel of a photo of this width and height in the camera's image, in
    /// pixels from its top left corner; NaN if the image does not show it. `[height, width]`.
    pub fn places(&self, size: [u32; 2], camera: &Camera) -> Vec<[f32; 2]> {
        let scale = DVec2::new(
            f64::from(self.lens.width) / f64::from(size[0]),
            f64::from(self.lens.height) / f64::from(size[1]),
        );
        let place = |x: u32, y: u32| {
            let pixel = scale * DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
            let ray = self.rotation * self.lens.ray(pixel)?;
            let place = DVec2::new(
                camera.fx * ray.x / ray.z + camera.cx,
                camera.fy * ray.y / ray.z + camera.cy,
            );
            let inside = |c: f64, side: u32| (0.0..=f64::from(side)).contains(&c);
            let shown = ray.z > 0.0 && inside(place.x, camera.width);
            (shown && inside(place.y, camera.height)).then(|| place.as_vec2().to_array())
        };
        (0..size[1])
            .flat_map(|y| (0..size[0]).map(move |x| (x, y)))
            .map(|(x, y)| place(x, y).unwrap_or([f32::NAN; 2]))
            .collect()
    }

    /// Position of each pixel of the camera's image in a photo of this size, in pixels; NaN where
    /// no ray meets the photo's plane.
    pub(super) fn sources(&self, camera: &Camera, size: [u32; 2]) -> Vec<[f32; 2]> {
        let scale = DVec2::new(
            f64::from(size[0]) / f64::from(self.lens.width),
            f64::from(size[1]) / f64::from(self.lens.height),
        );
        // Farther out nothing differs, and coordinates fit into integers.
        let beyond = DVec2::splat(8.0);
        let (lowest, highest) = (-beyond, UVec2::from(size).as_dvec2() + beyond);
        let back = self.rotation.transpose();
        let mut sources = Vec::with_capacity((camera.width * camera.height) as usize);
        for y in 0..camera.height {
            for x in 0..camera.width {
                let ray = back
                    * DVec3::new(
                        (f64::from(x) + 0.5 - camera.cx) / camera.fx,
                        (f64::from(y) + 0.5 - camera.cy) / camera.fy,
                        1.0,
                    );
                let source = self.lens.pixel(ray).unwrap_or(DVec2::NAN) * scale;
                sources.push(source.clamp(lowest, highest).as_vec2().to_array());
            }
        }
        sources
    }
}

/// Returns true if a position lies in a photo of this size.
fn shows(source: [f32; 2], size: [u32; 2]) -> bool {
    source
        .iter()
        .zip(size)
        .all(|(&c, side)| (0.0..=side as f32).contains(&c))
}

/// [`sample`] of bytes.
fn sampled<T, const N: usize>(
    picture: &[T],
    size: [u32; 2],
    sources: &[[f32; 2]],
    value: impl Fn(&T) -> [u8; N],
) -> Vec<[u8; N]> {
    sample(picture, size, sources, |pixel| value(pixel).map(f32::from))
        .map(|values| values.map(|value| value.round() as u8))
        .collect()
}

/// A picture's values at several places, by cubic interpolation (Keys 1981,
/// a = −1/2) between pixel centers; beyond the border it goes on as it ends. Next to
/// an edge a result may exceed all values by a twelfth of their range. NaN gives zeros.
pub(super) fn sample<'a, T, const N: usize>(
    picture: &'a [T],
    size: [u32; 2],
    sources: &'a [[f32; 2]],
    value: impl Fn(&T) -> [f32; N] + 'a,
) -> impl Iterator<Item = [f32; N]> + 'a {
    let [width, height] = size.map(|side| side as i64);
    sources.iter().map(move |&[x, y]| {
        let mut sum = [0.0; N];
        if x.is_nan() || y.is_nan() {
            return sum;
        }
        let ((left, across), (top, down)) = (taps(x), taps(y));
        for (dy, weight_y) in (0..).zip(down) {
            let row = (top + dy).clamp(0, height - 1) * width;
            for (dx, weight_x) in (0..).zip(across) {
                let pixel = value(&picture[(row + (left + dx).clamp(0, width - 1)) as usize]);
                for (sum, pixel) in sum.iter_mut().zip(pixel) {
                    *sum += weight_x * weight_y * pixel;
                }
            }
        }
        sum
    })
}

/// The first of four pixels around a coordinate and the weights of all.
fn taps(at: f32) -> (i64, [f32; 4]) {
    let base = (at - 0.5).floor();
    let t = at - 0.5 - base;
    let (t2, t3) = (t * t, t * t * t);
    let weights = [
        -0.5 * t3 + t2 - 0.5 * t,
        1.5 * t3 - 2.5 * t2 + 1.0,
        -1.5 * t3 + 2.0 * t2 + 0.5 * t,
        0.5 * t3 - 0.5 * t2,
    ];
    (base as i64 - 1, weights)
}
