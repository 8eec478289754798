//! Images in and out of a teacher, and their change of size.

use super::TeacherError;
use crate::capture::Orientation;
use serde::{Deserialize, Serialize};

/// A gray photo that is to be colored.
#[derive(Clone, Copy, Debug)]
pub struct GrayImage<'a> {
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
    /// sRGB-encoded gray values, `[height, width]`.
    pub pixels: &'a [u8],
}

/// The colors of a photo without its lightness.
#[derive(Clone, Debug, PartialEq)]
pub struct AbImage {
    /// Width in pixels, at least 1.
    pub width: u32,
    /// Height in pixels, at least 1.
    pub height: u32,
    /// CIELAB (D65) a, b of each pixel, `[height, width]`, about -128 to 127.
    pub ab: Vec<[f32; 2]>,
}

impl GrayImage<'_> {
    /// The pixels turned; an image of them is of [`Orientation::size`].
    pub(super) fn turned(&self, orientation: Orientation) -> Vec<u8> {
        orientation.turned(self.pixels.to_vec(), 1, [self.width, self.height])
    }

    /// Refuses an image whose pixels do not fill its size.
    pub(super) fn check(&self, name: &str) -> Result<(), TeacherError> {
        let expected = u64::from(self.width) * u64::from(self.height);
        if expected == self.pixels.len() as u64 && expected > 0 {
            return Ok(());
        }
        Err(TeacherError::BadPhoto {
            photo: name.to_string(),
            width: self.width,
            height: self.height,
            pixels: self.pixels.len(),
        })
    }
}

impl AbImage {
    /// The same image turned.
    pub fn turned(self, orientation: Orientation) -> Self {
        let size = [self.width, self.height];
        let [width, height] = orientation.size(size);
        Self {
            width,
            height,
            ab: orientation.turned(self.ab, 1, size),
        }
    }

    /// The same image at another size (at least 1 × 1).
    ///
    /// Enlarging is bilinear interpolation with half-pixel centers. Where an
    /// axis shrinks, the weights widen with the step, so that every pixel counts
    /// and nothing aliases.
    pub fn resized(&self, width: u32, height: u32) -> Self {
        let size = [self.width, self.height];
        Self {
            width: width.max(1),
            height: height.max(1),
            ab: resample(&self.ab, size, [width, height], Filter::Average),
        }
    }
}

/// Resampling filter. Along an axis that becomes longer, `Bilinear` and `Average` are the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Filter {
    /// The nearest source pixel.
    Nearest,
    /// The two nearest source pixels of an axis by distance. Aliases where the
    /// axis shrinks, but some networks define their input so.
    Bilinear,
    /// As `Bilinear`, but where an axis shrinks every source pixel counts.
    Average,
}

/// Resamples `pixels`, `[height, width]` values of `C` channels, with half-pixel
/// centers. Sizes are width and height; a target size of 0 counts as 1.
pub(in crate::chroma) fn resample<const C: usize>(
    pixels: &[[f32; C]],
    size: [u32; 2],
    target: [u32; 2],
    filter: Filter,
) -> Vec<[f32; C]> {
    let [width, height] = size.map(|side| side as usize);
    let [new_width, new_height] = target.map(|side| side.max(1) as usize);
    if [width, height] == [new_width, new_height] {
        return pixels.to_vec();
    }
    let columns = taps(width, new_width, filter);
    let rows = taps(height, new_height, filter);
    let weighted = |taps: &Taps, at: &dyn Fn(usize) -> [f32; C]| {
        let mut sum = [0.0; C];
        for (i, weight) in taps.weights.iter().enumerate() {
            let value = at(taps.first + i);
            for c in 0..C {
                sum[c] += weight * value[c];
            }
        }
        sum
    };

    let mut narrowed = Vec::with_capacity(new_width * height);
    for row in pixels.chunks_exact(width) {
        narrowed.extend(columns.iter().map(|taps| weighted(taps, &|x| row[x])));
    }
    let mut resampled = Vec::with_capacity(new_width * new_height);
    for taps in &rows {
        let pixel = |x: usize| weighted(taps, &|y| narrowed[y * new_width + x]);
        resampled.extend((0..new_width).map(pixel));
    }
    resampled
}

/// Source pixels that make one target pixel of an axis.
struct Taps {
    first: usize,
    /// Sum to 1.
    weights: Vec<f32>,
}

