//! Each built-in contract against a tiny network whose answer is known. The
//! expected numbers come from the formulas in `tests/fixtures/onnx/README.md` and
//! from the CIE's, written down here once more.

use super::tests::{fixture, gray, open_with};
use super::*;
use std::fs;
use std::path::Path;

pub(super) fn settings(profile: Option<&str>, size: Option<u32>) -> TeacherSettings {
    TeacherSettings {
        profile: profile.map(str::to_owned),
        size,
        ..TeacherSettings::default()
    }
}

/// The answer for a photo of one gray, which has one color, and the kind of
/// network that gave it.
pub(super) fn color(name: &str, settings: &TeacherSettings, level: u8) -> ([f64; 2], String) {
    let mut teacher = open_with(&fixture(name), None, settings).unwrap();
    let pixels = vec![level; 40 * 24];
    let answer = teacher.colorize("v.png", gray(40, 24, &pixels), None);
    let answer = answer.unwrap().unwrap();
    assert_eq!((answer.width, answer.height), (40, 24));
    let first = answer.ab[0];
    for ab in &answer.ab {
        assert!(
            ab.iter().zip(first).all(|(v, f)| (v - f).abs() < 1e-3),
            "{ab:?} {first:?}"
        );
    }
    (first.map(f64::from), teacher.describe().kind)
}

pub(super) fn assert_near(found: [f64; 2], expected: [f64; 2], tolerance: f64) {
    let near = found
        .iter()
        .zip(expected)
        .all(|(f, e)| (f - e).abs() < tolerance);
    assert!(near, "{found:?}, not {expected:?}");
}

