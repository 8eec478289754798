//! `eval --against`, `--gray-frames` and `--detector`: others measured as the scene is.

use std::fs;

use gs_chroma::color::srgb_to_lab;
use image::{Rgb, RgbImage};
use serde_json::Value;

use super::program::Place;
use super::scene::SIZE;
use super::shared::{onnx, place_with_run};

/// Frames enough for Δ = 1 and 7.
const FRAMES: usize = 8;

fn eval(place: &Place, more: &[&str]) -> Value {
    place.json(&[&["eval", "--frames", "8", "--json"], more].concat())
}

/// The entries of a list that are of a method.
fn of<'a>(scores: &'a Value, method: &str) -> Vec<&'a Value> {
    let scores = scores.as_array().expect("a list").iter();
    scores.filter(|one| one["method"] == method).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

fn write_frames(place: &Place, folder: &str, color: impl Fn(usize) -> [u8; 3]) {
    fs::create_dir_all(place.path(folder)).expect("writable");
    for index in 0..FRAMES {
        let frame = RgbImage::from_pixel(SIZE[0], SIZE[1], Rgb(color(index)));
        // Without zeros before them: numbers are the order.
        let path = place.path(folder).join(format!("{}.png", index + 5));
        frame.save(path).expect("writable");
    }
}

/// An entry without its method.
fn figures(entry: &Value) -> Value {
    let mut entry = entry.clone();
    entry.as_object_mut().expect("an entry").remove("method");
    entry
}

#[test]
fn its_own_file_and_its_own_gray_frames() {
    let place = place_with_run();
    let color = "copy=runs/scene/color.ply";
    let found = eval(&place, &["--gray-frames", "gray", "--against", color]);
    for list in [
        &found["pictures"],
        &found["path"]["consistency"],
        &found["path"]["pictures"],
        &found["between"]["consistency"],
    ] {
        let [ours, theirs] = ["exported", "copy"].map(|method| {
            let entries = of(list, method).into_iter();
            entries.map(figures).collect::<Vec<_>>()
        });
        assert!(!ours.is_empty(), "{list}");
        assert_eq!(ours, theirs);
    }
    let files = place.files("gray");
    assert_eq!(files.len(), FRAMES, "{files:?}");
    assert_eq!(files[0], "frame-0000.png");

    // Colored by nobody, they are steady and pale, and their gray is that of the scene.
    let found = eval(&place, &["--against", "nobody=gray"]);
    let path = &found["path"];
    let [pictures] = of(&path["pictures"], "nobody")[..] else {
        panic!("{path}");
    };
    assert!(number(&pictures["colorfulness"]).abs() < 1e-3, "{pictures}");
    assert_eq!(number(&pictures["gray_psnr"]), 100.0);
    let consistency = of(&path["consistency"], "nobody");
    assert_eq!(consistency.len(), 2, "{path}");
    for one in consistency {
        assert!(number(&one["rms"]) < 1e-3, "{one}");
        assert!(number(&one["visible"]) > 0.1, "{one}");
    }
    // They are of no photo.
    assert!(of(&found["pictures"], "nobody").is_empty());
    assert!(of(&found["between"]["consistency"], "nobody").is_empty());
    let page = String::from_utf8(place.read("runs/scene/eval/index.html")).expect("text");
    assert!(page.contains("<li>nobody has no colors"), "{page}");
    for frame in [0, 2, 4, 6] {
        let name = format!("frame-{frame:04}-against-nobody.png");
        assert!(page.contains(&name), "{name}: {page}");
        let shown = image::open(place.path("runs/scene/eval").join(name)).expect("a picture");
        let gray = image::open(place.path(&format!("gray/frame-{frame:04}.png")));
        assert!(shown.to_rgb8() == gray.expect("a picture").to_rgb8());
    }
}

