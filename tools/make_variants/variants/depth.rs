//! Photos of one channel, with more than 8 bits or with less than their range.

use gs_chroma::color::{GrayTable, srgb_to_linear};
use image::{GrayImage, ImageBuffer, Luma};

use super::scene::{Developed, Scene};

/// The part of the 16-bit range in use: as of a sensor that was exposed for its
/// brightest light.
const USED: [f64; 2] = [0.2, 0.35];

/// Radiance of white, in whatever unit a camera's maker has.
const WHITE: f64 = 40.0;

/// 16-bit gray of a narrow range.
pub fn sixteen(scene: &mut Scene) -> String {
    develop(scene, |gray| {
        let [low, high] = USED;
        let narrow = |value: u8| {
            let part = low + (high - low) * f64::from(value) / 255.0;
            (part * 65535.0).round() as u16
        };
        let (width, height) = gray.dimensions();
        let values = gray.into_raw().into_iter().map(narrow).collect();
        let picture = ImageBuffer::<Luma<u16>, _>::from_raw(width, height, values);
        Developed::Gray16(picture.expect("as many pixels as before"))
    });
    format!(
        "16-bit gray between {} and {} of the range",
        USED[0], USED[1]
    )
}

/// 8-bit gray.
pub fn eight(scene: &mut Scene) -> String {
    develop(scene, Developed::Gray);
    "8-bit gray".into()
}

/// Floats in linear light.
pub fn float(scene: &mut Scene) -> String {
    develop(scene, |gray| {
        let linear = |value: u8| (WHITE * srgb_to_linear(f64::from(value) / 255.0)) as f32;
        Developed::Float(gray.into_raw().into_iter().map(linear).collect())
    });
    format!("32-bit linear radiance, white is {WHITE}")
}

fn develop(scene: &mut Scene, made: impl Fn(GrayImage) -> Developed) {
    let table = GrayTable::new();
    for view in &mut scene.views {
        let (width, height) = view.picture.dimensions();
        let gray = GrayImage::from_fn(width, height, |x, y| {
            Luma([table.gray(view.picture.get_pixel(x, y).0)])
        });
        view.developed = Some(made(gray));
    }
}
