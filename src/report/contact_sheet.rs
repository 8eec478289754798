//! Pictures side by side, with words: photo, gray, teacher, scene.

use font8x8::legacy::BASIC_LEGACY;
use image::{Rgb, RgbImage, imageops};

use crate::capture::Orientation;

/// Pixels between pictures.
const GAP: u32 = 4;

/// Pixels of the font's characters, each way.
const CHARACTER: u32 = 8;

/// Widths of pictures that the words grow with.
const PER_ENLARGEMENT: u32 = 400;

const PAPER: Rgb<u8> = Rgb([255; 3]);
const INK: Rgb<u8> = Rgb([30; 3]);

/// In the place of a picture that does not exist: no color of any photo's sky.
const MISSING: Rgb<u8> = Rgb([216; 3]);

/// One view's pictures, all of one size.
pub struct Row {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Stands above them.
    pub caption: String,
    /// Left to right, as many as headings.
    pub pictures: Vec<Option<RgbImage>>,
}

impl Row {
    /// The same with its pictures turned.
    pub fn turned(self, orientation: Orientation) -> Self {
        let [width, height] = orientation.size([self.width, self.height]);
        let turned = |picture: RgbImage| orientation.image(picture.into()).into_rgb8();
        let pictures = self.pictures.into_iter();
        Self {
            width,
            height,
            caption: self.caption,
            pictures: pictures.map(|picture| picture.map(turned)).collect(),
        }
    }
}

/// Lays rows out on white, below the columns' `headings` and their own captions. What is missing
/// is gray and says so.
pub fn contact_sheet(headings: &[&str], rows: &[Row]) -> RgbImage {
    let widest = rows.iter().map(|row| row.width).max().unwrap_or(0);
    let scale = 1 + widest / PER_ENLARGEMENT;
    let line = CHARACTER * scale + GAP;
    let width = headings.len() as u32 * (widest + GAP) + GAP;
    let height = rows.iter().map(|row| row.height + GAP + line).sum::<u32>() + GAP + line;
    let mut sheet = RgbImage::from_pixel(width, height, PAPER);
    let left = |column: usize| GAP + column as u32 * (widest + GAP);
    for (column, heading) in headings.iter().enumerate() {
        write_text(&mut sheet, [left(column), GAP], widest, scale, heading);
    }
    let mut y = GAP + line;
    for row in rows {
        write_text(&mut sheet, [GAP, y], width - GAP, scale, &row.caption);
        y += line;
        for column in 0..headings.len() {
            let x = left(column);
            match row.pictures.get(column).and_then(Option::as_ref) {
                Some(image) => {
                    imageops::replace(&mut sheet, image, i64::from(x), i64::from(y));
                }
                None => {
                    let empty = RgbImage::from_pixel(row.width, row.height, MISSING);
                    imageops::replace(&mut sheet, &empty, i64::from(x), i64::from(y));
                    let middle = y + row.height.saturating_sub(line) / 2;
                    write_text(&mut sheet, [x + GAP, middle], row.width, scale, "none");
                }
            }
        }
        y += row.height + GAP;
    }
    sheet
}

/// Writes a line of text from its top left corner on, as much as has room in `width` pixels.
pub fn write_text(sheet: &mut RgbImage, [left, top]: [u32; 2], width: u32, scale: u32, text: &str) {
    let room = (width / (CHARACTER * scale)) as usize;
    for (place, character) in (0..).zip(text.chars().take(room)) {
        let known = BASIC_LEGACY.get(character as usize);
        let rows = known.unwrap_or(&BASIC_LEGACY['?' as usize]);
        for y in 0..CHARACTER * scale {
            for x in 0..CHARACTER * scale {
                let set = rows[(y / scale) as usize] >> (x / scale) & 1 == 1;
                let at = [left + place * CHARACTER * scale + x, top + y];
                if set && at[0] < sheet.width() && at[1] < sheet.height() {
                    sheet.put_pixel(at[0], at[1], INK);
                }
            }
        }
    }
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
        let red = to_image(40, 20, &[[1.0, 0.0, 0.0]; 800]);
        let row = Row {
            width: 40,
            height: 20,
            caption: "é1".to_owned(),
            pictures: vec![None, Some(red)],
        };
        let sheet = contact_sheet(&["photo", "gray"], &[row]);
        let line = CHARACTER + GAP;
        assert_eq!(
            sheet.dimensions(),
            (2 * (40 + GAP) + GAP, 20 + 2 * GAP + 2 * line)
        );
        let top = GAP + 2 * line;
        assert_eq!(sheet.get_pixel(GAP, top), &MISSING);
        assert_eq!(sheet.get_pixel(2 * GAP + 40, top), &Rgb([255, 0, 0]));
        assert_eq!(sheet.get_pixel(2 * GAP + 80, top), &PAPER);
        // Both headings and the caption are there, and stay within their lines.
        let inked = |x: u32, y: u32, width: u32| {
            let place = (x..x + width).flat_map(|x| (y..y + CHARACTER).map(move |y| (x, y)));
            place
                .filter(|&(x, y)| *sheet.get_pixel(x, y) == INK)
                .count()
        };
        for (x, y) in [(GAP, GAP), (2 * GAP + 40, GAP), (GAP, GAP + line)] {
            assert!(inked(x, y, 16) > 20, "{x} {y}");
        }
        // Of what the font does not have, a question mark.
        let with = |caption: &str| {
            let mut sheet = RgbImage::from_pixel(20, 8, PAPER);
            write_text(&mut sheet, [0, 0], 20, 1, caption);
            sheet
        };
        assert_eq!(with("é1"), with("?1"));
        assert_ne!(with("11"), with("?1"));
    }
}
