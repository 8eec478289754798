//! Photo files as numbers.

use std::fs::File;
use std::io::{BufReader, Cursor, Read};
use std::path::Path;

use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader};

use super::error::CaptureError;
use super::sample::{Bytes, Depth, Header, LARGEST_FILE, Samples};
use super::{jpeg, tiff};

/// How TIFF files begin that may be larger than 4 GiB, in either byte order.
const BIG_TIFF: [&[u8]; 2] = [b"II+\0", b"MM\0+"];

/// The longest of the formats' magic numbers, in bytes.
const MAGIC: u64 = 16;

/// A decoded file.
pub(super) struct Picture {
    pub header: Header,
    /// `[height, width, channels]`.
    pub samples: Samples,
}

/// Reads what a file announces, and of TIFF and PNG files nothing else.
pub(super) fn header(path: &Path) -> Result<Header, CaptureError> {
    let file = File::open(path).map_err(unread(path))?;
    let opened = open(path, Box::new(BufReader::new(file)));
    if opened.is_err() {
        // The decoder's words about what it does not read help nobody.
        check_jpeg(&std::fs::read(path).map_err(unread(path))?).map_err(failure(path))?;
    }
    Ok(opened?.0)
}

/// Decodes a file once `check` has agreed to its size: before any pixel is
/// allocated, since what a file announces may be a lie.
pub(super) fn decode(
    path: &Path,
    check: impl FnOnce([u32; 2]) -> Result<(), CaptureError>,
) -> Result<Picture, CaptureError> {
    let file = std::fs::read(path).map_err(unread(path))?;
    check_jpeg(&file).map_err(failure(path))?;
    let (header, source) = open(path, Box::new(Cursor::new(file)))?;
    check(header.size)?;
    let [width, height] = header.size;
    let samples = u64::from(width) * u64::from(height) * header.channels as u64;
    let bytes = match header.depth {
        Depth::Eight => 1,
        Depth::Sixteen => 2,
        Depth::Float => 4,
    };
    if samples.saturating_mul(bytes) > LARGEST_FILE {
        return Err(failure(path)(format!(
            "announces {width}×{height} pixels, too many to decode; run image_undistorter with --max_image_size"
        )));
    }
    let samples = match source {
        Source::Image(decoder) => {
            let unreadable = |e| format!("cannot be decoded ({e}); save it anew");
            DynamicImage::from_decoder(decoder)
                .map_err(unreadable)
                .and_then(samples_of)
        }
        Source::Tiff(mut decoder) => tiff::samples(&mut decoder, header),
    };
    Ok(Picture {
        header,
        samples: samples.map_err(failure(path))?,
    })
}

/// A file whose header has been read.
enum Source {
    Image(Box<dyn ImageDecoder>),
    Tiff(tiff::Decoder),
}

fn open(path: &Path, mut bytes: Box<dyn Bytes>) -> Result<(Header, Source), CaptureError> {
    let mut magic = Vec::new();
    let format = (&mut bytes)
        .take(MAGIC)
        .read_to_end(&mut magic)
        .and_then(|_| bytes.rewind())
        .map(
            |()| match BIG_TIFF.iter().any(|big| magic.starts_with(big)) {
                true => Ok(ImageFormat::Tiff),
                false => image::guess_format(&magic),
            },
        )
        .map_err(unread(path))?;
    let format = match format {
        Ok(ImageFormat::Tiff) => {
            let (header, decoder) = tiff::open(bytes).map_err(failure(path))?;
            return Ok((header, Source::Tiff(decoder)));
        }
        Ok(format @ (ImageFormat::Jpeg | ImageFormat::Png)) => format,
        _ => {
            return Err(failure(path)(
                "is neither JPEG, PNG nor TIFF; convert it (its name may stay)".into(),
            ));
        }
    };
    let decoder = ImageReader::with_format(bytes, format)
        .into_decoder()
        .map_err(|error| format!("cannot be decoded ({error}); save it anew"))
        .map_err(failure(path))?;
    let (width, height) = decoder.dimensions();
    let color = decoder.color_type();
    let header = Header {
        size: [width, height],
        depth: match color {
            ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => {
                Depth::Sixteen
            }
            _ => Depth::Eight,
        },
        channels: color.channel_count().into(),
    };
    Ok((header, Source::Image(Box::new(decoder))))
}

/// The values of what PNG and JPEG files can hold.
fn samples_of(picture: DynamicImage) -> Result<Samples, String> {
    Ok(match picture {
        DynamicImage::ImageLuma8(p) => Samples::Eight(p.into_raw()),
        DynamicImage::ImageLumaA8(p) => Samples::Eight(p.into_raw()),
        DynamicImage::ImageRgb8(p) => Samples::Eight(p.into_raw()),
        DynamicImage::ImageRgba8(p) => Samples::Eight(p.into_raw()),
        DynamicImage::ImageLuma16(p) => Samples::Sixteen(p.into_raw()),
        DynamicImage::ImageLumaA16(p) => Samples::Sixteen(p.into_raw()),
        DynamicImage::ImageRgb16(p) => Samples::Sixteen(p.into_raw()),
        DynamicImage::ImageRgba16(p) => Samples::Sixteen(p.into_raw()),
        _ => return Err("holds neither gray nor RGB; convert it to 8 or 16 bits".into()),
    })
}

/// What is wrong with a file that is a JPEG.
fn check_jpeg(file: &[u8]) -> Result<(), String> {
    if image::guess_format(file).ok() != Some(ImageFormat::Jpeg) {
        return Ok(());
    }
    match jpeg::inspect(file) {
        None => Err("ends before its end-of-image marker; copy it again".into()),
        Some(frame) if frame.precision != 8 => Err(format!(
            "has {} bits a channel; convert it to 8 bits",
            frame.precision
        )),
        Some(frame) if frame.components == 4 => {
            Err("has CMYK colors; convert it to RGB or gray".into())
        }
        Some(_) => Ok(()),
    }
}

fn unread(path: &Path) -> impl Fn(std::io::Error) -> CaptureError {
    |source| CaptureError::Read {
        path: path.into(),
        source,
    }
}

fn failure(path: &Path) -> impl Fn(String) -> CaptureError {
    |reason| CaptureError::Photo {
        path: path.into(),
        reason,
    }
}
