//! What a photo's file holds beside its pixels: EXIF, and what its colors mean.

use std::io::{self, Read, SeekFrom};

use flate2::{Crc, read::ZlibDecoder};
use image::{ImageFormat, metadata::Orientation};
use tiff::{encoder::TiffEncoder, tags::ByteOrder, tags::Tag, tags::Type, tags::ValueBuffer};

use super::sample::Bytes;
use super::tiff::Decoder;

/// The most of a color profile that is read, in bytes: printers' take some million.
const LARGEST_PROFILE: u64 = 4 << 20;

/// The most EXIF that is read, in bytes: what a JPEG file has room for.
const LARGEST_EXIF: usize = 1 << 16;

/// What a TIFF file tells of a photo: its texts, who took it with what and when.
const TOLD: [u16; 7] = [270, 271, 272, 305, 306, 315, 33_432];

/// Tags that lead elsewhere in the file: a maker's own notes, and what they can be used for.
const LEADING_AWAY: [u16; 2] = [37_500, 40_965];

/// What a file holds beside its pixels.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Beside {
    /// EXIF from its TIFF header on.
    pub exif: Option<Vec<u8>>,
    /// An ICC profile.
    pub profile: Option<Vec<u8>>,
    /// Of a PNG file the code points of its primaries and of its transfer function (ITU-T H.273).
    pub code_points: Option<[u8; 2]>,
    /// Of a PNG file whose colors nothing else explains, 100,000 times its gamma.
    pub gamma: Option<u32>,
}

impl Beside {
    /// Reads what a JPEG or PNG file holds, of colors only where they are `wanted`, and comes back
    /// to its beginning. What is damaged is not there.
    ///
    /// # Errors
    /// If it cannot be read.
    pub fn read(bytes: &mut dyn Bytes, format: ImageFormat, colors: bool) -> io::Result<Self> {
        let mut found = Self::default();
        let read = match format {
            ImageFormat::Jpeg => found.read_jpeg(bytes, colors),
            _ => found.read_png(bytes, colors),
        };
        if let Err(error) = read
            && error.kind() != io::ErrorKind::UnexpectedEof
        {
            return Err(error);
        }
        bytes.rewind()?;
        found.exif.take_if(|exif| exif.len() > LARGEST_EXIF);
        Ok(found)
    }

    fn read_jpeg(&mut self, bytes: &mut dyn Bytes, colors: bool) -> io::Result<()> {
        let mut pieces: Vec<(u8, Vec<u8>)> = Vec::new();
        bytes.seek_relative(2)?;
        loop {
            let mut marker = [0; 2];
            bytes.read_exact(&mut marker)?;
            while marker[1] == 0xff {
                bytes.read_exact(&mut marker[1..])?;
            }
            if marker[0] != 0xff || matches!(marker[1], 0xd9 | 0xda) {
                break;
            }
            let [high, low] = number(bytes)?;
            let length = u16::from_be_bytes([high, low]).saturating_sub(2);
            if !(marker[1] == 0xe1 || colors && marker[1] == 0xe2) {
                bytes.seek_relative(length.into())?;
                continue;
            }
            let segment = taken(bytes, length.into())?;
            if let Some(exif) = segment.strip_prefix(b"Exif\0\0") {
                self.exif.get_or_insert_with(|| exif.to_vec());
            } else if let Some([place, _, piece @ ..]) = segment.strip_prefix(b"ICC_PROFILE\0") {
                pieces.push((*place, piece.to_vec()));
            }
        }
        pieces.sort_by_key(|(place, _)| *place);
        let profile: Vec<u8> = pieces.into_iter().flat_map(|(_, piece)| piece).collect();
        self.profile = Some(profile).filter(|profile| !profile.is_empty());
        Ok(())
    }

