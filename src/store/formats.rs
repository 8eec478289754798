//! Bytes of pictures in color, which tell that this program made them.

use std::{
    io::{BufReader, Cursor, Read},
    path::Path,
    sync::LazyLock,
};

use exr::prelude as exr;
use half::f16;
use image::{DynamicImage, ImageBuffer, ImageEncoder, RgbImage, codecs::png::PngEncoder};
use tiff::{decoder::Decoder, encoder, tags::Tag};

use super::codec::Codec;
use crate::{
    archive::{Timecode, dpx},
    color::srgb_to_linear,
    frames::Colored,
    input,
};

/// Name of the program in the files.
const MADE_HERE: &str = env!("CARGO_PKG_NAME");

/// Place of a frame in its film, as files tell it.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FrameFacts {
    pub timecode: Option<Timecode>,
    /// Frames a second, as a fraction.
    pub rate: Option<[u32; 2]>,
    /// Number of the transfer characteristic in the source's DPX files.
    pub dpx_transfer: Option<u8>,
}

/// A picture's bytes; errors are reasons.
pub(crate) fn encode(colored: Colored, codec: Codec, facts: FrameFacts) -> Result<Vec<u8>, String> {
    let FrameFacts {
        timecode,
        rate,
        dpx_transfer,
    } = facts;
    let size = [colored.width, colored.height];
    match codec {
        Codec::Dpx => Ok(dpx::encode(
            size,
            &colored.rgb,
            timecode,
            rate,
            dpx_transfer,
        )),
        Codec::Tiff => tiff(&colored).map_err(|error| error.to_string()),
        Codec::Exr => exr(&colored).map_err(|error| error.to_string()),
        _ => png(colored),
    }
}

/// True if this program made a picture.
pub(crate) fn is_ours(path: &Path) -> bool {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let found = match &*extension {
        "dpx" => dpx::header(path).map(|header| header.is_ours),
        "tif" => software_of_tiff(path).map(|name| name == MADE_HERE),
        "exr" => software_of_exr(path).map(|name| name == MADE_HERE),
        _ => Some(is_our_png(path)),
    };
    found.unwrap_or(false)
}

fn tiff(colored: &Colored) -> Result<Vec<u8>, ::tiff::TiffError> {
    let mut bytes = Cursor::new(Vec::new());
    let mut file = encoder::TiffEncoder::new(&mut bytes)?;
    let mut image = file.new_image::<encoder::colortype::RGB16>(colored.width, colored.height)?;
    image.encoder().write_tag(Tag::Software, MADE_HERE)?;
    image.write_data(colored.rgb.as_flattened())?;
    Ok(bytes.into_inner())
}

fn software_of_tiff(path: &Path) -> Option<String> {
    let file = BufReader::new(input::open(path).ok()?);
    Decoder::new(file)
        .ok()?
        .get_tag_ascii_string(Tag::Software)
        .ok()
}

/// Light of each value of encoded sRGB in 65,535ths.
static LIGHT: LazyLock<Vec<f16>> = LazyLock::new(|| {
    let light = |value: u16| f16::from_f64(srgb_to_linear(f64::from(value) / 65_535.0));
    (0..=u16::MAX).map(light).collect()
});

fn exr(colored: &Colored) -> Result<Vec<u8>, exr::Error> {
    use exr::WritableImage;
    let width = colored.width as usize;
    let size = (width, colored.height as usize);
    let channels = exr::SpecificChannels::rgb(|place: exr::Vec2<usize>| {
        let [r, g, b] = colored.rgb[place.y() * width + place.x()].map(|v| LIGHT[usize::from(v)]);
        (r, g, b)
    });
    let about = exr::LayerAttributes {
        software_name: Some(MADE_HERE.into()),
        ..exr::LayerAttributes::default()
    };
    let encoding = exr::Encoding {
        compression: exr::Compression::ZIP16,
        ..exr::Encoding::UNCOMPRESSED
    };
    let layer = exr::Layer::new(size, about, encoding, channels);
    let image = exr::Image::from_layer(layer);
    let mut bytes = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut bytes)?;
    Ok(bytes.into_inner())
}

fn software_of_exr(path: &Path) -> Option<String> {
    input::open(path).ok()?;
    let found = exr::MetaData::read_from_file(path, false).ok()?;
    let name = found
        .headers
        .first()?
        .own_attributes
        .software_name
        .as_ref()?;
    Some(name.to_string())
}

fn png(mut colored: Colored) -> Result<Vec<u8>, String> {
    let [width, height] = [colored.width, colored.height];
    let exif = colored.exif.take();
    let image = match colored.deep {
        true => ImageBuffer::from_raw(width, height, colored.rgb.into_flattened())
            .map(DynamicImage::ImageRgb16),
        false => RgbImage::from_raw(width, height, colored.bytes()).map(DynamicImage::ImageRgb8),
    };
    let image = image.ok_or("its pixels do not fill it")?;
    let mut bytes = Vec::new();
    let mut encoder = PngEncoder::new(&mut bytes);
    let kept = exif.map_or(Ok(()), |exif| encoder.set_exif_metadata(exif));
    kept.map_err(|error| error.to_string())?;
    let written = image.write_with_encoder(encoder);
    written.map_err(|error| error.to_string())?;
    Ok(marked(bytes))
}

/// PNG: the signature and the header, which come before all else.
const PNG_HEADER: usize = 8 + 25;

/// PNG's keyword for the program that made a picture, and its value, as text chunks have them.
const TEXT: &[u8] = b"tEXtSoftware\0gs-chroma";

/// A PNG that says which program made it.
pub(crate) fn marked(mut png: Vec<u8>) -> Vec<u8> {
    let length = (TEXT.len() - 4) as u32;
    let mut sum = flate2::Crc::new();
    sum.update(TEXT);
    let chunk = [&length.to_be_bytes()[..], TEXT, &sum.sum().to_be_bytes()].concat();
    png.splice(PNG_HEADER..PNG_HEADER, chunk);
    png
}

fn is_our_png(path: &Path) -> bool {
    let mut begin = [0; PNG_HEADER + 4 + TEXT.len()];
    let read = input::open(path).and_then(|mut file| file.read_exact(&mut begin));
    read.is_ok() && begin.ends_with(TEXT)
}
