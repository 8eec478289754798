//! A photo at the size at which its colors are found.

use crate::{
    capture::{Original, SensorOrientation, downscale},
    chroma::teacher::{GrayImage, Query},
};

/// A photo at working size, its lens's distortion in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Canvas {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// sRGB-encoded gray, `[height, width]`.
    pub gray: Vec<u8>,
    /// Weight of each pixel by the photo's mask, 0 to 255; `None` where all count.
    pub mask: Option<Vec<u8>>,
    pub stance: SensorOrientation,
}

impl Canvas {
    /// A photo shrunk to a longer side of `side` pixels, never enlarged.
    pub fn of(original: &Original, side: u32) -> Self {
        let longer = original.width.max(original.height);
        let scale = (f64::from(side) / f64::from(longer)).min(1.0);
        let size = [original.width, original.height]
            .map(|length| ((f64::from(length) * scale).round() as u32).max(1));
        Self::sized(original, size)
    }

    /// A photo at a size, or its own where that is smaller.
    pub fn sized(original: &Original, size: [u32; 2]) -> Self {
        let [width, height] = [size[0].min(original.width), size[1].min(original.height)];
        Self {
            width,
            height,
            gray: original.shrunk([width, height]),
            mask: original.shrunk_mask([width, height]),
            stance: original.stance,
        }
    }

    /// The photo of this name, as a teacher is asked about it.
    pub fn query<'a>(&self, name: &'a str) -> Query<'a> {
        Query::of(name, self.stance)
    }

    /// As a teacher is asked about it.
    pub fn gray_image(&self) -> GrayImage<'_> {
        GrayImage {
            width: self.width,
            height: self.height,
            pixels: &self.gray,
        }
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.gray.len()
    }

    /// Width and height.
    pub fn size(&self) -> [usize; 2] {
        [self.width as usize, self.height as usize]
    }

    /// Gray in [0, 255] with a longer side of at most `side`, with its width and height.
    pub fn small(&self, side: usize) -> (Vec<f32>, [usize; 2]) {
        let from = self.size();
        let scale = (side as f64 / from[0].max(from[1]) as f64).min(1.0);
        let to = from.map(|length| ((length as f64 * scale).round() as usize).max(1));
        let gray = downscale(self.gray.as_chunks::<1>().0, from, to);
        (gray.iter().map(|&[v]| f32::from(v)).collect(), to)
    }
}
