//! `teacher check`.

use super::program::Place;
use super::shared::{QUICK_FIT, onnx, place_with_run, place_with_scene};

#[test]
fn a_network_that_its_shapes_describe() {
    let place = Place::new();
    let checkup = place.json(&["teacher", "check", &onnx("ddcolor_tiny.onnx"), "--json"]);
    assert_eq!(checkup["kind"], "DDColor");
    assert_eq!(checkup["told_by"], "shapes");
    assert_eq!(checkup["known_as"], serde_json::Value::Null);
    assert_eq!(checkup["trials"].as_array().map(Vec::len), Some(0));
    // a = 40 (2 g - 1), b = 10 - 30 (2 g - 1), and g goes from 0 to 1 in 32 steps.
    let ramp = &checkup["answers"][0];
    let [least, most] = [0, 1].map(|i| ramp["range"][i].as_f64().expect("a number"));
    assert!(
        (least + 40.0).abs() < 2.0 && (most - 40.0).abs() < 2.0,
        "{ramp}"
    );
    assert!(ramp["colorfulness"].as_f64() > Some(20.0), "{ramp}");
}

#[test]
fn a_network_that_nobody_describes_is_tried() {
    for (name, expected) in [
        ("deoldify_tiny.onnx", "gray 0 to 255 in, RGB 0 to 255 out"),
        (
            "deoldify_browser_tiny.onnx",
            "gray 0 to 1 in, RGB 0 to 1 out",
        ),
        ("pixels_tiny.onnx", "gray 0 to 255 in, RGB 0 to 255 out"),
        ("unit_tiny.onnx", "gray 0 to 1 in, a, b / 110 out"),
        ("two_answers_tiny.onnx", "gray 0 to 1 in, a, b out"),
    ] {
        let words = Place::new().succeed(&["teacher", "check", &onnx(name)]);
        for part in [
            name,
            "a guess",
            "tried",
            "SHA-256",
            "ramp: answers",
            "garden: answers",
        ] {
            assert!(words.contains(part), "{part}: {words}");
        }
        assert!(words.contains(&format!("\n{expected}: ")), "{words}");
    }
}

#[test]
fn what_is_understood_becomes_a_manifest_that_colorize_takes() {
    let place = place_with_scene();
    let network = onnx("deoldify_tiny.onnx");
    place.succeed(&QUICK_FIT);
    let colorize = ["colorize", "--teacher", &network, "--rounds", "2", "--json"];
    let refused = place.run(&colorize);
    assert_eq!(refused.code, Some(1));
    assert!(
        refused.stderr.contains("gs-chroma teacher check"),
        "{}",
        refused.stderr
    );
    place.succeed(&["teacher", "check", &network, "--manifest", "mine.toml"]);
    let report = place.json(&[&colorize[..], &["--teacher-profile", "mine.toml"]].concat());
    let teacher = &report["chroma"]["teachers"][0];
    assert_eq!(teacher["kind"], "gray 0 to 255 in, RGB 0 to 255 out");
    assert_eq!(teacher["device"], "cpu");
}

#[test]
fn a_network_that_answers_gray_is_told_of() {
    let place = place_with_run();
    let network = onnx("ddcolor_tiny.onnx");
    place.succeed(&["teacher", "check", &network, "--manifest", "mine.toml"]);
    let manifest = String::from_utf8(place.read("mine.toml")).expect("text");
    let [range, far] = ["-110.0, 110.0", "-1e5, 1e5"];
    assert!(manifest.contains(range), "{manifest}");
    place.write("mine.toml", manifest.replace(range, far));
    let warned = |more: &[&str]| {
        let colorize = ["colorize", "--teacher", &network, "--rounds", "1"];
        let done = place.run(&[&colorize[..], more].concat());
        assert_eq!(done.code, Some(0), "{}", done.stderr);
        done.stderr.contains("gives each photo one color")
    };
    assert!(!warned(&[]));
    assert!(warned(&["--teacher-profile", "mine.toml"]));
}

#[test]
fn what_cannot_be_checked() {
    let place = Place::new();
    place.write("no.jpg", "no photo");
    let network = onnx("ddcolor_tiny.onnx");
    for (arguments, parts) in [
        (
            vec![onnx("wrong_rank.onnx")],
            vec!["wrong_rank.onnx", "[1,8]"],
        ),
        (vec![onnx("truncated.onnx")], vec!["truncated.onnx"]),
        (
            vec![network.clone(), "--photo".into(), "no.jpg".into()],
            vec!["no.jpg"],
        ),
        (
            vec![network.clone(), "--teacher-size".into(), "64".into()],
            vec!["--teacher-size 64", "takes 32"],
        ),
        (vec!["nonsense".into()], vec!["nonsense", "eccv16"]),
        (
            vec![network, "--teacher-device".into(), "cuda".into()],
            vec!["without cuda", "--teacher-device"],
        ),
    ] {
        let arguments = [vec!["teacher".to_owned(), "check".to_owned()], arguments].concat();
        let done = place.run(&arguments);
        assert_eq!(done.code, Some(1), "{}", done.stderr);
        assert_eq!(done.stderr.lines().count(), 1, "{}", done.stderr);
        for part in parts {
            assert!(done.stderr.contains(part), "{part}: {}", done.stderr);
        }
    }
}
