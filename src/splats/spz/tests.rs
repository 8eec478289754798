//! Bytes of headers and parts, against the specification and not against the writer.

use std::io::{Read, Write};
use std::path::Path;

use flate2::{Compression, read::GzDecoder, write::GzEncoder};

use super::*;
use crate::splats::{ReadSplats, ShField, SplatError, Splats, SpzVersion, WriteOptions};

/// One Gaussian whose bytes can be told by hand.
fn one() -> Splats {
    Splats {
        means: vec![[1.0, -0.5, 2.0]],
        quats: vec![[0.5, 0.5, -0.5, 0.5]],
        log_scales: vec![[-10.0, -2.0, 0.0]],
        opacity_logits: vec![0.0],
        sh: ShField {
            degree: 1,
            channels: 3,
            coefficients: vec![
                0.0, 1.0, -1.0, 0.5, -0.5, 0.0, 0.25, -0.25, 0.0, 0.125, 1.0, -1.0,
            ],
        },
    }
}

fn file(spz: SpzVersion, antialiased: bool) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("one.spz");
    let options = WriteOptions {
        spz,
        antialiased,
        ..WriteOptions::default()
    };
    crate::splats::write_splats(&path, &one(), &options).unwrap();
    std::fs::read(path).unwrap()
}

fn read_one(bytes: &[u8]) -> Result<ReadSplats, SplatError> {
    read(Path::new("one.spz"), bytes)
}

/// Header and parts of version 2 or 3, or 1 with centers of 16-bit floats.
fn packed(version: u32, parts: &[&[u8]]) -> Vec<u8> {
    let mut bytes = b"NGSP".to_vec();
    bytes.extend(version.to_le_bytes());
    bytes.extend([1, 0, 0, 0, 0, 12, 0, 0]);
    bytes.extend(parts.concat());
    let mut stream = GzEncoder::new(Vec::new(), Compression::fast());
    stream.write_all(&bytes).unwrap();
    stream.finish().unwrap()
}

#[test]
fn version_3_is_one_gzip_stream() {
    let mut bytes = Vec::new();
    GzDecoder::new(&file(SpzVersion::V3, true)[..])
        .read_to_end(&mut bytes)
        .unwrap();
    assert_eq!(bytes[..12], *b"NGSP\x03\0\0\0\x01\0\0\0");
    // Degree 1, steps of less than e^-2 / 256, antialiased.
    assert_eq!(bytes[12..16], [1, 11, 1, 0]);
    let fixed = |value: f64| ((value * f64::from(1 << 11)) as i32).to_le_bytes();
    let centers = [1.0, -0.5, 2.0].map(fixed);
    let centers: Vec<u8> = centers
        .iter()
        .flat_map(|bytes| &bytes[..3])
        .copied()
        .collect();
    assert_eq!(bytes[16..25], centers);
    // Opacity ½; colors ½, ½ + 0.15, ½ - 0.15; scales 0, 8 · 16, 10 · 16.
    assert_eq!(bytes[25..32], [128, 128, 166, 89, 0, 128, 160]);
    // x is the first of the largest, 511 · ½ / √½ = 361 the others; -0.5 is y.
    let word = u32::from_le_bytes(bytes[32..36].try_into().unwrap());
    assert_eq!(word >> 30, 0);
    assert_eq!([20, 10, 0].map(|shift| word >> shift & 0x1ff), [361; 3]);
    assert_eq!([29, 19, 9].map(|shift| word >> shift & 1), [1, 0, 0]);
    // 128 + 128 value.
    assert_eq!(bytes[36..], [192, 64, 128, 160, 96, 128, 144, 255, 0]);
}

