//! Bounds of a network's answers.

use super::images::{Filter, resample};
use super::profile::{OutputKind, Profile};
use super::{AbImage, GrayImage};
use crate::color::{gray_to_lightness, lab_to_srgb, srgb_to_lab};

/// Beyond this no CIELAB a or b is: those of monochromatic light stay below 200.
pub(super) const AB_MOST: f32 = 256.0;

/// Answers that stay as near to gray as this are none in CIELAB units, but those of networks that
/// answer from -1 to 1 or from 0 to 1, or a little beyond.
const UNIT: f32 = 2.0;

/// Answers that are so far from colors that exist, in CIELAB units, are no a and b, but such as
/// bytes with gray at 128.
const NO_COLORS: f64 = 60.0;

/// Width and height of a picture whose gray rises from left to right.
const RAMP: [u32; 2] = [256, 64];

impl Profile {
    /// True if an output value is plausible: a or b of some color, or RGB at most one range width
    /// outside of its range.
    pub fn can_be(&self, value: f32) -> bool {
        let [black, white] = self.output_range;
        match self.output {
            OutputKind::Ab => self.ab(value).abs() <= AB_MOST,
            OutputKind::Rgb => (-1.0..=2.0).contains(&((value - black) / (white - black))),
        }
    }
}

/// The grays of that picture.
pub(super) fn ramp() -> Vec<u8> {
    (0..RAMP[0] * RAMP[1])
        .map(|i| (i % RAMP[0] * 255 / (RAMP[0] - 1)) as u8)
        .collect()
}

/// Image of the ramp.
pub(super) fn as_image(ramp: &[u8]) -> GrayImage<'_> {
    GrayImage {
        width: RAMP[0],
        height: RAMP[1],
        pixels: ramp,
    }
}

/// True if an answer for a photo can be CIELAB a and b.
pub(super) fn is_ab(answer: &AbImage, photo: &GrayImage<'_>) -> bool {
    let gray = lightness(photo, [answer.width, answer.height]);
    let units = answer.ab.iter().flatten().all(is_unit);
    let pixels = answer.ab.iter().zip(&gray);
    let off = pixels.map(|(&[a, b], &own)| beyond_colors([own, a.into(), b.into()]));
    !units && off.sum::<f64>() / (gray.len() as f64) < NO_COLORS
}

pub(super) fn is_unit(value: &f32) -> bool {
    value.abs() <= UNIT
}

/// Distance of a CIELAB color from the sRGB gamut, in CIELAB units.
pub(super) fn beyond_colors(said: [f64; 3]) -> f64 {
    let shown = lab_to_srgb(said).map(|value| value.clamp(0.0, 1.0));
    let shown = srgb_to_lab(shown);
    (said[1] - shown[1]).hypot(said[2] - shown[2])
}

/// The lightness of a photo's pixels at another size.
pub(super) fn lightness(photo: &GrayImage<'_>, size: [u32; 2]) -> Vec<f64> {
    let gray: Vec<[f32; 1]> = (photo.pixels.iter())
        .map(|&gray| [f32::from(gray) / 255.0])
        .collect();
    let gray = resample(&gray, [photo.width, photo.height], size, Filter::Average);
    gray.into_iter()
        .map(|[gray]| gray_to_lightness(gray.into()))
        .collect()
}
