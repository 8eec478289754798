//! Exports of every kind: other numbers, layouts, opsets, outputs, weights beside the model.

use super::TeacherSettings;
use super::contract_tests::{ab_of_moved, assert_near, color, refusal, settings};
use super::tests::{fixture, gray, open_with};
use std::fs;

/// A manifest of DDColor's contract or DeOldify's, with lines of its own.
fn manifest(output: &str, range: &str, more: &str) -> String {
    format!(
        "name = \"Mine\"\ninputs = [\"image\"]\nimage = \"gray-rgb\"\ninput_range = {range}\n\
         mean = [0, 0, 0]\nstd = [1, 1, 1]\nsize = 32\nsize_multiple = 1\n\
         resize = \"stretch\"\nfilter = \"average\"\noutput = \"{output}\"\n{more}\n"
    )
}

/// Answer of `ddcolor_tiny` to a gray, 0 to 1.
fn expected(gray: f64) -> [f64; 2] {
    let g = 2.0 * gray - 1.0;
    [40.0 * g, 10.0 - 30.0 * g]
}

#[test]
fn half_floats_bytes_for_weights_and_other_opsets() {
    for (name, tolerance) in [
        ("half_tiny.onnx", 0.1),
        ("int8_tiny.onnx", 1e-3),
        ("old_tiny.onnx", 1e-3),
        ("new_tiny.onnx", 1e-3),
        ("outside_tiny.onnx", 1e-3),
    ] {
        for level in [0, 119, 255] {
            let (found, kind) = color(name, &settings(None, None), level);
            assert_near(found, expected(f64::from(level) / 255.0), tolerance);
            assert_eq!(kind, "DDColor", "{name}");
        }
    }
}

#[test]
fn a_network_that_never_ends_is_given_up() {
    let limit = std::time::Duration::from_millis(300);
    let settings = TeacherSettings {
        time_limit: limit,
        ..settings(None, None)
    };
    let mut teacher = open_with(&fixture("endless_tiny.onnx"), None, &settings).unwrap();
    for _ in 0..2 {
        let asked = teacher.colorize("v.png", gray(2, 1, &[0, 255]), None);
        let message = asked.unwrap_err().to_string();
        for part in ["endless_tiny.onnx", "v.png", "within 0.3 s"] {
            assert!(message.contains(part), "{message}");
        }
    }
}

#[test]
fn weights_beside_the_model_belong_to_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("outside_tiny.onnx");
    fs::copy(fixture("outside_tiny.onnx"), &path).unwrap();
    let message = refusal(&path, &settings(None, None));
    for part in ["outside_tiny.onnx", "outside_tiny.data", "one folder"] {
        assert!(message.contains(part), "{message}");
    }

    let weights = folder.path().join("outside_tiny.data");
    let mut bytes = fs::read(fixture("outside_tiny.data")).unwrap();
    fs::write(&weights, &bytes).unwrap();
    let cache = folder.path().join("answers");
    let ask = || {
        let mut teacher = open_with(&path, Some(&cache), &settings(None, None)).unwrap();
        let answer = teacher.colorize("v.png", gray(2, 1, &[255, 255]), None);
        (answer.unwrap().unwrap().ab[0], teacher.describe().sha256)
    };
    let (first, identity) = ask();
    assert_near(first.map(f64::from), expected(1.0), 1e-3);
    // The last float is b's offset; the cache must not answer for other weights.
    let offset = bytes.len() - 4;
    bytes[offset..].copy_from_slice(&50_f32.to_le_bytes());
    fs::write(&weights, &bytes).unwrap();
    let (other, its_identity) = ask();
    assert!(
        (other[1] - first[1] - 10.0).abs() < 1e-3,
        "{other:?} {first:?}"
    );
    assert_ne!(identity, its_identity);
}

/// Answers of a fixture for a gray of 200, told by a manifest.
fn told(name: &str, manifest: &str) -> Result<[f64; 2], String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    fs::write(&path, manifest).unwrap();
    let settings = settings(path.to_str(), None);
    let mut teacher =
        open_with(&fixture(name), None, &settings).map_err(|error| error.to_string())?;
    let answer = teacher.colorize("v.png", gray(2, 1, &[200, 200]), None);
    let answer = answer.map_err(|error| error.to_string())?;
    Ok(answer.unwrap().ab[0].map(f64::from))
}

#[test]
fn pixel_by_pixel_in_bytes_two_at_once() {
    let range = "output_range = [0, 255]\n";
    let pixels = manifest("rgb", "[0, 255]", &format!("{range}layout = \"nhwc\""));
    // Bytes are rounded.
    assert_near(
        told("pixels_tiny.onnx", &pixels).unwrap(),
        ab_of_moved(200),
        0.6,
    );
    let planes = manifest("rgb", "[0, 255]", range);
    let message = told("pixels_tiny.onnx", &planes).unwrap_err();
    assert!(message.contains("[2,32,32,3]"), "{message}");
}

#[test]
fn a_manifest_names_one_of_several_answers() {
    let of = |name: &str| {
        let more = format!("output_range = [-110, 110]\nanswer = \"{name}\"");
        told("two_answers_tiny.onnx", &manifest("ab", "[0, 1]", &more))
    };
    let whole = expected(200.0 / 255.0);
    assert_near(of("ab").unwrap(), whole, 1e-3);
    assert_near(of("half").unwrap(), whole.map(|v| v / 2.0), 1e-3);
    assert!(of("third").unwrap_err().contains("half"));
    let unnamed = refusal(&fixture("two_answers_tiny.onnx"), &settings(None, None));
    assert!(
        unnamed.contains("half") && unnamed.contains("answer ="),
        "{unnamed}"
    );
}