/// A tent around each target pixel's center, cut off at the image's border; for
/// [`Filter::Nearest`] the one pixel at the center.
fn taps(length: usize, new_length: usize, filter: Filter) -> Vec<Taps> {
    let step = length as f64 / new_length as f64;
    let radius = match filter {
        Filter::Average => step.max(1.0),
        Filter::Nearest | Filter::Bilinear => 1.0,
    };
    let taps_at = |i: usize| {
        if filter == Filter::Nearest {
            let first = (((i as f64 + 0.5) * step) as usize).min(length - 1);
            return Taps {
                first,
                weights: vec![1.0],
            };
        }
        // Position of the target's center, in source pixels from the first center.
        let center = ((i as f64 + 0.5) * step - 0.5).clamp(0.0, (length - 1) as f64);
        // The tent's feet themselves weigh nothing.
        let first = ((center - radius).floor() + 1.0).max(0.0) as usize;
        let last = ((center + radius).ceil() as usize - 1).min(length - 1);
        let tent = |x: usize| (1.0 - (x as f64 - center).abs() / radius).max(0.0);
        let sum: f64 = (first..=last).map(tent).sum();
        let weights = (first..=last).map(|x| (tent(x) / sum) as f32).collect();
        Taps { first, weights }
    };
    (0..new_length).map(taps_at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(values: &[f32]) -> AbImage {
        AbImage {
            width: values.len() as u32,
            height: 1,
            ab: values.iter().map(|&v| [v, -v]).collect(),
        }
    }

    fn assert_near(image: &AbImage, expected: &[f32]) {
        assert_eq!(image.ab.len(), expected.len());
        for (ab, &value) in image.ab.iter().zip(expected) {
            assert!((ab[0] - value).abs() < 1e-5, "{ab:?} {value}");
            assert_eq!(ab[1], -ab[0]);
        }
    }

    #[test]
    fn enlarging_interpolates_between_half_pixel_centers() {
        let expected = [0.0, 1.0, 3.0, 4.0];
        assert_near(&row(&[0.0, 4.0]).resized(4, 1), &expected);
        let column = AbImage {
            width: 1,
            height: 2,
            ab: row(&[0.0, 4.0]).ab,
        };
        assert_near(&column.resized(1, 4), &expected);
    }

    #[test]
    fn shrinking_averages() {
        let stripes: Vec<f32> = (0..64)
            .map(|i| if i % 2 == 0 { 0.0 } else { 8.0 })
            .collect();
        let small = row(&stripes).resized(8, 1);
        assert!(
            small.ab.iter().all(|ab| (ab[0] - 4.0).abs() < 0.3),
            "{small:?}"
        );
        // The tent of radius 2 around 0.5 and 2.5, cut off at the border.
        let expected = [
            (0.75 * 1.0 + 0.75 * 2.0 + 0.25 * 3.0) / 1.75,
            (0.25 * 2.0 + 0.75 * 3.0 + 0.75 * 4.0) / 1.75,
        ];
        assert_near(&row(&[1.0, 2.0, 3.0, 4.0]).resized(2, 1), &expected);
    }

    #[test]
    fn plain_interpolation_takes_two_pixels() {
        let pixels = [[0.0], [1.0], [2.0], [9.0], [9.0], [9.0], [9.0], [9.0]];
        let small = resample(&pixels, [8, 1], [2, 1], Filter::Bilinear);
        assert_eq!(small, [[1.5], [9.0]]);
    }

    #[test]
    fn the_nearest_pixel_is_the_one_at_the_center() {
        let pixels = [[0.0], [1.0], [2.0], [3.0], [4.0], [5.0]];
        let small = resample(&pixels, [6, 1], [2, 1], Filter::Nearest);
        assert_eq!(small, [[1.0], [4.0]]);
        let large = resample(&small, [2, 1], [4, 1], Filter::Nearest);
        assert_eq!(large, [[1.0], [1.0], [4.0], [4.0]]);
    }

    #[test]
    fn a_constant_stays_constant_at_any_size() {
        let image = AbImage {
            width: 7,
            height: 5,
            ab: vec![[3.0, -4.0]; 35],
        };
        for (width, height) in [(1, 1), (7, 5), (20, 3), (3, 20), (13, 11)] {
            let resized = image.resized(width, height);
            assert_eq!(resized.ab.len(), (width * height) as usize);
            let near = |ab: &[f32; 2]| (ab[0] - 3.0).abs() < 1e-5 && (ab[1] + 4.0).abs() < 1e-5;
            assert!(resized.ab.iter().all(near));
        }
        assert_eq!(image.resized(0, 0).ab.len(), 1);
    }

    #[test]
    fn photos_that_do_not_fill_their_size() {
        let photo = |width, height, pixels| GrayImage {
            width,
            height,
            pixels,
        };
        assert!(photo(2, 1, &[1, 2]).check("a.png").is_ok());
        for bad in [
            photo(2, 2, &[1, 2]),
            photo(0, 0, &[]),
            photo(u32::MAX, u32::MAX, &[1]),
        ] {
            assert!(
                bad.check("a.png")
                    .unwrap_err()
                    .to_string()
                    .contains("a.png")
            );
        }
    }
}
