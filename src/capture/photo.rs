//! Photos as the program uses them.

use std::fs;
use std::io::Cursor;
use std::path::Path;

use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use super::error::CaptureError;
use super::jpeg;
use super::resample::downscale;
use super::{Camera, View};
use crate::color::GrayTable;

/// A photo may differ from its camera by so many pixels a side: undistortion
/// rounds sizes.
const SIZE_SLACK: u32 = 1;

/// Or be scaled, if its aspect ratio is the camera's to within this part.
const ASPECT_SLACK: f64 = 0.01;

/// The most a decoded file may take, in bytes: 178 million RGB pixels, more
/// than any camera's, and little enough to fail with words instead of by force.
const LARGEST_FILE: u64 = 512 << 20;

/// A decoded photo, row by row from the top left, 8-bit encoded sRGB.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Photo {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Gray, `[height · width]`: the file's own if it is gray, else the gray
    /// with the same `L*` as the colour.
    pub gray: Vec<u8>,
    /// Colours, `[height · width]`, where the photo has a pixel that is not gray.
    pub rgb: Option<Vec<[u8; 3]>>,
    /// What each pixel counts, `[height · width]`: 255 fully, 0 not at all. `None`
    /// where every pixel counts.
    pub mask: Option<Vec<u8>>,
}

impl Photo {
    /// Decodes the photo of a view, takes its lens's distortion out where the view
    /// says so, and resizes its camera to it.
    ///
    /// Reads JPEG and PNG with 8 bits a channel. Transparency, colour profiles
    /// and the EXIF orientation are ignored, the last because COLMAP ignores it.
    /// A photo whose longer side exceeds `max_side` is downscaled to it by area
    /// averaging of the encoded values, at its aspect ratio.
    ///
    /// # Errors
    /// If the file cannot be read or decoded, has 16 bits a channel or CMYK
    /// colours, is cut off, or has neither its camera's size to within a pixel
    /// a side nor its aspect ratio to within 1 %, or would take more than 512 MiB.
    pub fn load(view: &View, max_side: Option<u32>) -> Result<(Self, Camera), CaptureError> {
        let (expected, camera) = (view.photo_size(), &view.camera);
        let lens = view.undistortion.as_ref();
        let side = lens.map_or(max_side, |lens| lens.photo_side(camera, max_side));
        let photo = decode(&view.image_path, expected)?
            .shrunk_to(side)
            .into_photo();
        Ok(match lens {
            Some(lens) => lens.apply(&photo, camera, max_side),
            None => {
                let camera = camera.resized(photo.width, photo.height);
                (photo, camera)
            }
        })
    }
}

/// A decoded file.
struct Pixels {
    width: u32,
    height: u32,
    values: Values,
}

enum Values {
    Gray(Vec<[u8; 1]>),
    Rgb(Vec<[u8; 3]>),
}

impl Pixels {
    fn shrunk_to(self, max_side: Option<u32>) -> Self {
        let longer = self.width.max(self.height);
        let target = max_side.unwrap_or(longer).max(1);
        if target >= longer {
            return self;
        }
        let shrunk = |side: u32| {
            let exact = f64::from(side) * f64::from(target) / f64::from(longer);
            (exact.round() as u32).max(1)
        };
        let (width, height) = (shrunk(self.width), shrunk(self.height));
        let from = [self.width as usize, self.height as usize];
        let to = [width as usize, height as usize];
        let values = match self.values {
            Values::Gray(gray) => Values::Gray(downscale(&gray, from, to)),
            Values::Rgb(rgb) => Values::Rgb(downscale(&rgb, from, to)),
        };
        Self {
            width,
            height,
            values,
        }
    }

    fn into_photo(self) -> Photo {
        let (gray, rgb) = match self.values {
            Values::Gray(gray) => (gray.into_flattened(), None),
            Values::Rgb(rgb) => {
                let table = GrayTable::new();
                (rgb.iter().map(|&c| table.gray(c)).collect(), Some(rgb))
            }
        };
        Photo {
            width: self.width,
            height: self.height,
            gray,
            rgb,
            mask: None,
        }
    }
}

fn decode(path: &Path, expected: [u32; 2]) -> Result<Pixels, CaptureError> {
    let failure = |reason: String| CaptureError::Photo {
        path: path.into(),
        reason,
    };
    let file = fs::read(path).map_err(|source| CaptureError::Read {
        path: path.into(),
        source,
    })?;
    let format = match image::guess_format(&file) {
        Ok(format @ (ImageFormat::Jpeg | ImageFormat::Png)) => format,
        _ => {
            return Err(failure(
                "is neither JPEG nor PNG; convert it (its name may stay)".into(),
            ));
        }
    };
    if format == ImageFormat::Jpeg {
        check_jpeg(&file).map_err(failure)?;
    }

    let unreadable = |error| failure(format!("cannot be decoded ({error}); save it anew"));
    let decoder = ImageReader::with_format(Cursor::new(file), format)
        .into_decoder()
        .map_err(unreadable)?;
    // Before any pixel is allocated: the size that the file announces may be a lie.
    let (width, height) = decoder.dimensions();
    if !fits(expected, width, height) {
        return Err(CaptureError::PhotoSize {
            path: path.into(),
            photo: [width, height],
            camera: expected,
        });
    }
    if decoder.total_bytes() > LARGEST_FILE {
        return Err(failure(format!(
            "announces {width}×{height} pixels, too many to decode; run image_undistorter with --max_image_size"
        )));
    }
    match decoder.color_type() {
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => {}
        other => {
            let bits = 8 * u16::from(other.bytes_per_pixel()) / u16::from(other.channel_count());
            return Err(failure(format!(
                "has {bits} bits a channel; convert it to 8 bits"
            )));
        }
    }
    let values = match DynamicImage::from_decoder(decoder).map_err(unreadable)? {
        DynamicImage::ImageLuma8(gray) => Values::Gray(pixels(&gray)),
        image @ DynamicImage::ImageLumaA8(_) => Values::Gray(pixels(&image.into_luma8())),
        image => {
            let rgb = pixels(&image.into_rgb8());
            if rgb.iter().all(|[r, g, b]| r == g && g == b) {
                Values::Gray(rgb.iter().map(|&[gray, ..]| [gray]).collect())
            } else {
                Values::Rgb(rgb)
            }
        }
    };
    Ok(Pixels {
        width,
        height,
        values,
    })
}

fn pixels<const N: usize>(samples: &[u8]) -> Vec<[u8; N]> {
    samples.as_chunks().0.to_vec()
}

fn check_jpeg(file: &[u8]) -> Result<(), String> {
    match jpeg::inspect(file) {
        None => Err("ends before its end-of-image marker; copy it again".into()),
        Some(frame) if frame.precision != 8 => Err(format!(
            "has {} bits a channel; convert it to 8 bits",
            frame.precision
        )),
        Some(frame) if frame.components == 4 => {
            Err("has CMYK colours; convert it to RGB or gray".into())
        }
        Some(_) => Ok(()),
    }
}

/// Whether a photo of this size can be the camera's.
fn fits(expected: [u32; 2], width: u32, height: u32) -> bool {
    let near =
        expected[0].abs_diff(width) <= SIZE_SLACK && expected[1].abs_diff(height) <= SIZE_SLACK;
    let aspect = |width: u32, height: u32| f64::from(width) / f64::from(height);
    let ratio = aspect(width, height) / aspect(expected[0], expected[1]);
    near || (ratio - 1.0).abs() <= ASPECT_SLACK
}

#[cfg(test)]
#[path = "photo_tests.rs"]
mod tests;
