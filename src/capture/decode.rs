//! Photo files as numbers.

use std::io::{BufReader, Cursor, Read};
use std::path::Path;
use std::sync::Arc;

use image::{DynamicImage, ImageBuffer, ImageDecoder, ImageFormat, codecs::jpeg::JpegDecoder};

use super::error::CaptureError;
use super::memory::{self, ReservedBytes};
use super::metadata::{self, ImageMetadata};
use super::orientation::Orientation;
use super::sample::{Bytes, Depth, Header, LARGEST_FILE, Samples};
use super::{colors, jpeg, tiff};
use crate::input;

/// First bytes of TIFF files that may be larger than 4 GiB, in either byte order.
const BIG_TIFF: [&[u8]; 2] = [b"II+\0", b"MM\0+"];

/// The longest of the formats' magic numbers, in bytes.
const MAGIC: u64 = 16;

/// A decoded file.
pub(super) struct DecodedImage {
    pub header: Header,
    /// `[height, width, channels]`.
    pub samples: Samples,
    /// EXIF for the same picture with its pixels upright, where the file has some.
    pub exif: Option<Vec<u8>>,
    _held: Option<ReservedBytes>,
}

impl DecodedImage {
    /// The same with its pixels turned.
    pub fn turned(self, orientation: Orientation) -> Self {
        let (size, channels) = (self.header.size, self.header.channels);
        let header = Header {
            size: orientation.size(size),
            ..self.header
        };
        let samples = match self.samples {
            Samples::Eight(values) => Samples::Eight(orientation.turned(values, channels, size)),
            Samples::Sixteen(values) => {
                Samples::Sixteen(orientation.turned(values, channels, size))
            }
            Samples::Float(values) => Samples::Float(orientation.turned(values, channels, size)),
        };
        Self {
            header,
            samples,
            ..self
        }
    }
}

/// The most samples that a byte of a file can stand for: DEFLATE makes at most 1032 bytes of
/// one (zlib's technical details), and a byte holds eight samples of one bit. JPEG and LZW
/// stay far below.
const SAMPLES_PER_BYTE: u64 = 8 * 1032;

/// Reads what a file announces, and of TIFF and PNG files nothing else.
pub(crate) fn header(path: &Path) -> Result<Header, CaptureError> {
    let file = input::open(path).map_err(CaptureError::read(path))?;
    let opened = open(Box::new(BufReader::new(file)), false);
    if opened.is_err() {
        // The decoder's words about what it does not read help nobody.
        check_jpeg(&input::read(path).map_err(CaptureError::read(path))?).map_err(failure(path))?;
    }
    Ok(opened.map_err(failure(path))?.0)
}

/// Decodes a file once `check` has agreed to what it announces: before any pixel is
/// allocated, since that may be a lie.
///
/// Waits until there is room for it; whoever holds a picture must not wait, see
/// [`decode_beside`].
pub(super) fn decode(
    path: &Path,
    check: impl FnOnce(&Header) -> Result<(), CaptureError>,
) -> Result<DecodedImage, CaptureError> {
    decode_with(path, check, |bytes| Some(memory::wait_for(bytes)))
}

/// [`decode`] for a picture that belongs to one that is held.
pub(super) fn decode_beside(
    path: &Path,
    check: impl FnOnce(&Header) -> Result<(), CaptureError>,
) -> Result<DecodedImage, CaptureError> {
    decode_with(path, check, |_| None)
}

fn decode_with(
    path: &Path,
    check: impl FnOnce(&Header) -> Result<(), CaptureError>,
    hold: impl FnOnce(u64) -> Option<ReservedBytes>,
) -> Result<DecodedImage, CaptureError> {
    let file: Arc<[u8]> = input::read(path).map_err(CaptureError::read(path))?.into();
    let frame = check_jpeg(&file).map_err(failure(path))?;
    let bytes = Box::new(Cursor::new(file.clone()));
    let (header, metadata, source) = open(bytes, false).map_err(failure(path))?;
    check(&header)?;
    let bytes = check_bytes(header, file.len()).map_err(failure(path))?;
    let held = hold(bytes);
    let samples = source.samples(header, &file, frame);
    Ok(DecodedImage {
        header,
        samples: samples.map_err(failure(path))?,
        exif: metadata.exif.and_then(metadata::for_upright),
        _held: held,
    })
}

/// A picture that somebody has made of a photo.
pub(crate) struct Painting {
    /// As its file has it, but in sRGB.
    pub image: DynamicImage,
    /// Transform that makes it upright.
    pub orientation: Orientation,
    /// Color space of the file if it is not supported; the colors are then taken for sRGB.
    pub unheeded: Option<String>,
}

impl Painting {
    /// The picture upright.
    #[cfg(feature = "cli")]
    pub fn upright(self) -> DynamicImage {
        self.orientation.image(self.image)
    }
}

