//! Pictures at places between pixels.

use image::{Rgb, RgbImage};

/// A picture of `size` whose pixel at `p` shows what `picture` has at `source(p)`, both
/// in pixels, the center of the top left one at (0.5, 0.5).
pub fn remap(
    picture: &RgbImage,
    [width, height]: [u32; 2],
    source: impl Fn([f64; 2]) -> [f64; 2],
) -> RgbImage {
    RgbImage::from_fn(width, height, |x, y| {
        let place = source([x, y].map(|k| f64::from(k) + 0.5));
        Rgb(cubic(picture, place).map(byte))
    })
}

/// The nearest byte.
pub fn byte(value: f64) -> u8 {
    // Saturates at both ends.
    value.round() as u8
}

/// Catmull and Rom's bicubic interpolation; beyond the border, the border.
fn cubic(picture: &RgbImage, [x, y]: [f64; 2]) -> [f64; 3] {
    let (width, height) = picture.dimensions();
    let (columns, rows) = (taps(x, width), taps(y, height));
    let mut sum = [0.0; 3];
    for (row, v) in rows {
        for (column, u) in columns {
            let pixel = picture.get_pixel(column, row).0;
            sum = [0, 1, 2].map(|c| sum[c] + u * v * f64::from(pixel[c]));
        }
    }
    sum
}

/// The four pixels about a place along an axis, with their weights.
fn taps(place: f64, size: u32) -> [(u32, f64); 4] {
    let first = (place - 0.5).floor();
    let t = place - 0.5 - first;
    let weights = [
        -0.5 * t + t * t - 0.5 * t * t * t,
        1.0 - 2.5 * t * t + 1.5 * t * t * t,
        0.5 * t + 2.0 * t * t - 1.5 * t * t * t,
        -0.5 * t * t + 0.5 * t * t * t,
    ];
    let last = f64::from(size) - 1.0;
    std::array::from_fn(|k| {
        let pixel = (first + k as f64 - 1.0).clamp(0.0, last);
        (pixel as u32, weights[k])
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cubic_keeps_pixels_and_straight_ramps() {
        let ramp = RgbImage::from_fn(8, 6, |x, y| Rgb([10 * x as u8, 20 * y as u8, 7]));
        assert_eq!(cubic(&ramp, [3.5, 2.5]), [30.0, 40.0, 7.0]);
        let between = cubic(&ramp, [3.75, 2.0]);
        let expected = [32.5, 30.0, 7.0];
        assert!((0..3).all(|c| (between[c] - expected[c]).abs() < 1e-12));
        // Beyond the border it stays what it is there.
        assert_eq!(cubic(&ramp, [-3.0, 2.5]), [0.0, 40.0, 7.0]);
    }

    #[test]
    fn remapping_shifts() {
        let picture = RgbImage::from_fn(9, 7, |x, y| Rgb([9 * x as u8 + y as u8; 3]));
        let moved = remap(&picture, [4, 3], |[x, y]| [x + 3.0, y + 2.0]);
        for (x, y, pixel) in moved.enumerate_pixels() {
            assert_eq!(pixel, picture.get_pixel(x + 3, y + 2));
        }
    }
}
