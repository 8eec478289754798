//! Lossless WebP pictures of bytes.

use std::io::Cursor;

use image_webp::{ColorType, EncoderParams, WebPDecoder, WebPEncoder};

/// Longest side that WebP has.
pub(super) const LONGEST_SIDE: usize = 16_383;

/// A picture of four bytes a pixel.
pub(super) struct Texture {
    pub width: usize,
    pub height: usize,
    /// `[height, width, 4]`.
    pub rgba: Vec<[u8; 4]>,
}

impl Texture {
    /// A picture for so many Gaussians, about as high as wide, black and opaque.
    pub fn for_splats(count: usize) -> Self {
        let side = (count.max(1) as f64).sqrt();
        let width = 4 * (side / 4.0).ceil() as usize;
        let height = count.max(1).div_ceil(width).next_multiple_of(4);
        Self::black(width, height)
    }

    pub fn black(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            rgba: vec![[0, 0, 0, u8::MAX]; width * height],
        }
    }

    /// The bytes of a file, the smaller of two ways.
    ///
    /// # Errors
    /// In words.
    pub fn encode(&self) -> Result<Vec<u8>, String> {
        let opaque = self.rgba.iter().all(|pixel| pixel[3] == u8::MAX);
        let (kind, bytes) = match opaque {
            true => {
                let rgb = self.rgba.iter().flat_map(|&[r, g, b, _]| [r, g, b]);
                (ColorType::Rgb8, rgb.collect())
            }
            false => (ColorType::Rgba8, self.rgba.as_flattened().to_vec()),
        };
        let way = |predict: bool| -> Result<Vec<u8>, String> {
            let mut file = Vec::new();
            let mut encoder = WebPEncoder::new(&mut file);
            let mut params = EncoderParams::default();
            params.use_predictor_transform = predict;
            encoder.set_params(params);
            let encoded = encoder.encode(&bytes, self.width as u32, self.height as u32, kind);
            encoded.map_err(|error| error.to_string())?;
            Ok(file)
        };
        let [predicted, plain] = [way(true)?, way(false)?];
        Ok(if plain.len() < predicted.len() {
            plain
        } else {
            predicted
        })
    }

    /// Reads a file that has at least and at most so many pixels.
    ///
    /// # Errors
    /// In words: it is no such picture.
    pub fn decode(file: &[u8], pixels: [usize; 2]) -> Result<Self, String> {
        let mut decoder = WebPDecoder::new(Cursor::new(file)).map_err(|error| error.to_string())?;
        let (width, height) = decoder.dimensions();
        let (width, height) = (width as usize, height as usize);
        let [least, most] = pixels;
        if !(least..=most).contains(&(width * height)) {
            return Err(format!(
                "{width}x{height} pixels, where {least} are needed and no more than {most} make sense"
            ));
        }
        if decoder.is_animated() {
            return Err("is animated".to_owned());
        }
        // What the decoder needs beside the picture is as much as the picture.
        decoder.set_memory_limit(16 * width * height + (1 << 20));
        let size = decoder.output_buffer_size().unwrap_or(0);
        let mut bytes = vec![0; size];
        decoder
            .read_image(&mut bytes)
            .map_err(|error| error.to_string())?;
        let rgba = match size / (width * height).max(1) {
            3 => {
                let pixels = bytes.as_chunks().0.iter();
                pixels.map(|&[r, g, b]| [r, g, b, u8::MAX]).collect()
            }
            _ => bytes.as_chunks().0.to_vec(),
        };
        Ok(Self {
            width,
            height,
            rgba,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_come_back() {
        let mut texture = Texture::for_splats(1000);
        assert_eq!((texture.width, texture.height), (32, 32));
        let mut random = fastrand::Rng::with_seed(1);
        for opaque in [true, false] {
            for pixel in &mut texture.rgba {
                *pixel = [(); 4].map(|()| random.u8(..));
                pixel[3] = if opaque { 255 } else { pixel[3] };
            }
            let file = texture.encode().unwrap();
            let found = Texture::decode(&file, [1000, 1024]).unwrap();
            assert_eq!((found.width, found.height), (32, 32));
            assert!(found.rgba == texture.rgba, "opaque: {opaque}");
            assert!(Texture::decode(&file, [1025, 4000]).is_err());
            assert!(Texture::decode(&file, [1, 1000]).is_err());
            assert!(Texture::decode(&file[..100], [1000, 1024]).is_err());
        }
    }
}