#[test]
fn version_4_is_a_table_and_six_streams() {
    let bytes = file(SpzVersion::V4, false);
    assert_eq!(bytes[..12], *b"NGSP\x04\0\0\0\x01\0\0\0");
    assert_eq!(bytes[12..20], [1, 11, 0, 6, 32, 0, 0, 0]);
    assert_eq!(bytes[20..32], [0; 12]);
    let number = |at: usize| u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
    let mut at = 32 + 6 * 16;
    let mut plain = Vec::new();
    for (row, expected) in [9, 1, 3, 3, 4, 9].into_iter().enumerate() {
        let (compressed, size) = (number(32 + 16 * row), number(40 + 16 * row));
        assert_eq!(size, expected);
        plain.extend(zstd::decode_all(&bytes[at..at + compressed]).unwrap());
        at += compressed;
    }
    assert_eq!(at, bytes.len());
    let mut older = Vec::new();
    GzDecoder::new(&file(SpzVersion::V3, false)[..])
        .read_to_end(&mut older)
        .unwrap();
    assert_eq!(plain, older[16..]);
}

#[test]
fn older_versions_are_read() {
    let rest: &[&[u8]] = &[&[255], &[255, 0, 128], &[160, 160, 176], &[128, 255, 128]];
    let half = [1.5_f32, -0.25, 100.0].map(|v| half::f16::from_f32(v).to_le_bytes());
    let first = packed(1, &[&[half.as_flattened()], rest].concat());
    let second = packed(
        2,
        &[&[&[0, 16, 0, 0, 0, 255, 255, 255, 255][..]], rest].concat(),
    );
    let [first, second] = [first, second].map(|bytes| read_one(&bytes).unwrap().splats);
    assert_eq!(first.means, [[1.5, -0.25, 100.0]]);
    // In 4096ths: 4096, -65536, -1.
    assert_eq!(second.means, [[1.0, -16.0, -1.0 / 4096.0]]);
    assert_eq!(second.log_scales, [[0.0, 0.0, 1.0]]);
    let [w, x, y, z] = second.quats[0];
    assert!(w < 0.01 && y == 1.0 && x.abs() < 0.01 && z.abs() < 0.01);
    let color = second.sh.coefficients[0];
    assert!((color - 0.5 / 0.15).abs() < 1e-6, "{color}");
}

#[test]
fn headers_that_are_refused() {
    let refused = |bytes: &[u8], words: &str| {
        let message = read_one(bytes).unwrap_err().to_string();
        assert!(message.contains(words), "{words}: {message}");
    };
    let sound = file(SpzVersion::V4, false);
    let with = |at: usize, value: u8| {
        let mut bytes = sound.clone();
        bytes[at] = value;
        bytes
    };
    refused(&with(4, 5), "version: 5 is not read");
    refused(&with(4, 3), "version 3 without a gzip stream");
    refused(&with(11, 200), "count: 3355443201 Gaussians are more than");
    refused(&with(12, 4), "SH degree: 4 is above 3");
    refused(&with(13, 31), "fractional bits");
    refused(&with(15, 5), "table of streams: 5 streams");
    refused(&with(40, 8), "stream 0 has 8 bytes, not 9");
    refused(&with(33, 200), "stream 0 goes beyond the end");
    refused(&with(128, 0), "streams: stream 0");
    refused(
        b"\x1f\x8b\x08\0\0\0\0\0\0\xffno",
        "header: neither NGSP nor",
    );
    refused(&packed(4, &[]), "version 4 in a gzip stream");
    refused(
        &packed(3, &[&[0; 19]]),
        "19 bytes where 1 Gaussians take 20",
    );
}

/// A small file that announces what would fill the memory.
#[test]
fn bombs_do_not_go_off() {
    let mut bytes = b"NGSP\x03\0\0\0".to_vec();
    bytes.extend(100_000_000_u32.to_le_bytes());
    bytes.extend([3, 12, 0, 0]);
    bytes.resize(20_000_000, 0);
    let mut stream = GzEncoder::new(Vec::new(), Compression::best());
    stream.write_all(&bytes).unwrap();
    let message = read_one(&stream.finish().unwrap()).unwrap_err().to_string();
    assert!(
        message.contains("100000000 Gaussians are more than"),
        "{message}"
    );
}
