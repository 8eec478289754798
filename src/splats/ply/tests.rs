use super::*;
use crate::splats::{ShField, Splats};
use glam::DVec3;
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

/// Two Gaussians of which every number is different.
pub(super) fn splats(degree: u32, channels: usize) -> Splats {
    let count = 2 * coefficient_count(degree) * channels;
    Splats {
        means: vec![[1.0, -2.0, 3.0], [0.25, 0.5, 0.75]],
        quats: vec![[1.0, 0.0, 0.0, 0.0], [0.5, -0.5, 0.5, 0.5]],
        log_scales: vec![[-1.0, -2.0, -3.0], [-4.0, -5.0, -6.0]],
        opacity_logits: vec![0.5, -0.5],
        sh: ShField {
            degree,
            channels,
            coefficients: (0..count).map(|i| i as f32 / 8.0).collect(),
        },
    }
}

fn folder_and_file() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.ply");
    (folder, file)
}

pub(super) fn read_bytes(bytes: &[u8]) -> Result<ReadSplats, SplatError> {
    let (_folder, file) = folder_and_file();
    fs::write(&file, bytes).unwrap();
    read_ply(&file)
}

pub(super) fn written(splats: &Splats) -> Vec<u8> {
    let (_folder, file) = folder_and_file();
    write_ply(&file, splats, DVec3::ZERO, &[]).unwrap();
    fs::read(file).unwrap()
}

/// Property names of a degree 0 splat, in file order.
pub(super) fn names() -> Vec<String> {
    let names = CENTER.into_iter().map(String::from).chain(sh_names(0));
    names.chain(SHAPE.into_iter().map(String::from)).collect()
}

/// A text file with one degree 0 splat whose numbers are 1, 2, 3…
pub(super) fn text_file(properties: &[(&str, &str)], rows: &[&str]) -> Vec<u8> {
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n", rows.len());
    for (kind, name) in properties {
        text += &format!("property {kind} {name}\n");
    }
    text += "end_header\n";
    (text + &rows.join("\n")).into_bytes()
}

pub(super) fn message(bytes: &[u8]) -> String {
    let message = read_bytes(bytes).unwrap_err().to_string();
    assert!(message.contains("scene.ply"), "{message}");
    assert!(!message.contains('\n'), "{message}");
    message
}

#[test]
fn round_trip_at_every_degree() {
    for degree in 0..=3 {
        let original = splats(degree, 3);
        let read = read_bytes(&written(&original)).unwrap();
        assert_eq!(read.splats, original, "degree {degree}");
        assert_eq!(read.skipped, 0);
    }
}

#[test]
fn no_splats_round_trip() {
    let original = Splats {
        sh: ShField::zeros(0, 2, 3),
        ..Splats::default()
    };
    assert_eq!(read_bytes(&written(&original)).unwrap().splats, original);
}

#[test]
fn luma_becomes_gray() {
    let luma = splats(2, 1);
    let read = read_bytes(&written(&luma)).unwrap().splats;
    assert_eq!(read.sh.channels, 3);
    assert!(read.is_gray(0.0));
    assert_eq!(read.to_luma(), luma);
}

#[test]
fn header_and_layout_are_the_reference_ones() {
    let original = splats(1, 3);
    let (_folder, file) = folder_and_file();
    let comments = [
        "SplatRenderMode: default".into(),
        "two\r\nlines end_header".into(),
    ];
    write_ply(&file, &original, DVec3::new(0.5, 0.0, -1.0), &comments).unwrap();
    let bytes = fs::read(file).unwrap();
    let end = bytes
        .windows(11)
        .position(|w| w == b"end_header\n")
        .unwrap()
        + 11;
    let mut expected = String::from(
        "ply\nformat binary_little_endian 1.0\ncomment SplatRenderMode: default\n\
         comment two  lines end-header\nelement vertex 2\n",
    );
    for name in "x y z nx ny nz f_dc_0 f_dc_1 f_dc_2 f_rest_0 f_rest_1 f_rest_2 f_rest_3 \
                 f_rest_4 f_rest_5 f_rest_6 f_rest_7 f_rest_8 opacity scale_0 scale_1 scale_2 \
                 rot_0 rot_1 rot_2 rot_3"
        .split_whitespace()
    {
        expected += &format!("property float {name}\n");
    }
    expected += "end_header\n";
    assert_eq!(std::str::from_utf8(&bytes[..end]).unwrap(), expected);

    let numbers: Vec<f32> = bytes[end..]
        .chunks_exact(4)
        .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
        .collect();
    // [coefficient][channel] in memory; all of red, then green, then blue in the file.
    let sh: Vec<f32> = [0, 1, 2, 3, 6, 9, 4, 7, 10, 5, 8, 11]
        .map(|i| i as f32 / 8.0)
        .to_vec();
    let mut first = vec![1.5, -2.0, 2.0, 0.0, 0.0, 0.0];
    first.extend(sh);
    first.extend([0.5, -1.0, -2.0, -3.0, 1.0, 0.0, 0.0, 0.0]);
    assert_eq!(numbers[..26], first);
    assert_eq!(numbers.len(), 52);
}

