//! Photos whose names are easily mistaken for each other's.

use std::fs;

use image::{GrayImage, Luma, RgbImage};

use super::program::Place;
use super::scene;
use super::shared::QUICK_FIT;

/// Two pairs that differ only behind a dot.
const NAMES: [&str; 4] = ["shot0.jpg", "shot0.png", "frame_2.4", "frame_2.5"];

/// The scene with its first photos under these names; what they hold, no name says.
fn renamed(names: &[&str]) -> Place {
    let place = Place::new();
    scene::write_moved(&place.path("scene"), [0.0; 3]);
    let model = "scene/sparse/images.txt";
    let mut images = String::from_utf8(place.read(model)).expect("text");
    for (index, name) in names.iter().enumerate() {
        let before = scene::name(index);
        images = images.replace(&format!(" {before}\n"), &format!(" {name}\n"));
        let [from, to] = [before.as_str(), name].map(|name| place.path("scene/images").join(name));
        fs::rename(from, to).expect("a photo");
    }
    place.write(model, images);
    place
}

/// A place with a run of photos of these names.
fn trained(names: &[&str]) -> Place {
    let place = renamed(names);
    let done = place.run(&QUICK_FIT);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert_sound(&done.stderr);
    place
}

/// Nothing is doubtful but that three iterations show no detail.
fn assert_sound(stderr: &str) {
    let mut doubts = stderr.lines().filter(|line| line.starts_with("warning"));
    let about_names = doubts.find(|line| !line.contains("hardly any of its detail"));
    assert_eq!(about_names, None, "{stderr}");
}

#[test]
fn each_view_has_a_picture_of_its_own() {
    let place = trained(&NAMES);
    place.succeed(&["render", "--views", "all", "-o", "out"]);
    let files = place.files("out");
    assert_eq!(files.len(), scene::VIEWS, "{files:?}");
    for name in NAMES {
        assert!(files.contains(&format!("{name}.png")), "{files:?}");
    }
    // Nothing is called otherwise than it has to be.
    assert!(files.contains(&"left/08.png".to_owned()), "{files:?}");
}

#[test]
fn an_image_colors_no_photo_but_its_own() {
    let place = trained(&NAMES);
    let paint = |name: &str| {
        let path = place.path("painted").join(name);
        fs::create_dir_all(place.path("painted")).expect("a folder");
        let [width, height] = scene::SIZE;
        let image = RgbImage::from_pixel(width, height, image::Rgb([200, 90, 40]));
        image.save(path).expect("an image");
    };
    let colorize = |teacher: &str| {
        let teacher = ["--teacher", teacher, "--rounds", "1"];
        place.run(&[&["colorize", "runs/scene", "--json"][..], &teacher].concat())
    };
    let colored = |teacher: &str| {
        let done = colorize(teacher);
        assert_eq!(done.code, Some(0), "{}", done.stderr);
        let report: serde_json::Value = serde_json::from_str(&done.stdout).expect("JSON");
        report["chroma"]["colored_views"].clone()
    };
    paint("shot0.png");
    paint("frame_2.4.png");
    // Of ten photos two are held out.
    let train = scene::VIEWS - scene::HELD_OUT;
    assert_eq!(colored("scene/images"), train);
    // Both are of photos that are trained on.
    assert_eq!(colored("painted"), 2);
    // The image of a third kind may be either's.
    fs::rename(
        place.path("painted/shot0.png"),
        place.path("painted/shot0.jpeg"),
    )
    .expect("an image");
    let done = colorize("painted");
    assert_eq!(done.code, Some(1), "{}", done.stderr);
    let line = done.stderr.lines().last().unwrap_or_default();
    for word in ["painted/shot0.jpeg", "shot0.jpg", "shot0.png"] {
        assert!(line.contains(word), "{line}");
    }
}

#[test]
fn masks_cover_no_photo_but_their_own() {
    let place = renamed(&NAMES);
    let [width, height] = scene::SIZE;
    let mask = GrayImage::from_fn(width, height, |x, _| Luma([if x < 20 { 0 } else { 255 }]));
    fs::create_dir_all(place.path("scene/masks")).expect("a folder");
    mask.save(place.path("scene/masks/shot0.png"))
        .expect("a mask");
    let info = place.json(&["info", "scene", "--json"]);
    assert_eq!(info["masked_views"], 1);
}

#[test]
fn names_may_be_composed_or_not() {
    let composed = "Gr\u{f6}\u{df}e.png";
    let place = renamed(&["Gro\u{308}\u{df}e.png"]);
    let images = String::from_utf8(place.read("scene/sparse/images.txt")).expect("text");
    place.write(
        "scene/sparse/images.txt",
        images.replace("Gro\u{308}\u{df}e.png", composed),
    );
    let done = place.run(&QUICK_FIT);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert_sound(&done.stderr);
}
