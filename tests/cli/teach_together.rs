//! `colorize` with several teachers, hints, strengths and profiles.

use std::fs;

use image::{Rgb, RgbImage, Rgba, RgbaImage};
use serde_json::Value;

use super::program::Place;
use super::scene;
use super::shared::{onnx, place_with_run};
use super::splat_file::SplatFile;

const RED: [u8; 3] = [200, 90, 60];
const BLUE: [u8; 3] = [60, 110, 200];

/// Writes images of one color for some views.
fn paint(place: &Place, folder: &str, color: [u8; 3], views: &[usize]) {
    let [width, height] = scene::SIZE;
    for &view in views {
        let path = place.path(folder).join(scene::name(view));
        fs::create_dir_all(path.parent().expect("a parent")).expect("writable");
        let image = RgbImage::from_pixel(width, height, Rgb(color));
        image.save(path).expect("writable");
    }
}

/// Writes hints that cover the left part of some views; the rest is transparent.
fn hint(place: &Place, color: [u8; 3], views: &[usize], columns: u32) {
    let [width, height] = scene::SIZE;
    let [r, g, b] = color;
    for &view in views {
        let path = place.path("hints").join(scene::name(view));
        fs::create_dir_all(path.parent().expect("a parent")).expect("writable");
        let alpha = |x: u32| if x < columns { 255 } else { 0 };
        let image = RgbaImage::from_fn(width, height, |x, _| Rgba([r, g, b, alpha(x)]));
        image.save(path).expect("writable");
    }
}

/// The chroma report of a short coloring with these arguments.
fn colorize(place: &Place, arguments: &[&str]) -> Value {
    let start = ["colorize", "--solver", "adam", "--until", "120", "--json"];
    place.json(&[&start[..], arguments].concat())["chroma"].clone()
}

/// Share of the Gaussians that are more red than blue.
fn redder(place: &Place) -> f64 {
    let file = SplatFile::read(place, "runs/scene/color.ply");
    let [red, blue] = ["f_dc_0", "f_dc_2"].map(|name| file.column(name));
    let count = red.iter().zip(&blue).filter(|(r, b)| r > b).count();
    count as f64 / file.count() as f64
}

fn all() -> Vec<usize> {
    (0..scene::VIEWS).collect()
}

#[test]
fn two_teachers_are_averaged_by_weight() {
    let place = place_with_run();
    paint(&place, "red", RED, &all());
    // The second teacher does not know the last view, which the first colors alone.
    paint(&place, "blue", BLUE, &all()[..scene::VIEWS - 1]);
    let both = ["--teacher", "red", "--teacher", "blue"];
    let chroma = colorize(&place, &[&both[..], &["--weights", "1,9"]].concat());
    // As it does not know all, none of its images is held out.
    assert_eq!(chroma["colored_views"], scene::VIEWS);
    let teachers = chroma["teachers"].as_array().expect("a list");
    assert_eq!(teachers.len(), 2);
    for (teacher, (name, weight)) in teachers.iter().zip([("red", 1.0), ("blue", 9.0)]) {
        assert_eq!(teacher["name"], name);
        assert_eq!(teacher["kind"], "folder");
        assert_eq!(teacher["weight"], weight);
    }
    assert!(redder(&place) < 0.4, "{}", redder(&place));
    let chroma = colorize(&place, &[&both[..], &["--weights", "9,1"]].concat());
    assert_eq!(chroma["teachers"][0]["weight"], 9.0);
    assert!(redder(&place) > 0.8, "{}", redder(&place));
}

#[test]
fn a_network_and_a_folder_teach_together() {
    let place = place_with_run();
    paint(&place, "red", RED, &[1]);
    let network = onnx("ddcolor_tiny.onnx");
    let chroma = colorize(&place, &["--teacher", &network, "--teacher", "red"]);
    assert_eq!(chroma["colored_views"], scene::VIEWS - scene::HELD_OUT);
    let kinds: Vec<_> = (0..2).map(|i| &chroma["teachers"][i]["kind"]).collect();
    assert_eq!(kinds, ["DDColor", "folder"]);
}

#[test]
fn strength_scales_the_teachers_colors() {
    let place = place_with_run();
    paint(&place, "red", RED, &all());
    let colorfulness = |strength: &str| {
        let chroma = colorize(&place, &["--teacher", "red", "--strength", strength]);
        let expected: f64 = strength.parse().expect("a number");
        assert_eq!(chroma["strength"], expected);
        chroma["pictures"]["teacher_colorfulness"]
            .as_f64()
            .expect("a number")
    };
    let [none, half, whole] = ["0", "0.5", "1"].map(colorfulness);
    assert!(none < 0.5, "{none}");
    assert!((half / whole - 0.5).abs() < 0.1, "{half} {whole}");
}

