//! What a photo's file holds beside its pixels: EXIF, and what its colors mean.

use std::io::{self, SeekFrom};

use flate2::Crc;
use image::{ImageDecoder, metadata::Orientation};
use tiff::{
    TiffResult,
    decoder::IfdDecoder,
    encoder::TiffEncoder,
    tags::{ByteOrder, Tag, Type, ValueBuffer},
};

use super::sample::Bytes;
use super::tiff::Decoder;

/// The most EXIF that is read, in bytes: what a JPEG file has room for.
const LARGEST_EXIF: usize = 1 << 16;

/// TIFF tags that describe a photo: description, make, model, software, date, artist, copyright.
const TOLD: [u16; 7] = [270, 271, 272, 305, 306, 315, 33_432];

/// Tags that lead elsewhere in the file: a maker's own notes, and what they can be used for.
const LEADING_AWAY: [u16; 2] = [37_500, 40_965];

/// Metadata of an image file: EXIF and color space.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Beside {
    /// EXIF from its TIFF header on.
    pub exif: Option<Vec<u8>>,
    /// An ICC profile.
    pub profile: Option<Vec<u8>>,
    /// Code points of a PNG file's primaries and transfer function (ITU-T H.273).
    pub code_points: Option<[u8; 2]>,
    /// Gamma of a PNG file that has neither an ICC profile nor an sRGB chunk.
    pub gamma: Option<f32>,
}

impl Beside {
    /// Metadata of a PNG file, from its header; EXIF also from the end of the file.
    pub fn of_png(info: &png::Info<'_>, exif_at_the_end: Option<Vec<u8>>) -> Self {
        let exif = info.exif_metadata.as_deref().map(without_prefix);
        let points = info.coding_independent_code_points;
        let unexplained = info.srgb.is_none() && info.icc_profile.is_none();
        Self {
            exif: exif.or(exif_at_the_end),
            profile: info.icc_profile.as_deref().map(<[u8]>::to_vec),
            code_points: points.map(|found| [found.color_primaries, found.transfer_function]),
            gamma: info
                .gama_chunk
                .filter(|_| unexplained)
                .map(|found| found.into_value()),
        }
    }

    /// Metadata of a JPEG file, with its ICC profile only if `wanted`.
    pub fn of_jpeg(decoder: &mut impl ImageDecoder, wanted: bool) -> Self {
        let profile = if wanted {
            decoder.icc_profile()
        } else {
            Ok(None)
        };
        Self {
            exif: decoder.exif_metadata().ok().flatten(),
            profile: profile.ok().flatten(),
            ..Self::default()
        }
    }

    /// Metadata of a TIFF file.
    pub fn of_tiff(decoder: &mut Decoder) -> Self {
        let profile = match value(decoder.image_ifd(), Tag::IccProfile) {
            Ok(found) => found.map(|value| value.as_bytes().to_vec()),
            // There is one, and it cannot be heeded.
            Err(_) => Some(Vec::new()),
        };
        Self {
            exif: exif_of_tiff(decoder),
            profile,
            ..Self::default()
        }
    }
}

/// EXIF for the same picture with its pixels upright and without a thumbnail; none where nothing
/// can be made of it.
pub(super) fn for_upright(mut exif: Vec<u8>) -> Option<Vec<u8>> {
    if exif.len() > LARGEST_EXIF {
        return None;
    }
    let big = match exif.get(..4)? {
        b"II*\0" => false,
        b"MM\0*" => true,
        _ => return None,
    };
    let field = |exif: &[u8], at: usize, length: usize| -> Option<usize> {
        let bytes = exif.get(at..at.checked_add(length)?)?.iter();
        let add = |sum: usize, &byte: &u8| sum << 8 | usize::from(byte);
        Some(match big {
            true => bytes.fold(0, add),
            false => bytes.rev().fold(0, add),
        })
    };
    let directory = field(&exif, 4, 4)?;
    let next = directory + 2 + 12 * field(&exif, directory, 2)?;
    exif.get_mut(next..next + 4)?.fill(0);
    // Which one it was is known.
    let _ = Orientation::remove_from_exif_chunk(&mut exif);
    Some(exif)
}

/// EXIF as some write it into PNG files: as in JPEG files.
fn without_prefix(exif: &[u8]) -> Vec<u8> {
    exif.strip_prefix(b"Exif\0\0").unwrap_or(exif).to_vec()
}

/// The `eXIf` chunk behind a PNG file's pixels, where some programs write it: looked for from the
/// end, since the pixels may be many chunks. Comes back to the file's beginning.
pub(super) fn exif_at_the_end(bytes: &mut dyn Bytes) -> io::Result<Option<Vec<u8>>> {
    let length = bytes.seek(SeekFrom::End(0))?;
    bytes.seek(SeekFrom::Start(
        length.saturating_sub(2 * LARGEST_EXIF as u64),
    ))?;
    let mut tail = Vec::new();
    bytes.read_to_end(&mut tail)?;
    bytes.rewind()?;
    let found = || {
        let at = tail.windows(4).rposition(|kind| kind == b"eXIf")?;
        let length = tail[..at].last_chunk().copied().map(u32::from_be_bytes)?;
        let end = (at + 4).checked_add(length as usize)?;
        let (data, rest) = (tail.get(at + 4..end)?, tail.get(end..)?);
        let mut crc = Crc::new();
        crc.update(tail.get(at..end)?);
        let whole = rest.first_chunk().copied().map(u32::from_be_bytes) == Some(crc.sum());
        whole.then(|| without_prefix(data))
    };
    Ok(found())
}

