//! DPX (SMPTE ST 268): pictures of 10 bits, and what their headers tell of a film.

use std::{io::Read, path::Path};

use super::timecode::{self, Timecode};
use crate::input;

/// Bytes of the header that has all sections.
const HEADER: usize = 2048;

/// Places in the header, in bytes.
const CREATOR: usize = 160;
const IMAGE: usize = 768;
const TRANSFER: usize = 801;
const FILM_RATE: usize = 1724;
const TIMECODE: usize = 1920;
const VIDEO_RATE: usize = 1940;

/// Name of the program in the files.
const MADE_HERE: &[u8] = b"gs-chroma";

/// Transfer characteristic of usual screens (ITU-R BT.709), where nothing else is known.
const SCREEN: u8 = 6;

/// What a header tells of a film; `None` where it does not.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Header {
    pub timecode: Option<String>,
    /// Frames a second, as a fraction.
    pub rate: Option<[u32; 2]>,
    /// Number of the transfer characteristic: 1 printing density, 2 linear, 3 logarithmic.
    pub transfer: Option<u8>,
    /// True if this program wrote the file.
    pub is_ours: bool,
}

/// Reads a file's header; `None` where it is no DPX file.
pub(crate) fn header(path: &Path) -> Option<Header> {
    let mut bytes = [0xff; HEADER];
    let mut file = input::open(path).ok()?;
    file.read_exact(&mut bytes[..IMAGE]).ok()?;
    let big = match &bytes[..4] {
        b"SDPX" => true,
        b"XPDS" => false,
        _ => return None,
    };
    let word = |bytes: &[u8], at: usize| {
        let word = [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]];
        if big {
            u32::from_be_bytes(word)
        } else {
            u32::from_le_bytes(word)
        }
    };
    // Short headers end where the pixels begin.
    let end = (word(&bytes, 4) as usize).clamp(IMAGE, HEADER);
    file.read_exact(&mut bytes[IMAGE..end]).ok()?;
    let rate = |at: usize| fraction(f32::from_bits(word(&bytes, at)));
    let digits = Some(word(&bytes, TIMECODE)).filter(|&digits| digits != u32::MAX);
    Some(Header {
        timecode: digits.map(timecode::text),
        rate: rate(FILM_RATE).or(rate(VIDEO_RATE)),
        transfer: Some(bytes[TRANSFER]).filter(|&transfer| transfer < u8::MAX),
        is_ours: bytes[CREATOR..].starts_with(MADE_HERE),
    })
}

/// A rate as a fraction: whole, of 1001ths, or to the thousandth.
fn fraction(rate: f32) -> Option<[u32; 2]> {
    let rate = f64::from(rate);
    if !(rate > 0.5 && rate < 1000.0) {
        return None;
    }
    let near = |value: f64| (value - value.round()).abs() < 1e-3;
    Some(match (near(rate), near(1.001 * rate)) {
        (true, _) => [rate.round() as u32, 1],
        (_, true) => [1000 * (1.001 * rate).round() as u32, 1001],
        _ => [(1000.0 * rate).round() as u32, 1000],
    })
}

/// The bytes of a file of 10 bits: `rgb` in 65,535ths, `[height, width]`, with its time code, its
/// rate and the transfer characteristic of its source.
pub(crate) fn encode(
    [width, height]: [u32; 2],
    rgb: &[[u16; 3]],
    timecode: Option<Timecode>,
    rate: Option<[u32; 2]>,
    transfer: Option<u8>,
) -> Vec<u8> {
    // All bits of a field set: its value is unknown.
    let mut bytes = vec![0xff; HEADER];
    let mut put = |at: usize, value: &[u8]| bytes[at..at + value.len()].copy_from_slice(value);
    let size = (HEADER + 4 * rgb.len()) as u32;
    let long = |value: u32| value.to_be_bytes();
    put(0, b"SDPX");
    put(4, &long(HEADER as u32));
    put(8, b"V2.0\0\0\0\0");
    put(16, &long(size));
    // Bytes of the sections that all files have, and of those for film and video.
    put(24, &[long(1664), long(384), long(0)].concat());
    put(36, &[0; 624]);
    put(CREATOR, MADE_HERE);
    // Left to right, top to bottom; one element: R, G and B, filled up to 32 bits.
    put(IMAGE, &[0, 0, 0, 1]);
    put(772, &[long(width), long(height), long(0)].concat());
    let transfer = transfer.unwrap_or(SCREEN);
    put(800, &[50, transfer, SCREEN, 10, 0, 1, 0, 0]);
    put(808, &[long(HEADER as u32), long(0), long(0)].concat());
    put(1628, &[long(1), long(1)].concat());
    if let Some([frames, seconds]) = rate {
        let rate = long((frames as f32 / seconds as f32).to_bits());
        put(FILM_RATE, &rate);
        put(VIDEO_RATE, &rate);
    }
    if let Some(timecode) = timecode {
        // Not interlaced.
        put(
            TIMECODE,
            &[long(timecode.digits()), long(0), [0, 0xff, 0xff, 0xff]].concat(),
        );
    }
    bytes.reserve(4 * rgb.len());
    for pixel in rgb {
        let [r, g, b] = pixel.map(|value| (u32::from(value) * 1023 + 32_767) / 65_535);
        bytes.extend(long(r << 22 | g << 12 | b << 2));
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_header_is_read_as_it_was_written() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.dpx");
        let code = Timecode::parse("01:02:03:04", [16, 1]);
        for rate in [[16, 1], [24000, 1001], [18, 1], [16667, 1000]] {
            let bytes = encode([1, 1], &[[0, 32_768, 65_535]], code, Some(rate), Some(3));
            assert_eq!(bytes[HEADER..], (512 << 12 | 1023_u32 << 2).to_be_bytes());
            std::fs::write(&path, bytes).expect("writable");
            let expected = Header {
                timecode: Some("01:02:03:04".to_owned()),
                rate: Some(rate),
                transfer: Some(3),
                is_ours: true,
            };
            assert_eq!(header(&path), Some(expected));
        }
        std::fs::write(&path, encode([1, 1], &[[0; 3]], None, None, None)).expect("writable");
        let plain = header(&path).expect("a header");
        assert_eq!((plain.timecode, plain.rate), (None, None));
        std::fs::write(&path, "no picture").expect("writable");
        assert_eq!(header(&path), None);
    }
}