#[test]
fn hints_outweigh_the_teacher_where_they_are() {
    let place = place_with_run();
    paint(&place, "red", RED, &all());
    let chroma = colorize(&place, &["--teacher", "red"]);
    assert_eq!(
        (&chroma["hints"], chroma["teachers"][0]["name"].as_str()),
        (&0.into(), Some("red"))
    );
    assert!(redder(&place) > 0.9, "{}", redder(&place));
    hint(&place, BLUE, &all(), scene::SIZE[0]);
    let hinted = ["--teacher", "red", "--hints", "hints"];
    let chroma = colorize(&place, &hinted);
    // Those on held-out photos, too, and then there is none left to measure.
    assert_eq!(chroma["hints"], scene::VIEWS);
    assert_eq!(chroma["measured_on"], "train");
    assert!(redder(&place) < 0.2, "{}", redder(&place));
    // Strength is the teachers' alone.
    colorize(&place, &[&hinted[..], &["--strength", "0"]].concat());
    assert!(redder(&place) < 0.2, "{}", redder(&place));
}

#[test]
fn hints_do_without_a_teacher() {
    let place = place_with_run();
    hint(&place, BLUE, &[1, 2, 5], scene::SIZE[0]);
    // Held out, which is no matter; and one without paint, which is noted.
    hint(&place, BLUE, &[0], scene::SIZE[0]);
    hint(&place, BLUE, &[6], 0);
    let arguments = [
        "colorize", "--solver", "adam", "--until", "120", "--json", "--hints", "hints",
    ];
    let done = place.run(&arguments);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(
        done.stderr.contains("06.png: nothing is painted"),
        "{}",
        done.stderr
    );
    let chroma = &place.report("runs/scene")["chroma"];
    assert_eq!(
        (&chroma["hints"], &chroma["colored_views"]),
        (&4.into(), &4.into())
    );
    assert_eq!(chroma["teachers"].as_array().map(Vec::len), Some(0));
    assert!(redder(&place) < 0.2, "{}", redder(&place));
}

#[test]
fn a_network_with_hint_inputs_is_told_of_them() {
    let place = place_with_run();
    let network = onnx("siggraph17_full_tiny.onnx");
    let plain = colorize(&place, &["--teacher", &network]);
    assert_eq!(plain["teachers"][0]["kind"], "SIGGRAPH17 with hints");
    let answers = place.files("runs/scene/teacher").len();
    hint(&place, BLUE, &[1, 2], scene::SIZE[0] / 2);
    colorize(&place, &["--teacher", &network, "--hints", "hints"]);
    // Asked anew where there are hints, and only there.
    assert_eq!(place.files("runs/scene/teacher").len(), answers + 2);
}

#[test]
fn options_of_networks_without_one_are_remarked_on() {
    let place = place_with_run();
    paint(&place, "red", RED, &all());
    let until = [
        "colorize",
        "--solver",
        "adam",
        "--until",
        "62",
        "--teacher",
        "red",
    ];
    let done = place.run(&[&until[..], &["--teacher-size", "64"]].concat());
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(
        done.stderr.contains("no teacher is a network"),
        "{}",
        done.stderr
    );
    let done = place.run(&until);
    assert!(!done.stderr.contains("network"), "{}", done.stderr);
}

#[test]
fn profile_size_and_upsampling_are_asked_for() {
    let place = place_with_run();
    let network = onnx("deoldify_tiny.onnx");
    let asked = ["--teacher", &network, "--teacher-profile", "deoldify"];
    let chroma = colorize(&place, &[&asked[..], &["--teacher-size", "64"]].concat());
    assert_eq!(chroma["teachers"][0]["kind"], "DeOldify");
    assert_eq!(
        chroma["teachers"][0]["input_size"],
        serde_json::json!([64, 64])
    );
    assert_eq!(chroma["upsample"], "guided");
    let answers = place.files("runs/scene/teacher").len();
    // Another size is another question.
    let smaller = ["--teacher-size", "32", "--upsample", "bilinear"];
    let chroma = colorize(&place, &[&asked[..], &smaller].concat());
    assert_eq!(chroma["upsample"], "bilinear");
    assert_eq!(
        place.files("runs/scene/teacher").len(),
        answers + scene::VIEWS
    );
}

#[test]
fn help_and_guide_name_every_profile() {
    let place = place_with_run();
    let network = onnx("deoldify_tiny.onnx");
    let asked = [
        "colorize",
        "--teacher",
        &network,
        "--teacher-profile",
        "none",
    ];
    let refused = place.run(&asked).stderr;
    let names = refused
        .split_once("there are ")
        .and_then(|(_, rest)| rest.split_once(", or"));
    let names: Vec<_> = names.expect("a list").0.split(", ").collect();
    assert!(names.len() > 6, "{names:?}");
    let help = place.succeed(&["colorize", "--help"]);
    let guide = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/guides/teachers.md");
    let guide = fs::read_to_string(guide).expect("the guide");
    for name in names {
        assert!(help.contains(name), "{name}");
        assert!(guide.contains(&format!("`{name}`")), "{name}");
    }
}

/// The manifest that the guide shows is a whole one.
#[test]
fn the_guides_manifest_is_taken() {
    let place = place_with_run();
    let guide = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/guides/teachers.md");
    let guide = fs::read_to_string(guide).expect("the guide");
    let (_, manifest) = guide.split_once("```toml\n").expect("a manifest");
    let (manifest, _) = manifest.split_once("```").expect("its end");
    let network = fs::read(onnx("unit_tiny.onnx")).expect("a fixture");
    place.write("mine.onnx", network);
    place.write("mine.toml", manifest);
    let chroma = colorize(&place, &["--teacher", "mine.onnx"]);
    assert_eq!(chroma["teachers"][0]["kind"], "Mine");
}
