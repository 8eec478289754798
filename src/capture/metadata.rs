//! Metadata of a photo's file: EXIF and color space.

use std::io::{self, SeekFrom};

use flate2::Crc;
use image::{ImageDecoder, metadata::Orientation};
use tiff::{decoder::ifd::Value, tags::Tag};

use super::sample::Bytes;
use super::tiff::Decoder;

/// The most EXIF that is read, in bytes: what a JPEG file has room for.
const LARGEST_EXIF: usize = 1 << 16;

/// Metadata of an image file: EXIF and color space.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct ImageMetadata {
    /// EXIF from its TIFF header on.
    pub exif: Option<Vec<u8>>,
    /// An ICC profile.
    pub profile: Option<Vec<u8>>,
    /// Code points of a PNG file's primaries and transfer function (ITU-T H.273).
    pub code_points: Option<[u8; 2]>,
    /// Gamma of a PNG file that has neither an ICC profile nor an sRGB chunk.
    pub gamma: Option<f32>,
}

impl ImageMetadata {
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

    /// Metadata of a TIFF file: what its colors mean.
    pub fn of_tiff(decoder: &mut Decoder) -> Self {
        let profile = decoder.find_tag(Tag::IccProfile).transpose();
        Self {
            // One that cannot be read cannot be heeded.
            profile: profile.map(|found| found.and_then(Value::into_u8_vec).unwrap_or_default()),
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
}