#[test]
fn quaternions_are_written_with_unit_length() {
    let mut original = splats(0, 1);
    original.quats[0] = [0.0, 3.0, 0.0, -4.0];
    original.quats[1] = [1e-30, 0.0, 0.0, 0.0];
    let read = read_bytes(&written(&original)).unwrap().splats;
    assert_eq!(read.quats, [[0.0, 0.6, 0.0, -0.8], [1.0, 0.0, 0.0, 0.0]]);
}

#[test]
fn offset_is_added_before_rounding() {
    let mut original = splats(0, 1);
    original.means[0] = [0.1, 0.0, 0.0];
    let (_folder, file) = folder_and_file();
    write_ply(&file, &original, DVec3::new(1e7, 0.0, 0.0), &[]).unwrap();
    let read = read_ply(&file).unwrap().splats;
    assert_eq!(read.means[0][0], (1e7 + f64::from(0.1f32)) as f32);
}

#[test]
fn the_header_says_how_to_draw() {
    let (_folder, file) = folder_and_file();
    let read = |comments: &[&str]| {
        let comments: Vec<String> = comments.iter().map(|&c| c.to_owned()).collect();
        write_ply(&file, &splats(0, 3), DVec3::ZERO, &comments).unwrap();
        read_ply(&file).unwrap().antialiased
    };
    assert!(read(&["gs-chroma 1.0", ANTIALIASED]));
    assert!(read(&["antialiased 1"]));
    assert!(!read(&["gs-chroma 1.0", "antialiased, they say"]));
    assert!(!read(&["SplatRenderMode: default"]));
    // The last one counts.
    assert!(!read(&[ANTIALIASED, "antialiased 0"]));
    assert!(!read(&[]));
}

#[test]
fn long_comments_do_not_make_a_long_header() {
    let (_folder, file) = folder_and_file();
    let comments = vec!["x".repeat(3000); 5];
    write_ply(&file, &splats(3, 3), DVec3::ZERO, &comments).unwrap();
    let bytes = fs::read(&file).unwrap();
    let end = bytes
        .windows(11)
        .position(|w| w == b"end_header\n")
        .unwrap();
    assert!(end < MAX_READERS_HEADER);
    assert!(end > 3000);
    read_ply(&file).unwrap();
}

/// Some readers look no further.
const MAX_READERS_HEADER: usize = 10 * 1024;

type Spoil = fn(&mut Splats);

#[test]
fn what_cannot_be_written_is_refused_and_leaves_no_file() {
    let spoils: [(&str, Spoil); 9] = [
        ("the center of splat 1 is NaN", |s| s.means[1][2] = f32::NAN),
        ("the scale of splat 0 is inf", |s| {
            s.log_scales[0][1] = f32::INFINITY
        }),
        ("the opacity of splat 1 is -inf", |s| {
            s.opacity_logits[1] = f32::NEG_INFINITY
        }),
        ("the SH field of splat 0 is NaN", |s| {
            s.sh.coefficients[1] = f32::NAN
        }),
        ("the quaternion of splat 1 is 0", |s| s.quats[1] = [0.0; 4]),
        ("the quaternion of splat 1 is NaN", |s| {
            s.quats[1][0] = f32::NAN
        }),
        ("channels", |s| s.sh.channels = 2),
        ("degree 4", |s| s.sh.degree = 4),
        ("other arrays", |s| s.quats.truncate(1)),
    ];
    for (expected, spoil) in spoils {
        let (folder, file) = folder_and_file();
        let mut bad = splats(0, 3);
        spoil(&mut bad);
        let message = write_ply(&file, &bad, DVec3::ZERO, &[])
            .unwrap_err()
            .to_string();
        assert!(message.contains(expected), "{message}");
        assert!(message.contains("scene.ply"), "{message}");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 0);
    }
}

#[test]
fn a_failed_write_keeps_the_old_file() {
    let (_folder, file) = folder_and_file();
    fs::write(&file, "old").unwrap();
    let mut bad = splats(0, 3);
    bad.means[1][0] = f32::INFINITY;
    assert!(write_ply(&file, &bad, DVec3::ZERO, &[]).is_err());
    assert_eq!(fs::read_to_string(&file).unwrap(), "old");
    write_ply(&file, &splats(0, 3), DVec3::ZERO, &[]).unwrap();
    assert_eq!(read_ply(&file).unwrap().splats, splats(0, 3));
}

