//! Colors of the scene from a photo's viewpoint, and the confidence in them.

use std::sync::Arc;

use super::{Canvas, WeightedColors, align::Alignment, window};
use crate::{
    capture::{Camera, Exposure, View, lens::Undistortion},
    gpu::GpuError,
    raster::{Raster, RenderedImage, SceneRenderer},
    splats::{ShField, Splats, sh},
};

/// Opacities from which the scene begins to be believed, and from which it wholly is: trained
/// before black, a scene is not opaque where photos are dark.
const OPAQUE: [f32; 2] = [0.2, 0.6];

/// Difference between drawing and photo, in 8-bit levels and in medians over the photo, at which
/// the scene is believed by half: something has moved, or was never there.
const UNLIKE: [f32; 2] = [12.0, 2.5];

/// Reach in pixels of the mean over which they are compared, for a scene is blurred.
const REACH: usize = 3;

/// Reach in pixels over which places that differ are joined.
const JOINED: usize = 4;

/// Draws a colored scene as photos show it.
pub struct SceneDrawer<'a> {
    renderer: SceneRenderer<'a>,
    /// Positions of a photo's pixels in its views, for the lenses met last.
    lenses: Vec<Lens>,
}

struct Lens {
    undistortion: Undistortion,
    camera: [f64; 6],
    size: [u32; 2],
    places: Arc<Vec<[f32; 2]>>,
}

/// One view of a photo: the photo itself, or a face of it.
#[derive(Clone, Copy)]
pub struct ViewOf<'a> {
    pub view: &'a View,
    /// Its camera at working size.
    pub camera: &'a Camera,
    /// Exposure of the photo.
    pub exposure: Exposure,
    /// True if camera and exposure are those of frames before and after.
    pub is_estimated: bool,
}

/// The field that is one where a scene of so many Gaussians can be believed: not where the last
/// `surroundings` of them show, which no photo does.
pub fn believable(splats: usize, surroundings: usize) -> ShField {
    let mut field = ShField::zeros(splats, 0, 2);
    let scene = splats.saturating_sub(surroundings) * field.channels;
    field.coefficients[..scene].fill((1.0 / sh::C0) as f32);
    field
}