/// IEC 61966-2-1.
fn linear(encoded: f64) -> f64 {
    if encoded <= 0.040_45 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// CIE 15: the function behind L*, a*, b*.
fn cie(t: f64) -> f64 {
    if t > (6.0 / 29.0_f64).powi(3) {
        t.cbrt()
    } else {
        t / (3.0 * (6.0 / 29.0_f64).powi(2)) + 4.0 / 29.0
    }
}

fn lightness(level: u8) -> f64 {
    116.0 * cie(linear(f64::from(level) / 255.0)) - 16.0
}

/// a*, b* of an encoded sRGB color under D65, by the matrix of IEC 61966-2-1.
fn ab_of_rgb(rgb: [f64; 3]) -> [f64; 2] {
    let [r, g, b] = rgb.map(linear);
    let x = cie((0.4124 * r + 0.3576 * g + 0.1805 * b) / 0.9505);
    let y = cie(0.2126 * r + 0.7152 * g + 0.0722 * b);
    let z = cie((0.0193 * r + 0.1192 * g + 0.9505 * b) / 1.089);
    [500.0 * (x - y), 200.0 * (y - z)]
}

/// Answer of the networks of RGB: half the gray, moved by 0.4, 0.2 and 0.1.
pub(super) fn ab_of_moved(level: u8) -> [f64; 2] {
    let half = f64::from(level) / 510.0;
    ab_of_rgb([half + 0.4, half + 0.2, half + 0.1])
}

#[test]
fn ddcolor() {
    for level in [0, 119, 255] {
        let (found, kind) = color("ddcolor_tiny.onnx", &settings(None, None), level);
        let g = 2.0 * f64::from(level) / 255.0 - 1.0;
        assert_near(found, [40.0 * g, 10.0 - 30.0 * g], 1e-3);
        assert_eq!(kind, "DDColor");
    }
}

#[test]
fn lightness_in_ab_out() {
    for level in [0, 60, 119, 255] {
        let (found, kind) = color("siggraph17_tiny.onnx", &settings(None, None), level);
        let l = lightness(level);
        assert_near(found, [l / 2.0 - 10.0, 5.0 - l / 4.0], 1e-3);
        assert_eq!(kind, "ECCV16/SIGGRAPH17");
    }
    for name in ["eccv16", "siggraph17", "SIGGRAPH17"] {
        let (found, _) = color("siggraph17_tiny.onnx", &settings(Some(name), None), 255);
        assert_near(found, [40.0, -20.0], 1e-3);
    }
}

#[test]
fn lightness_less_50_in_a_quarter_out() {
    for level in [0, 60, 255] {
        let (found, kind) = color("caffe_v2_tiny.onnx", &settings(None, None), level);
        let x = lightness(level) - 50.0;
        assert_near(found, [x, 20.0 - x / 2.0], 1e-3);
        assert_eq!(kind, "Caffe v2");
    }
}

#[test]
fn lightness_with_hints() {
    let name = "siggraph17_full_tiny.onnx";
    let l = lightness(90);
    let (found, kind) = color(name, &settings(None, None), 90);
    assert_near(found, [l / 5.0, -l / 10.0], 1e-3);
    assert_eq!(kind, "SIGGRAPH17 with hints");

    // The left half is painted a 30, b -40, a sixteenth of it more is too little.
    let (width, height) = (64, 64);
    let painted = |x: u32| if x < 32 { [30.0, -40.0, 1.0] } else { [0.0; 3] };
    let mut paint: Vec<[f32; 3]> = (0..width * height).map(|i| painted(i % width)).collect();
    paint[(20 * width + 50) as usize] = [3.0, 3.0, 0.3];
    let hints = HintImage {
        width,
        height,
        paint,
    };
    let folder = tempfile::tempdir().unwrap();
    let mut teacher =
        open_with(&fixture(name), Some(folder.path()), &settings(None, None)).unwrap();
    let pixels = vec![90; (width * height) as usize];
    let photo = gray(width, height, &pixels);
    let told = teacher
        .colorize("v.png", photo, Some(&hints))
        .unwrap()
        .unwrap();
    let at = |answer: &AbImage, x: u32| answer.ab[(20 * width + x) as usize].map(f64::from);
    assert_near(
        at(&told, 8),
        [l / 5.0 + 15.0 + 10.0, -40.0 - 5.0 - l / 10.0],
        1e-2,
    );
    assert_near(at(&told, 50), [l / 5.0, -l / 10.0], 1e-2);

    // Hints are part of the question: without them the cache has no answer yet.
    let plain = teacher.colorize("v.png", photo, None).unwrap().unwrap();
    assert_near(at(&plain, 8), [l / 5.0, -l / 10.0], 1e-2);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2);
    let again = teacher
        .colorize("v.png", photo, Some(&hints))
        .unwrap()
        .unwrap();
    assert_eq!(again, told);
    // Other networks do not hear of them.
    let mut other = open_with(
        &fixture("siggraph17_tiny.onnx"),
        None,
        &settings(None, None),
    )
    .unwrap();
    let deaf = other
        .colorize("v.png", photo, Some(&hints))
        .unwrap()
        .unwrap();
    assert_near(at(&deaf, 8), [l / 2.0 - 10.0, 5.0 - l / 4.0], 1e-3);
}

#[test]
fn gray_with_class_and_code_in_rgb_out() {
    let folder = tempfile::tempdir().unwrap();
    for level in [0, 119, 255] {
        let (found, kind) = color("bigcolor_tiny.onnx", &settings(None, Some(32)), level);
        assert_near(found, ab_of_moved(level), 0.05);
        assert_eq!(kind, "BigColor");
    }
    // Each class more moves RGB by a half.
    let chosen = TeacherSettings {
        class: Some(1),
        ..settings(None, Some(32))
    };
    let (found, _) = color("bigcolor_tiny.onnx", &chosen, 0);
    assert_near(found, ab_of_rgb([0.9, 0.7, 0.6]), 0.05);
    let message = refusal(
        &fixture("ddcolor_tiny.onnx"),
        &TeacherSettings {
            size: None,
            ..chosen
        },
    );
    assert!(
        message.contains("ddcolor_tiny.onnx: takes no class"),
        "{message}"
    );
    let path = fixture("bigcolor_tiny.onnx");
    let mut teacher = open_with(&path, Some(folder.path()), &settings(None, Some(32))).unwrap();
    assert_eq!(teacher.describe().input_size, Some([32, 32]));
    let pixels = vec![119; 90 * 60];
    teacher
        .colorize("v.png", gray(90, 60, &pixels), None)
        .unwrap();
    // 32 · 90 / 60 = 48, a multiple of 16; the cache holds the answer as it came.
    let file = fs::read_dir(folder.path())
        .unwrap()
        .next()
        .unwrap()
        .unwrap();
    let bytes = fs::read(file.path()).unwrap();
    assert_eq!(npyz::NpyFile::new(&bytes[..]).unwrap().shape(), [2, 32, 48]);
}

