//! Pictures of luma and chroma together.

use crate::{
    color::{gamut_map_lab, gray_to_lightness},
    raster::RenderedImage,
};

/// The native picture: at each pixel L* of the luma and the blended a/b, brought
/// into the sRGB gamut at constant L* and hue. `[pixels]` of RGB in [0, 1].
pub fn native_rgb(luma: &RenderedImage, chroma: &RenderedImage) -> Vec<[f32; 3]> {
    luma.pixels
        .iter()
        .zip(chroma.pixels.chunks_exact(2))
        .map(|(&gray, ab)| {
            let lightness = gray_to_lightness(f64::from(gray.clamp(0.0, 1.0)));
            gamut_map_lab([lightness, f64::from(ab[0]), f64::from(ab[1])]).map(|v| v as f32)
        })
        .collect()
}
