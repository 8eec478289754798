//! Photos as the program uses them.

use super::options::MaskUse;
use super::resample::{downscale, downscale_masked};
use crate::color::GrayTable;

/// A photo may differ from its camera by so many pixels a side: undistortion
/// rounds sizes.
const SIZE_SLACK: u32 = 1;

/// Or be scaled, if its aspect ratio is the camera's to within this part.
const ASPECT_SLACK: f64 = 0.01;

/// A decoded photo, row by row from the top left, 8-bit encoded sRGB.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Photo {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Gray, `[height · width]`: the file's own if it is gray, else the gray
    /// with the same `L*` as the color.
    pub gray: Vec<u8>,
    /// Colors, `[height · width]`, where the photo has a pixel that is not gray.
    pub rgb: Option<Vec<[u8; 3]>>,
    /// Weight of each pixel, `[height · width]`: 255 fully, 0 not at all. `None` if every pixel has
    /// full weight. With [`MaskUse::Remove`], pixels of weight 0 are black as well.
    pub mask: Option<Vec<u8>>,
}

impl Photo {
    /// Returns true if a pixel, by its index in `[height, width]`, counts at least half.
    pub fn counts(&self, pixel: usize) -> bool {
        self.mask.as_ref().is_none_or(|mask| mask[pixel] >= 128)
    }

    /// Gray in [0, 1], `[height · width]`.
    pub fn gray_values(&self) -> Vec<f32> {
        self.gray.iter().map(|&v| f32::from(v) / 255.0).collect()
    }

    /// RGB in [0, 1], `[height · width]`; gray where the photo has no colors.
    pub fn rgb_values(&self) -> Vec<[f32; 3]> {
        match &self.rgb {
            Some(rgb) => (rgb.iter())
                .map(|color| color.map(|v| f32::from(v) / 255.0))
                .collect(),
            None => self.gray_values().into_iter().map(|v| [v; 3]).collect(),
        }
    }
}

/// A decoded file, encoded for display.
pub(super) struct Pixels {
    pub width: u32,
    pub height: u32,
    pub values: Values,
    /// As [`Photo::mask`].
    pub mask: Option<Vec<u8>>,
}

pub(super) enum Values {
    Gray(Vec<[u8; 1]>),
    Rgb(Vec<[u8; 3]>),
}

impl Pixels {
    /// Lets only that count which `mask`, of the same size, lets as well.
    pub fn cover(&mut self, mask: Option<Vec<u8>>) {
        let Some(mut mask) = mask else { return };
        if let Some(own) = &self.mask {
            mask.iter_mut()
                .zip(own)
                .for_each(|(m, &own)| *m = own.min(*m));
        }
        self.mask = mask.iter().any(|&count| count < u8::MAX).then_some(mask);
    }

    /// The same with a longer side of at most `max_side`.
    pub fn shrunk_to(self, max_side: Option<u32>) -> Self {
        let size = [self.width, self.height];
        let smaller = working_size(size, max_side);
        if smaller == size {
            return self;
        }
        let [from, to] = [size, smaller].map(|size| size.map(|side| side as usize));
        let (values, mask) = match (self.values, self.mask) {
            (Values::Gray(gray), None) => (Values::Gray(downscale(&gray, from, to)), None),
            (Values::Rgb(rgb), None) => (Values::Rgb(downscale(&rgb, from, to)), None),
            (Values::Gray(gray), Some(mask)) => {
                let (gray, mask) = downscale_masked(&gray, &mask, from, to);
                (Values::Gray(gray), Some(mask))
            }
            (Values::Rgb(rgb), Some(mask)) => {
                let (rgb, mask) = downscale_masked(&rgb, &mask, from, to);
                (Values::Rgb(rgb), Some(mask))
            }
        };
        Self {
            width: smaller[0],
            height: smaller[1],
            values,
            mask,
        }
    }

    /// The photo; with [`MaskUse::Remove`] what the mask leaves, before black.
    pub fn into_photo(self, masked: MaskUse) -> Photo {
        let (mut gray, mut rgb) = match self.values {
            Values::Gray(gray) => (gray.into_flattened(), None),
            Values::Rgb(rgb) => {
                let table = GrayTable::new();
                (rgb.iter().map(|&c| table.gray(c)).collect(), Some(rgb))
            }
        };
        if let (Some(mask), MaskUse::Remove) = (&self.mask, masked) {
            before_black(&mut gray, mask);
            for (pixel, &count) in rgb.iter_mut().flatten().zip(mask) {
                before_black(pixel, &[count; 3]);
            }
        }
        Photo {
            width: self.width,
            height: self.height,
            gray,
            rgb,
            mask: self.mask,
        }
    }
}

/// Blends encoded values with black, as splats are blended.
fn before_black(values: &mut [u8], counts: &[u8]) {
    for (value, &count) in values.iter_mut().zip(counts) {
        *value = ((u16::from(*value) * u16::from(count) + 127) / 255) as u8;
    }
}

/// A photo's size once its longer side is at most `max_side`, at its aspect ratio.
pub(super) fn working_size(size: [u32; 2], max_side: Option<u32>) -> [u32; 2] {
    let longer = size[0].max(size[1]);
    let target = max_side.unwrap_or(longer).max(1);
    if target >= longer {
        return size;
    }
    size.map(|side| {
        let exact = f64::from(side) * f64::from(target) / f64::from(longer);
        (exact.round() as u32).max(1)
    })
}

/// Returns true if two images can be of one shape: they differ by rounding, or in scale.
pub(super) fn same_shape(a: [u32; 2], b: [u32; 2]) -> bool {
    let near = (0..2).all(|axis| a[axis].abs_diff(b[axis]) <= SIZE_SLACK);
    let aspect = |[width, height]: [u32; 2]| f64::from(width) / f64::from(height);
    near || (aspect(a) / aspect(b) - 1.0).abs() <= ASPECT_SLACK
}

#[cfg(test)]
#[path = "photo_tests.rs"]
mod tests;