/// The value of a tag, in this machine's byte order.
fn value(mut directory: IfdDecoder<'_>, tag: Tag) -> TiffResult<Option<ValueBuffer>> {
    let mut value = ValueBuffer::empty(Type::BYTE);
    let found = directory.find_tag_buf(tag, &mut value)?;
    value.set_byte_order(ByteOrder::native());
    Ok(found.map(|_| value))
}

/// An EXIF block with what a TIFF file tells.
fn exif_of_tiff(decoder: &mut Decoder) -> Option<Vec<u8>> {
    let mut file = io::Cursor::new(Vec::new());
    let mut encoder = TiffEncoder::new(&mut file).ok()?;
    let mut parts = Vec::new();
    for part in [Tag::ExifDirectory, Tag::GpsDirectory] {
        let Ok(pointer) = decoder.get_tag(part).and_then(|at| at.into_ifd_pointer()) else {
            continue;
        };
        let directory = decoder.read_directory(pointer).ok()?;
        let mut told = encoder.extra_directory().ok()?;
        let tags = directory.iter().map(|(tag, _)| tag);
        for tag in tags.filter(|tag| !LEADING_AWAY.contains(&tag.to_u16())) {
            let known = decoder.read_directory_tags(&directory);
            if let Ok(Some(value)) = value(known, tag) {
                told.write_tag_buf(tag, &value).ok()?;
            }
        }
        parts.push((part, told.finish_with_offsets().ok()?.offset));
    }
    let mut told = encoder.image_directory().ok()?;
    let mut any = !parts.is_empty();
    for tag in TOLD.map(Tag::from_u16_exhaustive) {
        if let Ok(Some(value)) = value(decoder.image_ifd(), tag) {
            told.write_tag_buf(tag, &value).ok()?;
            any = true;
        }
    }
    for (part, offset) in parts {
        told.write_tag(part, offset).ok()?;
    }
    told.finish().ok()?;
    any.then(|| file.into_inner())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An EXIF block of one tag, an orientation of 6, with the offset of a thumbnail.
    fn exif(big: bool) -> Vec<u8> {
        match big {
            false => b"II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\x1a\0\0\0".to_vec(),
            true => b"MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0\x06\0\0\0\0\0\x1a".to_vec(),
        }
    }

    #[test]
    fn exif_of_upright_pictures_has_neither_orientation_nor_thumbnail() {
        for big in [false, true] {
            let mut wanted = exif(big);
            wanted[if big { 19 } else { 18 }] = 1;
            wanted[22..].fill(0);
            assert_eq!(for_upright(exif(big)), Some(wanted));
            for end in 0..exif(big).len() {
                assert_eq!(for_upright(exif(big)[..end].to_vec()), None);
            }
        }
        assert_eq!(for_upright(b"II*\0\xff\xff\xff\xff".to_vec()), None);
    }

    #[test]
    fn exif_behind_the_pixels_is_found() {
        let chunk = |data: &[u8]| {
            let mut crc = Crc::new();
            crc.update(b"eXIf");
            crc.update(data);
            let length = (data.len() as u32).to_be_bytes();
            [&length, b"eXIf", data, &crc.sum().to_be_bytes()].concat()
        };
        let found = |file: Vec<u8>| exif_at_the_end(&mut io::Cursor::new(file)).unwrap();
        let file = [b"pixels", &*chunk(&exif(true)), b"\0\0\0\0IEND"].concat();
        assert_eq!(found(file.clone()), Some(exif(true)));
        let mut damaged = file;
        damaged[20] ^= 1;
        assert_eq!(found(damaged), None);
        assert_eq!(found(b"eXIf".to_vec()), None);
    }

    #[test]
    fn tiff_files_tell_who_took_the_photo_and_when() {
        let mut file = io::Cursor::new(Vec::new());
        let mut encoder = TiffEncoder::new(&mut file).unwrap();
        let mut told = encoder.extra_directory().unwrap();
        told.write_tag(Tag::from_u16_exhaustive(36_867), "1931:05:01 10:00:00")
            .unwrap();
        let told = told.finish_with_offsets().unwrap().offset;
        let mut picture = encoder
            .new_image::<tiff::encoder::colortype::Gray8>(9, 7)
            .unwrap();
        let tags = picture.encoder();
        tags.write_tag(Tag::Make, "Maker").unwrap();
        tags.write_tag(Tag::Orientation, 6_u16).unwrap();
        tags.write_tag(Tag::ExifDirectory, told).unwrap();
        picture.write_data(&[1; 63]).unwrap();
        file.set_position(0);
        let (header, mut decoder) = super::super::tiff::open(Box::new(file)).unwrap();
        assert_eq!(header.orientation.size(header.size), [7, 9]);
        let exif = Beside::of_tiff(&mut decoder)
            .exif
            .and_then(for_upright)
            .unwrap();
        let says = |words: &[u8]| exif.windows(words.len()).any(|found| found == words);
        assert!(says(b"Maker\0") && says(b"1931:05:01 10:00:00\0"));
        assert!(Orientation::from_exif_chunk(&exif).is_none());
    }
}