impl<'a> SceneDrawer<'a> {
    /// A drawer of a scene with native a/b harmonics; `believed` marks the believable part
    /// ([`believable`]), `extent` is the capture's, in world units.
    pub fn new(
        raster: &Arc<Raster>,
        luma: &'a Splats,
        [chroma, believed]: [&'a ShField; 2],
        extent: f64,
    ) -> Result<Self, GpuError> {
        let fields = [&luma.sh, chroma, believed];
        Ok(Self {
            renderer: SceneRenderer::of(raster, luma, &fields, extent)?,
            lenses: Vec::new(),
        })
    }

    /// Width and height at which a photo's colors are found: those at which its middle has the scale
    /// of its views at working size.
    pub fn size(views: &[ViewOf<'_>]) -> Option<[u32; 2]> {
        let ViewOf { view, camera, .. } = views.first()?;
        Some(match &view.undistortion {
            Some(undistortion) => undistortion.photo_size(camera),
            None => [camera.width, camera.height],
        })
    }

    /// The scene's colors on a photo's canvas.
    pub fn draw(
        &mut self,
        views: &[ViewOf<'_>],
        canvas: &Canvas,
    ) -> Result<WeightedColors, GpuError> {
        let mut believed = WeightedColors::nothing(canvas.len());
        // Drawing and photo, where the scene shows something.
        let mut grays: Vec<Option<[f32; 2]>> = vec![None; canvas.len()];
        for seen in views {
            let drawn = self.renderer.render(seen.camera)?;
            let places = self.places(seen, canvas);
            let gray = |place| {
                Some(255.0 * seen.exposure.shown(f64::from(value(&drawn[0], place)?[0])) as f32)
            };
            let alignment = match seen.is_estimated {
                true => {
                    let drawn: Vec<Option<f32>> = places.iter().map(|&place| gray(place)).collect();
                    Alignment::of(&drawn, canvas)
                }
                false => Alignment::default(),
            };
            for i in 0..places.len() {
                if grays[i].is_some() {
                    continue;
                }
                let place = places[alignment.source(i, canvas)];
                let at = |picture: usize| value(&drawn[picture], place);
                let (Some(gray), Some(ab), Some(opacity)) = (gray(place), at(1), at(2)) else {
                    continue;
                };
                grays[i] = Some([gray + alignment.lighter, f32::from(canvas.gray[i])]);
                believed.ab[i] = ab;
                believed.weight[i] = step(opacity[0], OPAQUE);
            }
        }
        let unlike = compared(&grays, canvas.size());
        for (i, weight) in believed.weight.iter_mut().enumerate() {
            let mask = canvas
                .mask
                .as_ref()
                .map_or(1.0, |mask| f32::from(mask[i]) / 255.0);
            *weight *= mask / (1.0 + unlike[i].powi(8));
        }
        Ok(believed)
    }

    /// Position of each pixel of the canvas in a view's picture.
    fn places(&mut self, seen: &ViewOf<'_>, canvas: &Canvas) -> Arc<Vec<[f32; 2]>> {
        let size = [canvas.width, canvas.height];
        let Some(undistortion) = &seen.view.undistortion else {
            return Arc::new(places(seen, size));
        };
        let Camera {
            width,
            height,
            fx,
            fy,
            cx,
            cy,
            ..
        } = *seen.camera;
        let camera = [f64::from(width), f64::from(height), fx, fy, cx, cy];
        let known = self.lenses.iter().find(|lens| {
            lens.size == size && lens.camera == camera && lens.undistortion == *undistortion
        });
        if let Some(lens) = known {
            return lens.places.clone();
        }
        let places = Arc::new(places(seen, size));
        if self.lenses.len() >= LENSES {
            self.lenses.remove(0);
        }
        self.lenses.push(Lens {
            undistortion: undistortion.clone(),
            camera,
            size,
            places: places.clone(),
        });
        places
    }
}

/// Position of each pixel of a photo of a size in a view's picture, in pixels of it.
pub fn places(seen: &ViewOf<'_>, size: [u32; 2]) -> Vec<[f32; 2]> {
    if let Some(undistortion) = &seen.view.undistortion {
        return undistortion.places(size, seen.camera);
    }
    let [width, height] = size;
    let scale = [
        seen.camera.width as f32 / width as f32,
        seen.camera.height as f32 / height as f32,
    ];
    let place = |i: u32| {
        [
            ((i % width) as f32 + 0.5) * scale[0],
            ((i / width) as f32 + 0.5) * scale[1],
        ]
    };
    (0..width * height).map(place).collect()
}

/// Lenses that are kept: those of a rig, or the faces of one photo.
const LENSES: usize = 12;

/// Bilinear value of a drawn picture at a place in pixels from its top left corner, its first two
/// channels; none outside.
fn value(picture: &RenderedImage, [x, y]: [f32; 2]) -> Option<[f32; 2]> {
    let [width, height] = [picture.width, picture.height].map(|side| side as usize);
    // NaN fails both.
    if !((0.0..=width as f32).contains(&x) && (0.0..=height as f32).contains(&y)) {
        return None;
    }
    let mut sum = [0.0; 2];
    let last = picture.channels - 1;
    for (row, wy) in window::taps(y - 0.5, height) {
        for (column, wx) in window::taps(x - 0.5, width) {
            let pixel = &picture.pixels[(row * width + column) * picture.channels..];
            sum = [
                sum[0] + wx * wy * pixel[0],
                sum[1] + wx * wy * pixel[last.min(1)],
            ];
        }
    }
    Some(sum)
}

/// 0 below the first of two values, 1 above the second, smooth between.
fn step(value: f32, [low, high]: [f32; 2]) -> f32 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Difference of drawing and photo, in 8-bit levels, around each pixel; at 1 the scene's weight is
/// halved.
///
/// It is `√(mean² + 2 (var d − cov))`, with the mean difference and, over the same pixels, the
/// variance of the drawing d and its covariance with the photo: a drawing that is the photo, or a
/// blur of it, covaries with it as much as it varies, whatever grain the photo has, and one of
/// something else does not.
fn compared(grays: &[Option<[f32; 2]>], size: [usize; 2]) -> Vec<f32> {
    let terms: Vec<[f32; 5]> = (grays.iter())
        .map(|gray| {
            gray.map_or([0.0; 5], |[drawn, photo]| {
                let [d, p] = [drawn, photo].map(|gray| gray - 128.0);
                [d, p, d * d, d * p, 1.0]
            })
        })
        .collect();
    let means: Vec<f32> = (window::sums(&terms, size, REACH).iter())
        .map(|sums| {
            if sums[4] <= 0.0 {
                return 0.0;
            }
            let [d, p, dd, dp, _] = sums.map(|sum| sum / sums[4]);
            let not_shared = (dd - d * d) - (dp - d * p);
            ((d - p).powi(2) + 2.0 * not_shared.max(0.0)).sqrt()
        })
        .collect();
    let mut known: Vec<f32> = (means.iter().zip(grays))
        .filter_map(|(&mean, gray)| gray.map(|_| mean))
        .collect();
    let median = match known.len() {
        0 => 0.0,
        count => *known.select_nth_unstable_by(count / 2, f32::total_cmp).1,
    };
    let half = UNLIKE[0].max(UNLIKE[1] * median);
    let unlike: Vec<f32> = means.iter().map(|mean| mean / half).collect();
    // What is like the scene by chance, within something else, is of that.
    let widened = window::extremes(&unlike, size, JOINED, f32::max);
    window::extremes(&widened, size, JOINED, f32::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_over_an_area_is_doubted_and_grain_is_not() {
        let size = [40, 30];
        let mut grays: Vec<Option<[f32; 2]>> = (0..1200)
            .map(|i| {
                let grain = if (i * 7 + i / 40) % 2 == 0 {
                    20.0
                } else {
                    -20.0
                };
                Some([100.0, 100.0 - grain])
            })
            .collect();
        for y in 10..20 {
            for x in 10..20 {
                grays[y * 40 + x] = Some([100.0, 40.0]);
            }
        }
        grays[0] = None;
        let unlike = compared(&grays, size);
        assert!(unlike[15 * 40 + 15] > 3.0, "{}", unlike[15 * 40 + 15]);
        assert!(unlike[25 * 40 + 30] < 0.4, "{}", unlike[25 * 40 + 30]);
        assert_eq!(compared(&[None; 4], [2, 2]), [0.0; 4]);
    }

    #[test]
    fn a_pattern_of_something_else_is_doubted_and_a_blurred_one_is_not() {
        let size = [40, 30];
        let pattern = |i: usize, phase: f32| 40.0 * (0.9 * (i % 40) as f32 + phase).sin();
        let grays: Vec<Option<[f32; 2]>> = (0..1200)
            .map(|i| {
                let drawn = 120.0 + 0.6 * pattern(i, 0.0);
                // As light on the whole, but another pattern on the left.
                let phase = if i % 40 < 12 { 1.6 } else { 0.0 };
                Some([drawn, 120.0 + pattern(i, phase)])
            })
            .collect();
        let unlike = compared(&grays, size);
        let [left, right] = [5, 30].map(|x| unlike[15 * 40 + x]);
        assert!(left > 1.5 && right < 0.5, "{left} {right}");
    }

    #[test]
    fn steps_and_values() {
        assert_eq!(
            [0.1, 0.2, 0.6, 1.0].map(|v| step(v, OPAQUE)),
            [0.0, 0.0, 1.0, 1.0]
        );
        let picture = RenderedImage {
            width: 2,
            height: 1,
            channels: 1,
            pixels: vec![1.0, 3.0],
        };
        assert_eq!(value(&picture, [1.0, 0.5]), Some([2.0; 2]));
        assert_eq!(value(&picture, [0.0, 1.0]), Some([1.0; 2]));
        assert_eq!(value(&picture, [2.1, 0.5]), None);
        assert_eq!(value(&picture, [f32::NAN, 0.5]), None);
    }
}
