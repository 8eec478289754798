//! JPEG files: what their markers tell and decoders keep to themselves, and their pixels.

use image::{DynamicImage, GrayImage, RgbImage};
use zune_jpeg::{
    JpegDecoder,
    zune_core::{bytestream::ZCursor, colorspace::ColorSpace, options::DecoderOptions},
};

/// The structure of a complete JPEG file.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Frame {
    /// Bits per component.
    pub precision: u8,
    /// Color components: 1 gray, 3 color, 4 CMYK or YCCK.
    pub components: u8,
    /// Offset of the end-of-image marker, in bytes.
    pub end: usize,
}

/// Walks the markers of a JPEG file (ITU-T T.81, annex B) from its start to the
/// end-of-image marker.
///
/// Decoders fill what a cut-off file lacks with gray and call it a success, and
/// turn CMYK into RGB without its profile: neither is a photo to train on.
/// `None` if the markers end early or name no frame.
pub(super) fn inspect(file: &[u8]) -> Option<Frame> {
    // In the range of the frame markers, but Huffman tables, an extension and
    // arithmetic conditioning.
    const NO_FRAMES: [u8; 3] = [0xc4, 0xc8, 0xcc];
    let mut frame = None;
    let mut rest = file.strip_prefix(&[0xff, 0xd8])?;
    loop {
        // Between markers lies entropy-coded data, in which 0xff is followed
        // by 0 or a restart marker; 0xff itself may be repeated as filling.
        let at = rest.iter().position(|&byte| byte == 0xff)?;
        rest = &rest[at + 1..];
        let marker = *rest.first()?;
        match marker {
            0x00 | 0x01 | 0xd0..=0xd7 => rest = &rest[1..],
            0xff => {}
            0xd9 => {
                let end = file.len() - rest.len() - 1;
                return frame.map(|frame| Frame { end, ..frame });
            }
            _ => {
                let length = u16::from_be_bytes([*rest.get(1)?, *rest.get(2)?]);
                let segment = rest.get(1..1 + usize::from(length).max(2))?;
                if (0xc0..=0xcf).contains(&marker) && !NO_FRAMES.contains(&marker) {
                    frame = Some(Frame {
                        precision: *segment.get(2)?,
                        components: *segment.get(7)?,
                        end: 0,
                    });
                }
                rest = &rest[1 + segment.len()..];
            }
        }
    }
}

/// Stuffed bytes of ones. No Huffman code consists of ones alone (T.81, annex C), so a
/// decoder that reads on after the end of the data meets what is no code.
const NO_CODE: [u8; 32] = {
    let mut bytes = [0; 32];
    let mut i = 0;
    while i < bytes.len() {
        bytes[i] = 0xff;
        i += 2;
    }
    bytes
};

/// Decodes a file whose markers are whole. Errors are what is wrong and what helps.
///
/// A file that was cut off and given an end-of-image marker by whoever saved it has too few
/// data for its pixels, and decoders make up the rest. Bits that are no code after the data
/// tell it from one that is whole, whose data a decoder does not read to their end.
pub(super) fn decode(file: &[u8], frame: &Frame) -> Result<DynamicImage, String> {
    let (data, end) = file.split_at(frame.end);
    let marked = [data, &NO_CODE, end].concat();
    if let Ok(picture) = pixels(&marked, true) {
        return Ok(picture);
    }
    if pixels(file, true).is_ok() {
        return Err("ends before its last pixels; copy it again".into());
    }
    // Not by the book, as many are that nothing lacks.
    pixels(file, false)
}

fn pixels(file: &[u8], strict: bool) -> Result<DynamicImage, String> {
    let unreadable = |error| format!("cannot be decoded ({error}); save it again");
    let options = DecoderOptions::default()
        .set_strict_mode(strict)
        .set_max_width(usize::MAX)
        .set_max_height(usize::MAX);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(file), options);
    decoder.decode_headers().map_err(unreadable)?;
    let gray = decoder.input_colorspace() == Some(ColorSpace::Luma);
    let wanted = if gray {
        ColorSpace::Luma
    } else {
        ColorSpace::RGB
    };
    decoder.set_options(decoder.options().jpeg_set_out_colorspace(wanted));
    let values = decoder.decode().map_err(unreadable)?;
    let (width, height) = decoder.dimensions().unwrap_or_default();
    // A side of a JPEG has 16 bits.
    let [width, height] = [width, height].map(|side| side as u32);
    let picture = match gray {
        true => GrayImage::from_raw(width, height, values).map(DynamicImage::from),
        false => RgbImage::from_raw(width, height, values).map(DynamicImage::from),
    };
    picture.ok_or_else(|| "has fewer pixels than its size needs; save it again".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use image::codecs::jpeg::JpegEncoder;

    fn jpeg(color: image::ExtendedColorType, components: usize) -> Vec<u8> {
        let mut file = Vec::new();
        let pixels: Vec<u8> = (0..32 * 24 * components).map(|i| (i * 7) as u8).collect();
        JpegEncoder::new(&mut file)
            .encode(&pixels, 32, 24, color)
            .unwrap();
        file
    }

    #[test]
    fn finds_the_frame() {
        let gray = jpeg(image::ExtendedColorType::L8, 1);
        let color = jpeg(image::ExtendedColorType::Rgb8, 3);
        assert_eq!(
            inspect(&gray),
            Some(Frame {
                precision: 8,
                components: 1,
                end: gray.len() - 2,
            })
        );
        assert_eq!(inspect(&color).map(|f| f.components), Some(3));
    }

    #[test]
    fn every_cut_is_noticed() {
        let file = jpeg(image::ExtendedColorType::Rgb8, 3);
        for end in 0..file.len() {
            assert_eq!(inspect(&file[..end]), None, "cut at {end}");
        }
        assert_eq!(inspect(b"\x89PNG"), None);
    }

    /// Whatever decoders make up for what is missing.
    #[test]
    fn data_that_end_early_are_noticed() {
        for (color, components) in [
            (image::ExtendedColorType::L8, 1),
            (image::ExtendedColorType::Rgb8, 3),
        ] {
            let file = jpeg(color, components);
            let whole = inspect(&file).unwrap();
            let decoded = decode(&file, &whole).unwrap();
            let reference = image::load_from_memory(&file).unwrap();
            assert_eq!(decoded, reference);
            let scan = file.windows(2).position(|pair| pair == [0xff, 0xda]);
            let data = scan.unwrap() + 10 + 2 * components;
            for end in data..whole.end {
                if file[end - 1] == 0xff {
                    // Half of a stuffed byte.
                    continue;
                }
                let cut = [&file[..end], &[0xff, 0xd9]].concat();
                let frame = inspect(&cut).unwrap();
                let told = decode(&cut, &frame).unwrap_err();
                assert!(
                    told.contains("ends before its last pixels"),
                    "{end}: {told}"
                );
            }
            let longer = [&file[..], b"a camera's own data"].concat();
            let frame = inspect(&longer).unwrap();
            assert_eq!(decode(&longer, &frame).unwrap(), reference);
        }
    }
}
