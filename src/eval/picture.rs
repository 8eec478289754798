//! Photos and answers as pictures.

use crate::{capture::Photo, chroma::teacher::AbImage, color::srgb_to_lab, raster::RenderedImage};

/// CIELAB a and b of RGB in [0, 1].
pub fn ab_of(rgb: &[[f32; 3]]) -> Vec<[f32; 2]> {
    let ab = |rgb: &[f32; 3]| {
        let [_, a, b] = srgb_to_lab(rgb.map(f64::from));
        [a as f32, b as f32]
    };
    rgb.iter().map(ab).collect()
}

/// A photo's gray as a picture of one channel.
pub fn gray_picture(photo: &Photo) -> RenderedImage {
    RenderedImage {
        width: photo.width,
        height: photo.height,
        channels: 1,
        pixels: photo.gray_values(),
    }
}

/// A drawn gray picture as a photo of 8 bits.
pub fn as_photo(gray: &RenderedImage) -> Photo {
    let byte = |&v: &f32| (v.clamp(0.0, 1.0) * 255.0).round() as u8;
    Photo {
        width: gray.width,
        height: gray.height,
        gray: gray.pixels.iter().map(byte).collect(),
        rgb: None,
        mask: None,
    }
}

/// A teacher's answer as a picture of two channels.
pub fn to_picture(answer: &AbImage) -> RenderedImage {
    RenderedImage {
        width: answer.width,
        height: answer.height,
        channels: 2,
        pixels: answer.ab.as_flattened().to_vec(),
    }
}