#[test]
fn films_whose_figures_are_known() {
    let place = place_with_run();
    let [red, blue] = [[255, 0, 0], [0, 0, 255]];
    write_frames(
        &place,
        "film",
        |index| if index % 2 == 0 { red } else { blue },
    );
    write_frames(&place, "still", |_| red);
    let detector = onnx("detector_tiny.onnx");
    let named = ["--against", "film=film", "--against", "still=still"];
    let found = eval(&place, &[&named[..], &["--detector", &detector]].concat());
    let path = &found["path"];
    let [[_, a, b], [_, c, d]] =
        [red, blue].map(|rgb| srgb_to_lab(rgb.map(|v| f64::from(v) / 255.0)));
    let apart = (((a - c).powi(2) + (b - d).powi(2)) / 2.0).sqrt();
    for (method, wanted) in [("film", apart), ("still", 0.0)] {
        // Both distances are odd.
        for one in of(&path["consistency"], method) {
            assert!(
                (number(&one["rms"]) - wanted).abs() < 1e-2,
                "{one} {wanted}"
            );
        }
    }
    // A class for each of blue, green and red, whose score is the mean of that channel; a quarter
    // of the detector's input is gray. In the film nothing lasts from one frame to the next.
    let score = (0.75 * 255.0 + 0.25 * 114.0) / 255.0;
    for (method, kept) in [("film", 0.0), ("still", 1.0)] {
        let [one] = of(&path["detections"], method)[..] else {
            panic!("{path}");
        };
        assert_eq!(
            (number(&one["per_frame"]), number(&one["kept"])),
            (1.0, kept)
        );
        assert!(
            (number(&one["score"]) - score).abs() < 1e-4,
            "{one} {score}"
        );
    }
    for method in ["luma", "exported"] {
        assert_eq!(of(&path["detections"], method).len(), 1, "{method}");
    }
    let error = fails(&place, &["--detector", &onnx("perceptual.onnx")]);
    assert!(
        error.contains("perceptual.onnx: a detector has one input"),
        "{error}"
    );
}

/// The error of an evaluation that fails.
fn fails(place: &Place, more: &[&str]) -> String {
    let done = place.run(&[&["eval", "--frames", "8"], more].concat());
    assert_eq!(done.code, Some(1), "{more:?}: {}", done.stderr);
    done.stderr
}

#[test]
fn what_cannot_be_compared_is_said_with_the_remedy() {
    let place = place_with_run();
    write_frames(&place, "film", |_| [90, 80, 70]);
    let refused = |named: &[&str], parts: &[&str]| {
        let arguments = named.iter().flat_map(|named| ["--against", named]);
        let error = fails(&place, &arguments.collect::<Vec<_>>());
        for part in parts {
            assert!(error.contains(part), "{named:?}, {part}: {error}");
        }
        assert_eq!(error.lines().count(), 1, "{error}");
    };
    refused(
        &["film=film", "Film=film"],
        &["Film: names something else", "choose another"],
    );
    refused(&["rgb_splats=film"], &["rgb_splats: names something else"]);
    refused(&["film=nowhere"], &["nowhere"]);
    refused(&["film=nowhere.ply"], &["nowhere.ply"]);
    refused(
        &["film=scene/sparse"],
        &["holds 0 pictures", "--gray-frames"],
    );
    place.write("broken.ply", "ply\nformat ascii 1.0\n");
    refused(&["film=broken.ply"], &["broken.ply"]);

    let third = place.path("film/7.png");
    let bytes = fs::read(&third).expect("a file");
    fs::write(&third, &bytes[..bytes.len() / 2]).expect("writable");
    refused(&["film=film"], &["film/7.png"]);
    RgbImage::new(SIZE[1], SIZE[0])
        .save(&third)
        .expect("writable");
    refused(
        &["film=film"],
        &["film/7.png: has 48×64 pixels", "64×48", "keep their size"],
    );
    fs::remove_file(third).expect("a file");
    refused(
        &["film=film"],
        &["film: holds 7 pictures; the path has 8 frames", "--frames"],
    );

    // The photos are not written over, and nothing of another program is.
    let error = fails(&place, &["--gray-frames", "scene/images"]);
    assert!(error.contains("scene/images"), "{error}");
    for named in ["film", "=film", "film=", "a film=film"] {
        let usage = place.run(&["eval", "--against", named]);
        assert_eq!(usage.code, Some(2), "{named}: {}", usage.stderr);
    }
}