#[test]
fn permuted_properties_with_extras_and_other_types() {
    // From the last property to the first, with strangers between.
    let reversed: Vec<String> = names().into_iter().rev().collect();
    let kinds = [
        "double", "float64", "float32", "float", "float", "double", "float",
    ];
    let mut properties = vec![("uchar", "red")];
    let mut row = vec!["200".to_string()];
    for (i, name) in reversed.iter().enumerate() {
        // Only a center may be whole.
        let kind = match name.as_str() {
            "x" => "int",
            "y" => "uchar",
            "z" => "short",
            _ => kinds[i % kinds.len()],
        };
        properties.push((kind, name));
        row.push((14 - i).to_string());
    }
    properties.push(("float", "segment"));
    row.push("-1e3".into());
    let read = read_bytes(&text_file(&properties, &[&row.join(" ")])).unwrap();
    let expected = Splats {
        means: vec![[1.0, 2.0, 3.0]],
        sh: ShField {
            degree: 0,
            channels: 3,
            coefficients: vec![4.0, 5.0, 6.0],
        },
        opacity_logits: vec![7.0],
        log_scales: vec![[8.0, 9.0, 10.0]],
        quats: vec![[11.0, 12.0, 13.0, 14.0]],
    };
    assert_eq!(read.splats, expected);
}

/// A binary file with a list before the vertices, doubles, other orders and CRLF.
pub(super) fn binary_file(big_endian: bool, line_end: &str) -> Vec<u8> {
    let order = if big_endian { "big" } else { "little" };
    let mut header = format!(
        "ply\nformat binary_{order}_endian 1.0\ncomment caf\u{e9}\nobj_info x\nelement face 2\n\
         property list uchar int vertex_indices\nproperty short flags\nelement vertex 1\n"
    );
    for name in names() {
        header += &format!("property double {name}\n");
    }
    header += "property uchar extra\nelement tail 7\nproperty int unread\nend_header\n";
    let mut bytes = header.replace('\n', line_end).into_bytes();
    bytes.extend([1, 9, 9, 9, 9, 5, 5]);
    bytes.extend([0, 5, 5]);
    for i in 1..=14 {
        let value = f64::from(i);
        bytes.extend(if big_endian {
            value.to_be_bytes()
        } else {
            value.to_le_bytes()
        });
    }
    bytes.push(77);
    bytes
}

#[test]
fn binary_of_both_orders_with_lists_before_the_vertices() {
    for big_endian in [false, true] {
        for line_end in ["\n", "\r\n"] {
            let read = read_bytes(&binary_file(big_endian, line_end))
                .unwrap()
                .splats;
            assert_eq!(read.means, [[1.0, 2.0, 3.0]]);
            assert_eq!(read.quats, [[11.0, 12.0, 13.0, 14.0]]);
        }
    }
}

#[test]
fn comments_need_not_be_utf8() {
    let mut bytes = written(&splats(0, 3));
    let end = bytes.windows(7).position(|w| w == b"element").unwrap();
    bytes.splice(end..end, *b"comment \xff\xfe\n");
    assert_eq!(read_bytes(&bytes).unwrap().splats, splats(0, 3));
}

#[test]
fn bad_splats_are_skipped_and_counted() {
    let mut properties = Vec::new();
    let names = names();
    properties.extend(names.iter().map(|name| ("float", name.as_str())));
    let good = "1 2 3 4 5 6 7 8 9 10 1 0 0 0";
    let rows = [
        good,
        "nan 2 3 4 5 6 7 8 9 10 1 0 0 0",
        "1 2 3 4 5 6 7 inf 9 10 1 0 0 0",
        "1 2 3 4 5 6 7 8 9 10 0 0 0 0",
        "1 2 3 4 5 6 nan 8 9 10 1 0 0 0",
        "1 2 3 4 1e60 6 7 8 9 10 1 0 0 0",
        good,
    ];
    let read = read_bytes(&text_file(&properties, &rows)).unwrap();
    assert_eq!((read.splats.len(), read.skipped), (2, 5));
    assert_eq!(read.splats.sh.coefficients, [4.0, 5.0, 6.0, 4.0, 5.0, 6.0]);
}

#[test]
fn a_missing_property_is_named() {
    for missing in names().into_iter().filter(|name| *name != THIRD_SCALE) {
        let names: Vec<_> = names().into_iter().filter(|n| *n != missing).collect();
        let properties: Vec<_> = names.iter().map(|name| ("float", name.as_str())).collect();
        let message = message(&text_file(&properties, &["1 2 3 4 5 6 7 8 9 10 1 0 0"]));
        assert!(message.contains(&format!("\"{missing}\"")), "{message}");
    }
    let message = message(b"ply\nformat ascii 1.0\nend_header\n");
    assert!(message.contains("\"x\""), "{message}");
}