/// Decodes the bytes of a PNG, JPEG or TIFF file. Errors are what is wrong and what helps.
pub(crate) fn decode_image(file: Vec<u8>) -> Result<Painting, String> {
    let file: Arc<[u8]> = file.into();
    let frame = check_jpeg(&file)?;
    let (header, metadata, source) = open(Box::new(Cursor::new(file.clone())), true)?;
    check_bytes(header, file.len())?;
    let samples = source.samples(header, &file, frame)?;
    let (image, unheeded) = colors::in_srgb(picture_of(header, samples)?, &metadata);
    Ok(Painting {
        image,
        orientation: header.orientation,
        unheeded,
    })
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

/// A file whose header has been read.
enum OpenedImage {
    Jpeg,
    Png(Box<png::Reader<Box<dyn Bytes>>>),
    Tiff(tiff::Decoder),
}

impl OpenedImage {
    /// `frame` is that of a JPEG file.
    fn samples(
        self,
        header: Header,
        file: &[u8],
        frame: Option<jpeg::Frame>,
    ) -> Result<Samples, String> {
        match (self, frame) {
            (Self::Tiff(mut decoder), _) => tiff::samples(&mut decoder, header),
            (Self::Png(mut decoder), _) => {
                let size = decoder.output_buffer_size().unwrap_or_default();
                let mut values = vec![0; size];
                decoder.next_frame(&mut values).map_err(undecodable)?;
                Ok(match header.depth {
                    Depth::Eight => Samples::Eight(values),
                    _ => {
                        let values = values.as_chunks().0.iter();
                        Samples::Sixteen(values.map(|&bytes| u16::from_be_bytes(bytes)).collect())
                    }
                })
            }
            (Self::Jpeg, Some(frame)) => samples_of(jpeg::decode(file, &frame)?),
            // `open` has seen that it is one.
            (Self::Jpeg, None) => Err("is damaged; copy it again".into()),
        }
    }
}

fn undecodable(error: impl std::fmt::Display) -> String {
    format!("cannot be decoded ({error}); save it again")
}

/// Reads a header and what the file holds beside its pixels, that of its colors only where they
/// are wanted. Of a TIFF file there is nothing else.
fn open(
    mut bytes: Box<dyn Bytes>,
    colors: bool,
) -> Result<(Header, ImageMetadata, OpenedImage), String> {
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
            let (header, mut decoder) = tiff::open(bytes)?;
            let metadata = match colors {
                true => ImageMetadata::of_tiff(&mut decoder),
                false => ImageMetadata::default(),
            };
            return Ok((header, metadata, OpenedImage::Tiff(decoder)));
        }
        Ok(format @ (ImageFormat::Jpeg | ImageFormat::Png)) => format,
        _ => return Err("is neither JPEG, PNG nor TIFF; convert it, for example to PNG".into()),
    };
    if format == ImageFormat::Jpeg {
        let mut decoder = JpegDecoder::new(bytes).map_err(undecodable)?;
        let metadata = ImageMetadata::of_jpeg(&mut decoder, colors);
        let header = Header {
            size: decoder.dimensions().into(),
            depth: Depth::Eight,
            channels: decoder.color_type().channel_count().into(),
            indexed: false,
            orientation: Orientation::of_exif(metadata.exif.as_deref()),
        };
        return Ok((header, metadata, OpenedImage::Jpeg));
    }
    let at_the_end = metadata::exif_at_the_end(&mut bytes).map_err(|error| error.to_string())?;
    let mut decoder = png::Decoder::new(bytes);
    // A few bytes of these may become many.
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(!colors);
    decoder.set_transformations(png::Transformations::EXPAND);
    let decoder = decoder.read_info().map_err(undecodable)?;
    let (color, depth) = decoder.output_color_type();
    let metadata = ImageMetadata::of_png(decoder.info(), at_the_end);
    let header = Header {
        size: decoder.info().size().into(),
        depth: match depth {
            png::BitDepth::Sixteen => Depth::Sixteen,
            _ => Depth::Eight,
        },
        channels: color.samples(),
        indexed: decoder.info().color_type == png::ColorType::Indexed,
        orientation: Orientation::of_exif(metadata.exif.as_deref()),
    };
    Ok((header, metadata, OpenedImage::Png(Box::new(decoder))))
}

/// The values of what JPEG files can hold.
fn samples_of(picture: DynamicImage) -> Result<Samples, String> {
    Ok(match picture {
        DynamicImage::ImageLuma8(p) => Samples::Eight(p.into_raw()),
        DynamicImage::ImageRgb8(p) => Samples::Eight(p.into_raw()),
        _ => return Err("holds neither gray nor RGB; convert it to 8 or 16 bits".into()),
    })
}

/// A picture of values as they stand in a file; floats become 16 bits from 0 to 1.
fn picture_of(header: Header, samples: Samples) -> Result<DynamicImage, String> {
    use DynamicImage::{
        ImageLuma8, ImageLuma16, ImageLumaA8, ImageLumaA16, ImageRgb8, ImageRgb16, ImageRgba8,
        ImageRgba16,
    };
    let [width, height] = header.size;
    let picture = match (samples, header.channels) {
        (Samples::Eight(v), 1) => ImageBuffer::from_raw(width, height, v).map(ImageLuma8),
        (Samples::Eight(v), 2) => ImageBuffer::from_raw(width, height, v).map(ImageLumaA8),
        (Samples::Eight(v), 3) => ImageBuffer::from_raw(width, height, v).map(ImageRgb8),
        (Samples::Eight(v), _) => ImageBuffer::from_raw(width, height, v).map(ImageRgba8),
        (Samples::Sixteen(v), 1) => ImageBuffer::from_raw(width, height, v).map(ImageLuma16),
        (Samples::Sixteen(v), 2) => ImageBuffer::from_raw(width, height, v).map(ImageLumaA16),
        (Samples::Sixteen(v), 3) => ImageBuffer::from_raw(width, height, v).map(ImageRgb16),
        (Samples::Sixteen(v), _) => ImageBuffer::from_raw(width, height, v).map(ImageRgba16),
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

fn failure(path: &Path) -> impl Fn(String) -> CaptureError {
    |reason| CaptureError::Photo {
        path: path.into(),
        reason,
    }
}
