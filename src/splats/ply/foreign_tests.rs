//! Splat files as other programs write them.

use super::tests::{binary_file, message, names, read_bytes, splats, text_file, written};
use super::*;

#[test]
fn limits_are_kept_as_finite_numbers() {
    let names = names();
    let properties: Vec<_> = names.iter().map(|name| ("float", name.as_str())).collect();
    let rows = [
        "1 2 3 4 5 6 inf 8 9 -inf 1 0 0 0",
        "1 2 3 4 5 6 -inf 8 9 10 1 0 0 0",
        "1 2 3 4 5 6 1e60 8 9 10 1 0 0 0",
    ];
    let read = read_bytes(&text_file(&properties, &rows)).unwrap();
    assert_eq!(read.skipped, 0);
    let opacities = &read.splats.opacity_logits;
    let opacity = |logit: f32| 1.0 / (1.0 + (-logit).exp());
    assert!(opacity(opacities[0]) > 0.999_999 && opacity(opacities[0]) < 1.0);
    assert!(opacity(opacities[1]) < 1e-6);
    assert_eq!(opacities[2], opacities[0]);
    let flat = read.splats.log_scales[0][2].exp();
    assert!(flat < 1e-8 && flat * flat > f32::MIN_POSITIVE);
    // They survive being written.
    assert_eq!(read_bytes(&written(&read.splats)).unwrap(), read);
}

#[test]
fn discs_have_two_scales() {
    let names: Vec<_> = names().into_iter().filter(|n| *n != THIRD_SCALE).collect();
    let properties: Vec<_> = names.iter().map(|name| ("float", name.as_str())).collect();
    let text = text_file(&properties, &["1 2 3 4 5 6 7 8 9 0.5 0.5 0.5 0.5"]);
    let read = read_bytes(&text).unwrap();
    assert_eq!(
        read.splats.log_scales,
        [[8.0, 9.0, crate::splats::quantize::FLAT]]
    );
    assert_eq!(read.splats.quats, [[0.5; 4]]);
    let mut binary = String::from_utf8(text).unwrap();
    binary.truncate(binary.find("end_header\n").unwrap() + 11);
    let mut binary = binary.replace("ascii", "binary_little_endian").into_bytes();
    let row = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 0.5, 0.5, 0.5];
    binary.extend(row.iter().chain(&[0.5]).flat_map(|v: &f32| v.to_le_bytes()));
    assert_eq!(read_bytes(&binary).unwrap(), read);
}

#[test]
fn integers_are_floats_of_sixteen_bits_or_refused() {
    let names = names();
    let of = |kind| -> Vec<_> { names.iter().map(|name| (kind, name.as_str())).collect() };
    let values = [
        1.5, -2.0, 3.0, 4.0, 5.0, 6.0, 7.0, -8.0, -9.0, -10.0, 0.5, 0.5, 0.5, 0.5,
    ];
    let text = String::from_utf8(text_file(&of("ushort"), &[])).unwrap();
    let mut half = (text.replace("ascii", "binary_little_endian"))
        .replace("vertex 0", "vertex 1")
        .into_bytes();
    half.extend(
        values
            .iter()
            .flat_map(|&v| half::f16::from_f32(v).to_le_bytes()),
    );
    let read = read_bytes(&half).unwrap().splats;
    assert_eq!(read.means, [[1.5, -2.0, 3.0]]);
    assert_eq!(read.log_scales, [[-8.0, -9.0, -10.0]]);
    assert_eq!(read.quats, [[0.5; 4]]);
    for (place, name) in [(0, "x"), (6, "opacity"), (13, "rot_3")] {
        let mut properties = of("float");
        properties[place].0 = "ushort";
        let message = message(&text_file(&properties, &["1 2 3 4 5 6 7 8 9 10 1 0 0 0"]));
        assert!(
            message.contains(&format!("\"{name}\" has an integer type")),
            "{message}"
        );
    }
}

#[test]
fn filters_are_put_into_scales_and_opacities() {
    let names = names();
    let mut properties: Vec<_> = names.iter().map(|name| ("float", name.as_str())).collect();
    properties.push(("float", FILTER));
    // Scales 1, 2 and 3, opacity 0.5.
    let shape = "1 2 3 4 5 6 0 0 0.6931472 1.0986123 1 0 0 0";
    let rows = [2.0, -2.0, 0.0, f32::NAN, f32::INFINITY].map(|filter| format!("{shape} {filter}"));
    let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
    let read = read_bytes(&text_file(&properties, &rows)).unwrap();
    assert_eq!((read.skipped, read.notes.len()), (2, 1));
    assert!(read.doubts.is_empty());
    let splats = &read.splats;
    let expected = [5.0_f32, 8.0, 13.0].map(|square| 0.5 * square.ln());
    let thinned = 0.5 * (1.0 * 4.0 * 9.0_f64 / (5.0 * 8.0 * 13.0)).sqrt();
    for (scales, opacity) in splats.log_scales.iter().zip(splats.opacities()).take(2) {
        for (found, wanted) in scales.iter().zip(expected) {
            assert!((found - wanted).abs() < 1e-6);
        }
        assert!((opacity - thinned).abs() < 1e-6);
    }
    assert_eq!(splats.log_scales[2][0], 0.0);
    assert_eq!(splats.opacity_logits[2], 0.0);
    // A disc has no volume to grow along its normal.
    let at = names.iter().position(|name| *name == THIRD_SCALE).unwrap();
    properties.remove(at);
    let disc = "1 2 3 4 5 6 0 0 0.6931472 1 0 0 0 2";
    let read = read_bytes(&text_file(&properties, &[disc])).unwrap().splats;
    let thinned = 0.5 * (4.0_f64 / (5.0 * 8.0)).sqrt();
    assert!((read.opacities().next().unwrap() - thinned).abs() < 1e-6);
    assert_eq!(read.log_scales[0][2], crate::splats::quantize::FLAT);
}

