//! Colors of working size under a photo's own lightness.

use std::{num::NonZero, thread};

use super::Canvas;
use crate::{
    capture::Original,
    chroma::teacher::{AbImage, GrayImage, Upsample},
    color::{gamut_map_lab, gray_to_lightness},
};

/// A photo in color, encoded sRGB.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Colored {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// R, G and B in 65,535ths, `[height, width]`.
    pub rgb: Vec<[u16; 3]>,
    /// True if the photo has more than 8 bits a channel.
    pub deep: bool,
    /// The photo's EXIF, as it is for the upright picture.
    pub exif: Option<Vec<u8>>,
}

/// The photo with `ab`, CIELAB a and b of each pixel of its canvas, brought to its size along its
/// edges, and upright. Each pixel keeps its `L*`; where no display shows such a color its chroma is
/// reduced. Where the scene's photos are in another range, chroma grows and shrinks with the light.
///
/// # Panics
/// When `ab` has not the canvas's size.
pub fn finish(original: &Original, canvas: &Canvas, ab: Vec<[f32; 2]>) -> Colored {
    assert_eq!(ab.len(), canvas.len(), "a color for every pixel");
    let bytes = original.bytes();
    let answer = AbImage {
        width: canvas.width,
        height: canvas.height,
        ab,
    };
    let photo = GrayImage {
        width: original.width,
        height: original.height,
        pixels: &bytes,
    };
    let mut large = answer.upsampled(photo, Upsample::Guided);
    if let Some(in_scene) = &original.in_scene {
        // CIELAB's a and b go with L* + 16 as the light does.
        let light = |share: f64| (gray_to_lightness(share) + 16.0) as f32;
        let pixels = original.gray.iter().zip(in_scene);
        for (ab, (&gray, &scene)) in large.ab.iter_mut().zip(pixels) {
            let own = light(f64::from(gray) / f64::from(u16::MAX));
            let by = own / light(f64::from(scene) / f64::from(u8::MAX));
            *ab = ab.map(|value| by * value);
        }
    }
    let lightness: Vec<f64> = match original.deep {
        false => (0..=u8::MAX)
            .map(|gray| gray_to_lightness(f64::from(gray) / f64::from(u8::MAX)))
            .collect(),
        true => (0..=u16::MAX)
            .map(|gray| gray_to_lightness(f64::from(gray) / f64::from(u16::MAX)))
            .collect(),
    };
    let step = if original.deep { 1 } else { 257 };
    let shown = |(gray, ab): (&u16, &[f32; 2])| {
        let lightness = lightness[usize::from(gray / step)];
        let rgb = gamut_map_lab([lightness, f64::from(ab[0]), f64::from(ab[1])]);
        rgb.map(|value| (f64::from(u16::MAX) * value).round() as u16)
    };
    let mut rgb = vec![[0; 3]; original.gray.len()];
    let threads = thread::available_parallelism().map_or(1, NonZero::get);
    let share = rgb.len().div_ceil(threads).max(1);
    thread::scope(|scope| {
        let parts = rgb.chunks_mut(share);
        let sources = original.gray.chunks(share).zip(large.ab.chunks(share));
        for (part, (gray, ab)) in parts.zip(sources) {
            scope.spawn(move || {
                for (rgb, source) in part.iter_mut().zip(gray.iter().zip(ab)) {
                    *rgb = shown(source);
                }
            });
        }
    });
    let (upright, size) = (original.stance.upright, [original.width, original.height]);
    let [width, height] = upright.size(size);
    Colored {
        width,
        height,
        rgb: upright.turned(rgb, 1, size),
        deep: original.deep,
        exif: original.exif.clone(),
    }
}

impl Colored {
    /// R, G and B in 255ths, `[height, width, 3]`.
    pub fn bytes(&self) -> Vec<u8> {
        let byte = |&value: &u16| ((u32::from(value) + 128) / 257) as u8;
        self.rgb.as_flattened().iter().map(byte).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::srgb_to_lab;

    fn photo(gray: Vec<u16>, width: u32, deep: bool) -> Original {
        Original {
            width,
            height: gray.len() as u32 / width,
            gray,
            in_scene: None,
            deep,
            mask: None,
            stance: Default::default(),
            exif: None,
        }
    }

    #[test]
    fn lightness_stays_the_photos_at_either_depth() {
        for (deep, within) in [(false, 0.35), (true, 0.002)] {
            let step = if deep { 1 } else { 257 };
            let gray: Vec<u16> = (0..256)
                .map(|i| i * 251 % 256 * 257 / step * step)
                .collect();
            let original = photo(gray, 16, deep);
            let canvas = Canvas::of(&original, 8);
            let colored = finish(&original, &canvas, vec![[30.0, -40.0]; canvas.len()]);
            assert_eq!(colored.deep, deep);
            let bytes = colored.bytes();
            for (i, gray) in original.gray.iter().enumerate() {
                let shown = match deep {
                    true => colored.rgb[i].map(|v| f64::from(v) / 65535.0),
                    false => [0, 1, 2].map(|c| f64::from(bytes[3 * i + c]) / 255.0),
                };
                let wanted = gray_to_lightness(f64::from(*gray) / 65535.0);
                let found = srgb_to_lab(shown)[0];
                assert!((found - wanted).abs() < within, "{gray}: {found} {wanted}");
            }
        }
    }

    #[test]
    fn gray_colors_give_the_photo_back() {
        for deep in [false, true] {
            let step = if deep { 263 } else { 257 };
            let original = photo((0..240).map(|i| i * step).collect(), 20, deep);
            let canvas = Canvas::of(&original, 20);
            let colored = finish(&original, &canvas, vec![[0.0; 2]; canvas.len()]);
            for (rgb, gray) in colored.rgb.iter().zip(&original.gray) {
                let far = |v: &u16| v.abs_diff(*gray) > 1;
                assert!(!rgb.iter().any(far), "{rgb:?} {gray}");
            }
            if !deep {
                let gray = original.bytes();
                assert!((colored.bytes().chunks(3).zip(gray)).all(|(rgb, g)| rgb == [g; 3]));
            }
        }
    }
}
