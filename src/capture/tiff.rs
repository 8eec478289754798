//! TIFF files: the first full picture of one, gray or RGB, of integers or floats.

use tiff::ColorType;
use tiff::decoder::{DecodingResult, DecodingSampleType, Limits};
use tiff::tags::Tag;

use super::orientation::Orientation;
use super::sample::{Bytes, Depth, Header, LARGEST_FILE, Samples};

/// A TIFF file whose header has been read.
pub(super) type Decoder = Box<tiff::decoder::Decoder<Box<dyn Bytes>>>;

/// The tag's value where each channel is a picture of its own.
const PLANAR: u16 = 2;

/// The tag that makes a TIFF file a DNG.
const DNG_VERSION: u16 = 50_706;

/// The bit of NewSubfileType that says that the picture is a smaller one of another.
const REDUCED: u32 = 1;

/// Reads the header. Errors are what is wrong and what helps.
pub(super) fn open(bytes: Box<dyn Bytes>) -> Result<(Header, Decoder), String> {
    let mut limits = Limits::default();
    // Doubles take twice what their floats will.
    limits.decoding_buffer_size = 2 * LARGEST_FILE as usize;
    limits.intermediate_buffer_size = limits.decoding_buffer_size;
    let decoder = tiff::decoder::Decoder::new(bytes).map_err(unreadable)?;
    let mut decoder = Box::new(decoder.with_limits(limits.clone()));
    find_full_picture(&mut decoder)?;
    let (width, height) = decoder.dimensions().map_err(unreadable)?;
    let (bits, channels) = match decoder.colortype().map_err(unreadable)? {
        ColorType::Gray(bits) => (bits, 1),
        ColorType::GrayA(bits)
        | ColorType::Multiband {
            bit_depth: bits,
            num_samples: 2,
        } => (bits, 2),
        ColorType::RGB(bits) => (bits, 3),
        ColorType::RGBA(bits) => (bits, 4),
        other => {
            return Err(format!(
                "holds neither gray nor RGB but {other:?}; convert it"
            ));
        }
    };
    let planes: Option<u16> = decoder
        .find_tag_unsigned(Tag::PlanarConfiguration)
        .map_err(unreadable)?;
    if channels > 1 && planes == Some(PLANAR) {
        return Err("keeps its channels apart; save it with interleaved (chunky) channels".into());
    }
    let layout = decoder.image_buffer_layout().map_err(unreadable)?;
    let depth = match (layout.sample_type, bits) {
        (Some(DecodingSampleType::U8), 8) => Depth::Eight,
        (Some(DecodingSampleType::U16), 16) => Depth::Sixteen,
        (Some(DecodingSampleType::F16 | DecodingSampleType::F32 | DecodingSampleType::F64), _) => {
            Depth::Float
        }
        _ => {
            return Err(format!(
                "has {bits}-bit samples of a kind that is not read; convert it to 8 or 16 bits without sign, or to floats"
            ));
        }
    };
    // Strips or tiles may announce more than the picture that they make up; twice as much is
    // what is left over at its borders.
    let bytes = u64::from(width) * u64::from(height) * channels as u64 * u64::from(bits) / 8;
    limits.decoding_buffer_size = bytes.min(2 * LARGEST_FILE) as usize;
    limits.intermediate_buffer_size = 2 * limits.decoding_buffer_size;
    let size = [width, height];
    // A value of another kind says nothing.
    let orientation = decoder.find_tag_unsigned(Tag::Orientation).ok().flatten();
    Ok((
        Header {
            size,
            depth,
            channels,
            indexed: false,
            orientation: Orientation::of_tag(orientation.unwrap_or_default()),
        },
        Box::new(decoder.with_limits(limits)),
    ))
}

/// Goes to the first picture of the file that is not a thumbnail.
fn find_full_picture(decoder: &mut Decoder) -> Result<(), String> {
    let version = decoder.find_tag(Tag::Unknown(DNG_VERSION));
    if version.map_err(unreadable)?.is_some() {
        return Err("is a camera's raw file (DNG); develop it to TIFF or PNG".into());
    }
    loop {
        let kind = decoder.find_tag_unsigned::<u32>(Tag::NewSubfileType);
        if kind.map_err(unreadable)?.unwrap_or(0) & REDUCED == 0 {
            return Ok(());
        }
        if !decoder.more_images() {
            return Err(
                "holds thumbnails, and no full picture beside them that is read; save it as a plain TIFF or PNG"
                    .into(),
            );
        }
        decoder.next_image().map_err(unreadable)?;
    }
}

/// Decodes the picture. Errors are what is wrong and what helps.
pub(super) fn samples(decoder: &mut Decoder, header: Header) -> Result<Samples, String> {
    let samples = match decoder.read_image().map_err(unreadable)? {
        DecodingResult::U8(values) => Samples::Eight(values),
        DecodingResult::U16(values) => Samples::Sixteen(values),
        DecodingResult::F32(values) => Samples::Float(values),
        DecodingResult::F16(values) => Samples::Float(values.into_iter().map(f32::from).collect()),
        DecodingResult::F64(values) => {
            Samples::Float(values.into_iter().map(|v| v as f32).collect())
        }
        // `open` lets nothing else pass.
        _ => return Err("has samples of a kind that is not read; convert it".into()),
    };
    let count = match &samples {
        Samples::Eight(values) => values.len(),
        Samples::Sixteen(values) => values.len(),
        Samples::Float(values) => values.len(),
    };
    let [width, height] = header.size.map(|side| side as usize);
    if count != width * height * header.channels {
        return Err("has fewer samples than its size needs; save it again".into());
    }
    Ok(samples)
}

fn unreadable(error: tiff::TiffError) -> String {
    format!("cannot be decoded ({error}); save it again")
}
