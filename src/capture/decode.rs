//! Photo files as numbers.

use std::io::{BufReader, Cursor, Read};
use std::path::Path;
use std::sync::Arc;

use image::{ColorType, DynamicImage, ImageBuffer, ImageDecoder, ImageFormat, ImageReader};

use super::error::CaptureError;
use super::room::{self, Held};
use super::sample::{Bytes, Depth, Header, LARGEST_FILE, Samples};
use super::{jpeg, tiff};
use crate::input;

/// How TIFF files begin that may be larger than 4 GiB, in either byte order.
const BIG_TIFF: [&[u8]; 2] = [b"II+\0", b"MM\0+"];

/// The longest of the formats' magic numbers, in bytes.
const MAGIC: u64 = 16;

/// A decoded file.
pub(super) struct Picture {
    pub header: Header,
    /// `[height, width, channels]`.
    pub samples: Samples,
    _held: Option<Held>,
}

/// The most samples that a byte of a file can stand for: DEFLATE makes at most 1032 bytes of
/// one (zlib's technical details), and a byte holds eight samples of one bit. JPEG and LZW
/// stay far below.
const SAMPLES_PER_BYTE: u64 = 8 * 1032;

/// Reads what a file announces, and of TIFF and PNG files nothing else.
pub(super) fn header(path: &Path) -> Result<Header, CaptureError> {
    let file = input::open(path).map_err(unread(path))?;
    let opened = open(Box::new(BufReader::new(file)));
    if opened.is_err() {
        // The decoder's words about what it does not read help nobody.
        check_jpeg(&input::read(path).map_err(unread(path))?).map_err(failure(path))?;
    }
    Ok(opened.map_err(failure(path))?.0)
}

/// Decodes a file once `check` has agreed to its size: before any pixel is
/// allocated, since what a file announces may be a lie.
///
/// Waits until there is room for it; whoever holds a picture must not wait, see
/// [`decode_beside`].
pub(super) fn decode(
    path: &Path,
    check: impl FnOnce([u32; 2]) -> Result<(), CaptureError>,
) -> Result<Picture, CaptureError> {
    decode_with(path, check, |bytes| Some(room::wait_for(bytes)))
}

/// [`decode`] for a picture that belongs to one that is held.
pub(super) fn decode_beside(
    path: &Path,
    check: impl FnOnce([u32; 2]) -> Result<(), CaptureError>,
) -> Result<Picture, CaptureError> {
    decode_with(path, check, |_| None)
}

fn decode_with(
    path: &Path,
    check: impl FnOnce([u32; 2]) -> Result<(), CaptureError>,
    hold: impl FnOnce(u64) -> Option<Held>,
) -> Result<Picture, CaptureError> {
    let file: Arc<[u8]> = input::read(path).map_err(unread(path))?.into();
    let frame = check_jpeg(&file).map_err(failure(path))?;
    let (header, source) = open(Box::new(Cursor::new(file.clone()))).map_err(failure(path))?;
    check(header.size)?;
    let bytes = check_bytes(header, file.len()).map_err(failure(path))?;
    let held = hold(bytes);
    let samples = match (source, frame) {
        (Source::Tiff(mut decoder), _) => tiff::samples(&mut decoder, header),
        (Source::Image(_), Some(frame)) => jpeg::decode(&file, &frame).and_then(samples_of),
        (Source::Image(decoder), None) => png(decoder).and_then(samples_of),
    };
    Ok(Picture {
        header,
        samples: samples.map_err(failure(path))?,
        _held: held,
    })
}

/// Decodes the bytes of a PNG, JPEG or TIFF file. Errors are what is wrong and what helps.
pub(crate) fn decode_image(file: Vec<u8>) -> Result<DynamicImage, String> {
    let file: Arc<[u8]> = file.into();
    let frame = check_jpeg(&file)?;
    let (header, source) = open(Box::new(Cursor::new(file.clone())))?;
    check_bytes(header, file.len())?;
    match (source, frame) {
        (Source::Tiff(mut decoder), _) => {
            let samples = tiff::samples(&mut decoder, header)?;
            picture_of(header, samples)
        }
        (Source::Image(_), Some(frame)) => jpeg::decode(&file, &frame),
        (Source::Image(decoder), None) => png(decoder),
    }
}

