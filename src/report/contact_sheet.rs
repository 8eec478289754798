//! Pictures side by side: photo, luma, teacher, color.

use image::{Rgb, RgbImage, imageops};

/// Pixels between pictures.
const GAP: u32 = 4;

/// One view's pictures, all of one size; a missing one stays blank.
pub struct Row {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Left to right.
    pub pictures: Vec<Option<RgbImage>>,
}

/// Lays rows out on white.
pub fn contact_sheet(rows: &[Row]) -> RgbImage {
    let width = rows
        .iter()
        .map(|row| row.pictures.len() as u32 * (row.width + GAP) + GAP)
        .max()
        .unwrap_or(GAP);
    let height = rows.iter().map(|row| row.height + GAP).sum::<u32>() + GAP;
    let mut sheet = RgbImage::from_pixel(width, height, Rgb([255; 3]));
    let mut y = GAP;
    for row in rows {
        for (column, picture) in row.pictures.iter().enumerate() {
            if let Some(image) = picture {
                let x = GAP + column as u32 * (row.width + GAP);
                imageops::replace(&mut sheet, image, i64::from(x), i64::from(y));
            }
        }
        y += row.height + GAP;
    }
    sheet
}

/// An 8-bit picture of RGB in [0, 1].
///
/// # Panics
/// When there are not `width · height` pixels.
pub fn to_image(width: u32, height: u32, pixels: &[[f32; 3]]) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        let pixel = pixels[y as usize * width as usize + x as usize];
        image::Rgb(pixel.map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_stand_in_their_cells() {
        let red = to_image(3, 2, &[[1.0, 0.0, 0.0]; 6]);
        let sheet = contact_sheet(&[Row {
            width: 3,
            height: 2,
            pictures: vec![None, Some(red)],
        }]);
        assert_eq!(sheet.dimensions(), (2 * (3 + GAP) + GAP, 2 + 2 * GAP));
        assert_eq!(sheet.get_pixel(GAP, GAP), &Rgb([255; 3]));
        assert_eq!(sheet.get_pixel(2 * GAP + 3, GAP), &Rgb([255, 0, 0]));
        assert_eq!(sheet.get_pixel(2 * GAP + 6, GAP), &Rgb([255; 3]));
    }
}