#[test]
fn rgb_from_0_to_255_and_from_0_to_1() {
    for level in [0, 119, 255] {
        let asked = settings(Some("deoldify"), Some(64));
        let (found, kind) = color("deoldify_tiny.onnx", &asked, level);
        assert_near(found, ab_of_moved(level), 0.05);
        assert_eq!(kind, "DeOldify");
        let asked = settings(Some("deoldify-browser"), None);
        let (found, kind) = color("deoldify_browser_tiny.onnx", &asked, level);
        assert_near(found, ab_of_moved(level), 0.05);
        assert_eq!(kind, "DeOldify for browsers");
    }
}

pub(super) fn refusal(path: &Path, settings: &TeacherSettings) -> String {
    let refused = open_with(path, None, settings)
        .err()
        .expect("must be refused");
    let message = refused.to_string();
    assert!(!message.contains('\n'), "{message}");
    message
}

#[test]
fn where_two_contracts_fit_only_the_user_knows() {
    for name in ["deoldify_tiny.onnx", "deoldify_browser_tiny.onnx"] {
        let message = refusal(&fixture(name), &settings(None, None));
        for part in [name, ": deoldify or deoldify-browser"] {
            assert!(message.contains(part), "{message}");
        }
    }
}

#[test]
fn what_is_no_a_and_b_is_no_answer_of_a_network_that_shapes_tell() {
    let ask = |name: &str, profile: Option<&str>, pixels: &[u8]| {
        let mut teacher = open_with(&fixture(name), None, &settings(profile, None)).unwrap();
        let asked = teacher.colorize("v.png", gray(4, 1, pixels), None);
        asked.map(drop).map_err(|error| error.to_string())
    };
    let message = ask("unit_tiny.onnx", None, &[0, 80, 160, 255]).unwrap_err();
    for part in ["unit_tiny.onnx", "v.png", "-1.0 to 1.0", "ECCV16"] {
        assert!(message.contains(part), "{message}");
    }
    assert_eq!(
        ask("unit_tiny.onnx", Some("eccv16"), &[0, 255, 9, 9]),
        Ok(())
    );
    // A photo that happens to be all but gray: L = 20, a = b = 0.
    assert_eq!(ask("siggraph17_tiny.onnx", None, &[48; 4]), Ok(()));
}

#[test]
fn colors_that_cannot_be_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    for (name, manifest) in [
        ("ddcolor_tiny", profile::named("ddcolor").unwrap()),
        ("deoldify_tiny", profile::named("deoldify").unwrap()),
    ] {
        let path = folder.path().join("mine.toml");
        let mut manifest = manifest;
        manifest.output_range = manifest.output_range.map(|end| end / 200.0);
        fs::write(&path, manifest.to_toml()).unwrap();
        let asked = settings(path.to_str(), Some(32));
        let model = fixture(&format!("{name}.onnx"));
        let mut teacher = open_with(&model, Some(folder.path()), &asked).unwrap();
        let asked = teacher.colorize("v.png", gray(2, 1, &[0, 255]), None);
        let message = asked.unwrap_err().to_string();
        for part in [name, "v.png", "no colors", &manifest.name] {
            assert!(message.contains(part), "{message}");
        }
        let kept = fs::read_dir(folder.path()).unwrap().count();
        assert_eq!(kept, 1, "{name}");
    }
}

