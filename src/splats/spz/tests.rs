//! Bytes of headers and parts, against the specification and not against the writer.

use std::io::{Read, Write};
use std::path::Path;

use flate2::{Compression, read::GzDecoder, write::GzEncoder};
use ruzstd::encoding::{CompressionLevel, compress_to_vec};

use super::*;
use crate::splats::{ReadSplats, ShField, SplatError, Splats, WriteOptions};

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

fn file(antialiased: bool) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("one.spz");
    let options = WriteOptions {
        antialiased,
        ..WriteOptions::default()
    };
    crate::splats::write_splats(&path, &one(), &options).unwrap();
    std::fs::read(path).unwrap()
}

fn unzipped(file: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    GzDecoder::new(file).read_to_end(&mut bytes).unwrap();
    bytes
}

/// The same of version 4.
fn version_4() -> Vec<u8> {
    let plain = unzipped(&file(false));
    let (mut bytes, mut parts) = (plain[..HEADER].to_vec(), &plain[HEADER..]);
    (bytes[4], bytes[15]) = (4, 6);
    bytes.extend((LONG_HEADER as u32).to_le_bytes());
    bytes.resize(LONG_HEADER, 0);
    let mut streams = Vec::new();
    for size in part_bytes(3, 1) {
        let (part, rest) = parts.split_at(size);
        let stream = compress_to_vec(part, CompressionLevel::Fastest);
        bytes.extend(
            [stream.len() as u64, size as u64]
                .map(u64::to_le_bytes)
                .as_flattened(),
        );
        streams.extend(stream);
        parts = rest;
    }
    [bytes, streams].concat()
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
    let bytes = unzipped(&file(true));
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
fn version_4_is_read_as_3() {
    assert_eq!(
        read_one(&version_4()).unwrap(),
        read_one(&file(false)).unwrap()
    );
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
    let sound = version_4();
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

/// A small file that announces what would fill the memory, or holds it.
#[test]
fn bombs_do_not_go_off() {
    for (count, degree) in [(100_000_000_u32, 3), (1_000_000, 0)] {
        let mut bytes = b"NGSP\x03\0\0\0".to_vec();
        bytes.extend(count.to_le_bytes());
        bytes.extend([degree, 12, 0, 0]);
        bytes.resize(20_000_016, 0);
        let mut stream = GzEncoder::new(Vec::new(), Compression::fast());
        stream.write_all(&bytes).unwrap();
        let message = read_one(&stream.finish().unwrap()).unwrap_err().to_string();
        assert!(
            message.contains(&format!("{count} Gaussians are more than")),
            "{message}"
        );
    }
}

/// A file of version 4 with extensions: which, and the bytes of each.
fn extended(extensions: &[(u32, &[u8])]) -> Vec<u8> {
    let mut bytes = version_4();
    let all: Vec<u8> = (extensions.iter())
        .flat_map(|(which, payload)| {
            let begin = [which.to_le_bytes(), (payload.len() as u32).to_le_bytes()];
            [&begin.concat(), *payload].concat()
        })
        .collect();
    bytes[14] |= EXTENDED;
    bytes[16] += all.len() as u8;
    bytes.splice(LONG_HEADER..LONG_HEADER, all);
    bytes
}

#[test]
fn axes_that_a_file_declares_are_turned() {
    let plain = one().means[0];
    for (place, system) in SYSTEMS.iter().enumerate() {
        let number = (place as u32 + 1).to_le_bytes();
        let read = read_one(&extended(&[(ORBIT, &[0; 12]), (AXES, &number)])).unwrap();
        let mut expected = [0.0; 3];
        for (value, letter) in plain.iter().zip(system.chars()) {
            let (axis, sign) = match letter {
                'R' => (0, 1.0),
                'L' => (0, -1.0),
                'D' => (1, 1.0),
                'U' => (1, -1.0),
                'F' => (2, 1.0),
                _ => (2, -1.0),
            };
            expected[axis] = sign * value;
        }
        assert_eq!(read.splats.means, [expected], "{system}");
        assert_eq!(read.notes.is_empty(), *system == "RDF");
        assert!(read.doubts.is_empty());
    }
    let plain = read_one(&version_4()).unwrap();
    let nothing = extended(&[(AXES, &[0; 4])]);
    assert_eq!(read_one(&nothing).unwrap(), plain);
    for (which, payload, words) in [
        (AXES, &[17, 0, 0, 0], "axes 17 are not known"),
        (7, &[1, 2, 3, 4], "extension 0x7 is not read"),
    ] {
        let read = read_one(&extended(&[(which, payload)])).unwrap();
        assert!(read.doubts[0].contains(words), "{:?}", read.doubts);
        assert_eq!(read.splats, plain.splats);
    }
    let mut cut = extended(&[(AXES, &[4, 0, 0, 0])]);
    cut[LONG_HEADER + 4] = 5;
    assert!(read_one(&cut).unwrap_err().to_string().contains("cut off"));
}

#[test]
fn older_versions_declare_axes_behind_their_last_part() {
    let bytes = [0; 20];
    let mut stream = b"NGSP\x03\0\0\0\x01\0\0\0\0\x0c\x02\0".to_vec();
    stream.extend(bytes);
    stream[16] = 16;
    stream.extend([AXES.to_le_bytes(), 4_u32.to_le_bytes(), 3_u32.to_le_bytes()].concat());
    let mut packed = GzEncoder::new(Vec::new(), Compression::fast());
    packed.write_all(&stream).unwrap();
    let read = read_one(&packed.finish().unwrap()).unwrap();
    // LUB.
    assert_eq!(read.splats.means, [[-16.0 / 4096.0, 0.0, 0.0]]);
    assert_eq!(read.notes.len(), 1);
}
