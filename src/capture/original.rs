//! A photo's lightness as the file has it: its size, its depth, its lens.

use super::{SensorOrientation, resample::downscale};

/// A photo before anything is done to it but being made gray.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Original {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Gray with the photo's `L*`, encoded sRGB in 65,535ths, `[height, width]`; of a gray photo
    /// of 8 bits multiples of 257.
    pub gray: Vec<u16>,
    /// The same in 255ths in the range that the scene's photos are normalized to, where that is
    /// another.
    pub in_scene: Option<Vec<u8>>,
    /// True if the file distinguishes more than 256 levels.
    pub deep: bool,
    /// As [`Photo::mask`](super::Photo::mask).
    pub mask: Option<Vec<u8>>,
    /// Orientation of the photo.
    pub stance: SensorOrientation,
    /// EXIF of a JPEG or PNG file, as it is for the same picture upright.
    pub exif: Option<Vec<u8>>,
}

impl Original {
    /// Gray in 255ths as the scene has it, `[height, width]`.
    pub fn bytes(&self) -> Vec<u8> {
        if let Some(bytes) = &self.in_scene {
            return bytes.clone();
        }
        let byte = |&gray: &u16| ((u32::from(gray) + 128) / 257) as u8;
        self.gray.iter().map(byte).collect()
    }

    /// [`Self::bytes`] at a size that exceeds the photo's in neither direction, each pixel the
    /// mean of what it covers.
    pub fn shrunk(&self, size: [u32; 2]) -> Vec<u8> {
        self.smaller(&self.bytes(), size)
    }

    /// Weight of each pixel of [`Self::shrunk`], 0 to 255; `None` if all have full weight.
    pub fn shrunk_mask(&self, size: [u32; 2]) -> Option<Vec<u8>> {
        self.mask.as_ref().map(|mask| self.smaller(mask, size))
    }

    fn smaller(&self, pixels: &[u8], size: [u32; 2]) -> Vec<u8> {
        let from = [self.width as usize, self.height as usize];
        let to = size.map(|side| side as usize);
        downscale(pixels.as_chunks::<1>().0, from, to).into_flattened()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_what_an_8_bit_file_held() {
        let original = Original {
            width: 16,
            height: 16,
            gray: (0..=255).map(|v| v * 257).collect(),
            in_scene: None,
            deep: false,
            mask: Some((0..=255).collect()),
            stance: SensorOrientation::default(),
            exif: None,
        };
        let bytes: Vec<u8> = (0..=255).collect();
        assert_eq!(original.bytes(), bytes);
        assert_eq!(original.shrunk([16, 16]), bytes);
        // Rows of 16 levels: a column's mean over all rows, and so the mask's.
        let columns: Vec<u8> = (0..16).map(|x| 120 + x).collect();
        assert_eq!(original.shrunk([16, 1]), columns);
        assert_eq!(original.shrunk_mask([16, 1]), Some(columns));
    }
}