    fn read_png(&mut self, bytes: &mut dyn Bytes, colors: bool) -> io::Result<()> {
        let mut explained = false;
        bytes.seek_relative(8)?;
        loop {
            let length = u32::from_be_bytes(number(bytes)?);
            let kind = number(bytes)?;
            if matches!(&kind, b"IDAT" | b"IEND") {
                break;
            }
            let of_colors = matches!(&kind, b"iCCP" | b"cICP" | b"sRGB" | b"gAMA");
            let wanted = &kind == b"eXIf" || colors && of_colors;
            if !wanted || u64::from(length) > LARGEST_PROFILE {
                bytes.seek_relative(i64::from(length) + 4)?;
                continue;
            }
            let chunk = taken(bytes, length.into())?;
            let _checksum: [u8; 4] = number(bytes)?;
            explained |= matches!(&kind, b"iCCP" | b"cICP" | b"sRGB");
            match (&kind, chunk.as_slice()) {
                (b"eXIf", _) => self.exif = Some(without_prefix(&chunk)),
                (b"iCCP", _) => self.profile = inflated(&chunk),
                (b"cICP", &[primaries, transfer, ..]) => {
                    self.code_points = Some([primaries, transfer]);
                }
                (b"gAMA", &[a, b, c, d]) => self.gamma = Some(u32::from_be_bytes([a, b, c, d])),
                _ => {}
            }
        }
        self.gamma.take_if(|_| explained);
        if self.exif.is_none() {
            self.exif = exif_at_the_end(bytes)?;
        }
        Ok(())
    }

    /// What a TIFF file holds.
    pub fn of_tiff(decoder: &mut Decoder) -> Self {
        let profile = decoder.get_tag_u8_vec(Tag::IccProfile).ok();
        Self {
            exif: exif_of_tiff(decoder).filter(|exif| exif.len() <= LARGEST_EXIF),
            profile,
            ..Self::default()
        }
    }
}

/// EXIF for the same picture with its pixels upright and without a thumbnail; none where nothing
/// can be made of it.
pub(super) fn for_upright(mut exif: Vec<u8>) -> Option<Vec<u8>> {
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

fn number<const N: usize>(bytes: &mut dyn Bytes) -> io::Result<[u8; N]> {
    let mut number = [0; N];
    bytes.read_exact(&mut number)?;
    Ok(number)
}

/// So many bytes, which may be fewer at the end of a file.
fn taken(bytes: &mut dyn Bytes, length: u64) -> io::Result<Vec<u8>> {
    let mut taken = Vec::new();
    bytes.take(length).read_to_end(&mut taken)?;
    Ok(taken)
}

/// EXIF as some write it into PNG files: as in JPEG files.
fn without_prefix(exif: &[u8]) -> Vec<u8> {
    exif.strip_prefix(b"Exif\0\0").unwrap_or(exif).to_vec()
}

/// The profile of an `iCCP` chunk: a name, 0, the method 0 and a zlib stream.
fn inflated(chunk: &[u8]) -> Option<Vec<u8>> {
    let name = chunk.iter().position(|&byte| byte == 0)?;
    let mut profile = Vec::new();
    let stream = ZlibDecoder::new(chunk.get(name + 2..)?);
    let read = stream.take(LARGEST_PROFILE).read_to_end(&mut profile);
    read.ok().map(|_| profile)
}

/// The `eXIf` chunk behind a PNG file's pixels, where some programs write it: looked for from the
/// end, since the pixels may be many chunks.
fn exif_at_the_end(bytes: &mut dyn Bytes) -> io::Result<Option<Vec<u8>>> {
    let length = bytes.seek(SeekFrom::End(0))?;
    bytes.seek(SeekFrom::Start(
        length.saturating_sub(2 * LARGEST_EXIF as u64),
    ))?;
    let tail = taken(bytes, length)?;
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
            let mut value = ValueBuffer::empty(Type::BYTE);
            let mut known = decoder.read_directory_tags(&directory);
            if let Ok(Some(_)) = known.find_tag_buf(tag, &mut value) {
                value.set_byte_order(ByteOrder::native());
                told.write_tag_buf(tag, &value).ok()?;
            }
        }
        parts.push((part, told.finish_with_offsets().ok()?.offset));
    }
    let mut told = encoder.image_directory().ok()?;
    let mut any = !parts.is_empty();
    for tag in TOLD.map(Tag::from_u16_exhaustive) {
        let mut value = ValueBuffer::empty(Type::BYTE);
        if let Ok(Some(_)) = decoder.image_ifd().find_tag_buf(tag, &mut value) {
            value.set_byte_order(ByteOrder::native());
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