#[test]
fn rest_counts_that_fit_no_degree() {
    for count in [1, 8, 10, 44, 46, 72] {
        let mut names = names();
        names.extend((0..count).map(|i| format!("f_rest_{i}")));
        let properties: Vec<_> = names.iter().map(|name| ("float", name.as_str())).collect();
        let message = message(&text_file(&properties, &[]));
        assert!(
            message.contains(&format!("{count} properties f_rest_*")),
            "{message}"
        );
    }
}

#[test]
fn a_gap_in_the_rest_is_a_missing_property() {
    let mut names = names();
    names.extend((0..10).filter(|&i| i != 4).map(|i| format!("f_rest_{i}")));
    let properties: Vec<_> = names.iter().map(|name| ("float", name.as_str())).collect();
    assert!(message(&text_file(&properties, &[])).contains("f_rest_4"));
}

#[test]
fn lying_counts_are_refused_before_memory_is_taken() {
    let good = String::from_utf8_lossy(&text_file(&[], &[])).into_owned();
    let mut header = good.replace("end_header\n", "");
    for name in names() {
        header += &format!("property float {name}\n");
    }
    for count in ["1", "1000000000000", "18446744073709551615"] {
        for format in ["ascii", "binary_little_endian"] {
            let header = header.replace("ascii", format);
            let text = header.replace("vertex 0", &format!("vertex {count}")) + "end_header\n";
            assert!(message(text.as_bytes()).contains("more than the file holds"));
        }
    }
    let beyond = header.replace("vertex 0", "vertex 18446744073709551616") + "end_header\n";
    assert!(message(beyond.as_bytes()).contains("line 3"));
}

#[test]
fn a_body_that_is_cut_off() {
    for bytes in [
        written(&splats(3, 3)),
        binary_file(false, "\n"),
        binary_file(true, "\n"),
    ] {
        let end = bytes
            .windows(11)
            .position(|w| w == b"end_header\n")
            .unwrap()
            + 11;
        for length in [end, end + 1, end + 8, bytes.len() - 1] {
            assert!(message(&bytes[..length]).contains("cut off"), "{length}");
        }
    }
}

#[test]
fn rows_of_a_text_file_that_are_not_numbers() {
    let names = names();
    let properties: Vec<_> = names.iter().map(|name| ("float", name.as_str())).collect();
    let good = "1 2 3 4 5 6 7 8 9 10 1 0 0 0";
    for bad in [
        "1 2 3",
        "1 2 3 4 five 6 7 8 9 10 1 0 0 0",
        &format!("{good} 9"),
        "",
    ] {
        let message = message(&text_file(&properties, &[good, bad, good]));
        assert!(message.contains("vertex row 1"), "{message}");
    }
}

#[test]
fn headers_that_are_refused() {
    let cases: [(&[u8], &str); 8] = [
        (b"", "first line"),
        (b"\x89PNG\r\n", "first line"),
        (b"ply\nformat ascii 1.0\nelement vertex 0\n", "end_header"),
        (b"ply\nformat ascii 1.0\nelement vertex many\nend_header\n", "line 3"),
        (b"ply\nelement vertex 0\nend_header\n", "format"),
        (
            b"ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float x\nend_header\n",
            "one name",
        ),
        (
            b"ply\nformat ascii 1.0\nelement vertex 0\nproperty list uchar int x\nend_header\n",
            "is a list",
        ),
        (
            b"ply\nformat ascii 1.0\nelement vertex 0\nproperty uint packed_position\nend_header\n",
            "compressed",
        ),
    ];
    for (bytes, expected) in cases {
        let message = message(bytes);
        assert!(message.contains(expected), "{message}");
    }
    let mut endless = b"ply\ncomment ".to_vec();
    endless.resize(200_000, b'x');
    assert!(message(&endless).contains("64 KiB"));
    let mut lines = b"ply\n".to_vec();
    lines.extend(b"comment x\n".repeat(20_000));
    assert!(message(&lines).contains("64 KiB"));
}

#[test]
fn a_missing_file_is_named() {
    let message = read_ply(std::path::Path::new("/no/such/scene.ply"))
        .unwrap_err()
        .to_string();
    assert!(message.starts_with("/no/such/scene.ply: "), "{message}");
}

#[test]
fn hostile_lists_before_the_vertices() {
    let header = |kind: &str| {
        format!(
            "ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list {kind} double v\n\
             element vertex 0\nend_header\n"
        )
    };
    let mut huge = header("uint").into_bytes();
    huge.extend([255; 4]);
    assert!(message(&huge).contains("cut off"));
    let mut negative = header("int").into_bytes();
    negative.extend([255; 4]);
    assert!(message(&negative).contains("face row 0"));
    // A count without properties takes no room and must not be walked through.
    let empty = "ply\nformat binary_little_endian 1.0\nelement face 99999999999999999\n\
                 element vertex 0\nend_header\n";
    assert!(message(empty.as_bytes()).contains("\"x\""));
}