#[test]
fn sizes_that_cannot_be() {
    for (name, profile, size, expected) in [
        ("ddcolor_tiny.onnx", None, 64, "takes 32 and nothing else"),
        (
            "deoldify_tiny.onnx",
            Some("deoldify"),
            100,
            "multiple of 32, such as 128",
        ),
        ("bigcolor_tiny.onnx", None, 30, "multiple of 16, such as 32"),
    ] {
        let message = refusal(&fixture(name), &settings(profile, Some(size)));
        for part in [name, "size ", expected] {
            assert!(message.contains(part), "{message}");
        }
    }
    let (_, kind) = color("ddcolor_tiny.onnx", &settings(None, Some(32)), 9);
    assert_eq!(kind, "DDColor");
}

#[test]
fn a_manifest_beside_the_model_or_by_its_name() {
    let folder = tempfile::tempdir().unwrap();
    let model = folder.path().join("mine.onnx");
    fs::copy(fixture("ddcolor_tiny.onnx"), &model).unwrap();
    // The network sees (g - 0.5) / 0.5, and half its answer is tanh's.
    let manifest = r#"
        name = "Mine"
        inputs = ["image"]
        image = "gray-rgb"
        input_range = [0, 1]
        mean = [0.5, 0.5, 0.5]
        std = [0.5, 0.5, 0.5]
        size = 64
        size_multiple = 1
        resize = "stretch"
        filter = "nearest"
        output = "ab"
        output_range = [-220, 220]
    "#;
    let ask = |path: &Path, settings: &TeacherSettings| {
        let mut teacher = open_with(path, Some(folder.path()), settings).unwrap();
        let answer = teacher.colorize("v.png", gray(2, 1, &[255, 255]), None);
        (
            answer.unwrap().unwrap().ab[0].map(f64::from),
            teacher.describe().kind,
        )
    };
    let (found, kind) = ask(&model, &settings(None, None));
    assert_near(found, [40.0, -20.0], 1e-3);
    assert_eq!(kind, "DDColor");

    fs::write(folder.path().join("mine.toml"), manifest).unwrap();
    let (found, kind) = ask(&model, &settings(None, None));
    assert_near(found, [20.0, -10.0], 1e-3);
    assert_eq!(kind, "Mine");
    let black = color_of_black(&model);
    // (0 - 0.5) / 0.5 = -1: a = 40 (2 · -1 - 1) = -120, b = 10 + 90, halved.
    assert_near(black, [-60.0, 50.0], 1e-3);

    // What is asked for wins over what lies there; a path is a manifest as well.
    assert_eq!(ask(&model, &settings(Some("ddcolor"), None)).1, "DDColor");
    let path = folder
        .path()
        .join("mine.toml")
        .to_string_lossy()
        .into_owned();
    let (found, _) = ask(&fixture("ddcolor_tiny.onnx"), &settings(Some(&path), None));
    assert_near(found, [20.0, -10.0], 1e-3);

    fs::write(
        folder.path().join("mine.toml"),
        manifest.replace("mean", "means"),
    )
    .unwrap();
    let message = refusal(&model, &settings(None, None));
    for part in ["mine.toml", "line 6", "`means`", "teachers.md"] {
        assert!(message.contains(part), "{message}");
    }
    let message = refusal(&model, &settings(Some("missing.toml"), None));
    assert!(message.contains("missing.toml"), "{message}");
    let message = refusal(&model, &settings(Some("caffe-v2"), None));
    assert!(
        message.contains("mine.onnx") && message.contains("Caffe v2"),
        "{message}"
    );
}

fn color_of_black(model: &Path) -> [f64; 2] {
    let mut teacher = open_with(model, None, &settings(None, None)).unwrap();
    let answer = teacher.colorize("v.png", gray(2, 1, &[0, 0]), None);
    answer.unwrap().unwrap().ab[0].map(f64::from)
}

#[test]
fn lightness_is_not_the_gray() {
    // The two differ by up to 3.4 in the middle; that a contract confuses them
    // would show here.
    let difference = (0..=255).map(|level| lightness(level) - f64::from(level) / 2.55);
    let largest = difference.fold(0.0, f64::max);
    assert!((3.3..3.5).contains(&largest), "{largest}");
    let (found, _) = color("siggraph17_tiny.onnx", &settings(None, None), 119);
    assert!((found[0] - (119.0 / 5.1 - 10.0)).abs() > 1.0, "{found:?}");
}