/// The bytes of a decoded picture; refuses what would take more than there is or than the file
/// can fill.
fn check_bytes(header: Header, file: usize) -> Result<u64, String> {
    let [width, height] = header.size;
    let samples = u64::from(width) * u64::from(height) * header.channels as u64;
    let bytes = match header.depth {
        Depth::Eight => 1,
        Depth::Sixteen => 2,
        Depth::Float => 4,
    };
    if samples.saturating_mul(bytes) > LARGEST_FILE {
        return Err(format!(
            "announces {width}×{height} pixels, too many to decode; run image_undistorter with --max_image_size"
        ));
    }
    if samples > SAMPLES_PER_BYTE.saturating_mul(file as u64) {
        return Err(format!(
            "announces {width}×{height} pixels, which its {file} bytes cannot hold; copy it again"
        ));
    }
    Ok(samples * bytes)
}

fn png(decoder: Box<dyn ImageDecoder>) -> Result<DynamicImage, String> {
    let unreadable = |e| format!("cannot be decoded ({e}); save it again");
    DynamicImage::from_decoder(decoder).map_err(unreadable)
}

/// A file whose header has been read.
enum Source {
    Image(Box<dyn ImageDecoder>),
    Tiff(tiff::Decoder),
}

fn open(mut bytes: Box<dyn Bytes>) -> Result<(Header, Source), String> {
    let mut magic = Vec::new();
    (&mut bytes)
        .take(MAGIC)
        .read_to_end(&mut magic)
        .and_then(|_| bytes.rewind())
        .map_err(|error| error.to_string())?;
    let format = match BIG_TIFF.iter().any(|big| magic.starts_with(big)) {
        true => Ok(ImageFormat::Tiff),
        false => image::guess_format(&magic),
    };
    let format = match format {
        Ok(ImageFormat::Tiff) => {
            let (header, decoder) = tiff::open(bytes)?;
            return Ok((header, Source::Tiff(decoder)));
        }
        Ok(format @ (ImageFormat::Jpeg | ImageFormat::Png)) => format,
        _ => return Err("is neither JPEG, PNG nor TIFF; convert it (its name may stay)".into()),
    };
    let decoder = ImageReader::with_format(bytes, format)
        .into_decoder()
        .map_err(|error| format!("cannot be decoded ({error}); save it again"))?;
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

/// A picture of values as they stand in a file; floats become 16 bits from 0 to 1.
fn picture_of(header: Header, samples: Samples) -> Result<DynamicImage, String> {
    let [width, height] = header.size;
    let picture = match (samples, header.channels) {
        (Samples::Eight(values), 1) => {
            ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageLuma8)
        }
        (Samples::Eight(values), 2) => {
            ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageLumaA8)
        }
        (Samples::Eight(values), 3) => {
            ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageRgb8)
        }
        (Samples::Eight(values), _) => {
            ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageRgba8)
        }
        (Samples::Sixteen(values), 1) => {
            ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageLuma16)
        }
        (Samples::Sixteen(values), 2) => {
            ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageLumaA16)
        }
        (Samples::Sixteen(values), 3) => {
            ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageRgb16)
        }
        (Samples::Sixteen(values), _) => {
            ImageBuffer::from_raw(width, height, values).map(DynamicImage::ImageRgba16)
        }
        (Samples::Float(values), _) => {
            let white = f32::from(u16::MAX);
            let whole = |value: f32| (value.clamp(0.0, 1.0) * white).round() as u16;
            let values = values.into_iter().map(whole).collect();
            return picture_of(header, Samples::Sixteen(values));
        }
    };
    picture.ok_or_else(|| "has fewer samples than its size needs; save it again".into())
}

/// The structure of a file that is a JPEG; else what is wrong with it.
fn check_jpeg(file: &[u8]) -> Result<Option<jpeg::Frame>, String> {
    if image::guess_format(file).ok() != Some(ImageFormat::Jpeg) {
        return Ok(None);
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
        Some(frame) => Ok(Some(frame)),
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