#[test]
fn what_is_not_read_is_named_unless_it_is_harmless() {
    let names = names();
    let mut properties: Vec<_> = names.iter().map(|name| ("float", name.as_str())).collect();
    properties.extend(["nx", "obj_dc_0", "label"].map(|name| ("float", name)));
    let row = "1 2 3 4 5 6 7 8 9 10 1 0 0 0 1 1 1";
    assert!(
        read_bytes(&text_file(&properties, &[row]))
            .unwrap()
            .doubts
            .is_empty()
    );
    properties.extend(["beta", "sb_params_0", "sb_params_1", "t"].map(|name| ("float", name)));
    let read = read_bytes(&text_file(&properties, &[&format!("{row} 1 1 1 1")])).unwrap();
    let [doubt] = &read.doubts[..] else {
        panic!("{:?}", read.doubts);
    };
    assert!(
        doubt.contains("beta, sb_params_0, sb_params_1 and 1 more"),
        "{doubt}"
    );
}

#[test]
fn colors_of_eight_bits() {
    let mut properties = Vec::new();
    let names = names();
    let colors = ["red", "green", "blue"];
    for name in &names {
        match name.strip_prefix("f_dc_") {
            Some(channel) => properties.push(("uchar", colors[channel.parse::<usize>().unwrap()])),
            None => properties.push(("float", name.as_str())),
        }
    }
    let row = "1 2 3 255 0 102 7 8 9 10 1 0 0 0";
    let read = read_bytes(&text_file(&properties, &[row])).unwrap().splats;
    let shown = |coefficient: f32| 0.5 + crate::splats::sh::C0 as f32 * coefficient;
    for (coefficient, expected) in read.sh.coefficients.iter().zip([1.0, 0.0, 0.4]) {
        assert!((shown(*coefficient) - expected).abs() < 1e-6);
    }
    assert_eq!(read.opacity_logits, [7.0]);
    // Colors of another kind are none, and `f_dc` goes before them.
    properties[3].0 = "float";
    assert!(message(&text_file(&properties, &[row])).contains("f_dc_0"));
}

#[test]
fn what_was_subtracted_is_known() {
    let offset = DVec3::new(456_789.125, 5_412_345.0, -97.1);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.ply");
    let read = |comments: &[String]| {
        write_ply(&file, &splats(0, 3), DVec3::ZERO, comments).unwrap();
        read_ply(&file).unwrap()
    };
    let found = read(&[offset_comment(offset)]);
    assert_eq!(found.offset, offset);
    assert_eq!(found.splats, splats(0, 3));
    for nothing in ["offset of the camera", "offset 1 2", "offset 1 2 inf"] {
        assert_eq!(read(&[nothing.into()]).offset, DVec3::ZERO);
    }
}

#[test]
fn bytes_behind_the_last_row_are_counted() {
    let names = names();
    let properties: Vec<_> = names.iter().map(|name| ("float", name.as_str())).collect();
    let good = "1 2 3 4 5 6 7 8 9 10 1 0 0 0";
    let text = String::from_utf8(text_file(&properties, &[good; 3])).unwrap();
    let surplus = |bytes: &[u8]| read_bytes(bytes).unwrap().surplus;
    assert_eq!(surplus(text.as_bytes()), 0);
    assert_eq!(surplus((text.clone() + "\n\n").as_bytes()), 0);
    let short = text.replace("vertex 3", "vertex 2");
    assert_eq!(surplus(short.as_bytes()), good.len() as u64);
    let binary = written(&splats(0, 3));
    let header = String::from_utf8_lossy(&binary).replace("vertex 2", "vertex 1");
    assert_eq!(surplus(&binary), 0);
    let mut short = header.as_bytes()[..header.find("end_header").unwrap() + 11].to_vec();
    short.extend(&binary[short.len()..]);
    assert_eq!(surplus(&short), 17 * 4);
    // Rows of a later element are no surplus, nor does it matter that they are cut off.
    let mut more = binary_file(false, "\n");
    assert_eq!(surplus(&more), 0);
    more.extend([0; 28]);
    assert_eq!(surplus(&more), 0);
    more.push(1);
    assert_eq!(surplus(&more), 1);
}

#[test]
fn point_clouds_are_named() {
    let kinds = ["float", "float", "float", "uchar", "uchar", "uchar"];
    let names = ["x", "y", "z", "red", "green", "blue"];
    let properties: Vec<_> = kinds.into_iter().zip(names).collect();
    let message = message(&text_file(&properties, &["1 2 3 4 5 6"]));
    assert!(message.contains("a point cloud"), "{message}");
}
