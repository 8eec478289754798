//! Names of photos in COLMAP's files and on the disk.

use std::fs;

use super::fixtures::{Model, folder, load, load_files, write};
use super::*;

/// Composed, and with the accent as a character of its own.
const NAMES: [&str; 2] = ["Gr\u{f6}\u{df}e/b.png", "Gro\u{308}\u{df}e/b.png"];

#[test]
fn accents_may_be_spelled_otherwise_on_the_disk() {
    for [in_model, on_disk] in [NAMES, [NAMES[1], NAMES[0]]] {
        let mut model = Model::example();
        model.images[0].name = on_disk.into();
        let dir = folder(&model);
        model.images[0].name = in_model.into();
        write(dir.path(), "sparse/0", model.binary(), "bin");
        let capture = Capture::load(dir.path()).unwrap();
        let view = capture.views.iter().find(|view| view.photo == in_model);
        let view = view.expect("the photo");
        assert!(view.image_path.is_file() && view.image_path.ends_with(on_disk));
        assert_eq!(Unplaced::of(&capture).unwrap(), None);
        // What is not there at all is missed under the model's name.
        fs::remove_file(&view.image_path).unwrap();
        let error = Capture::load(dir.path()).unwrap_err().to_string();
        assert!(error.contains(in_model), "{error}");
    }
}

#[test]
fn a_byte_order_mark_is_passed_over() {
    let model = Model::example();
    let plain = load_files(&model, model.text(), "txt").unwrap();
    let marked = model
        .text()
        .map(|file| [b"\xef\xbb\xbf", &file[..]].concat());
    let marked = load_files(&model, marked, "txt").unwrap();
    assert_eq!(marked.points, plain.points);
    assert_eq!(marked.views.len(), plain.views.len());
}

/// Asserts that a message gives the remedy for an image's name.
#[track_caller]
fn names_the_remedy(error: CaptureError, words: &[&str]) {
    let error = error.to_string();
    let remedy = ["rename the photos", "edit the names in images.txt"];
    for word in words.iter().chain(&remedy) {
        assert!(error.contains(word), "no {word:?} in: {error}");
    }
    assert!(!error.contains("export the model"), "{error}");
}

#[test]
fn names_that_lead_nowhere_say_what_helps() {
    let mut model = Model::example();
    model.images[2].name = "/data/house/images/x.png".into();
    let words = ["image 3", "/data/house/images/x.png"];
    names_the_remedy(load(&model).unwrap_err(), &words);
    names_the_remedy(load_files(&model, model.text(), "txt").unwrap_err(), &words);
}

#[test]
fn names_in_other_encodings_are_shown() {
    let mut model = Model::example();
    model.images[2].name = "Gr??e.png".into();
    let latin = |file: Vec<u8>| {
        let at = file.windows(2).position(|pair| pair == b"??");
        let mut file = file;
        if let Some(at) = at {
            file[at..at + 2].copy_from_slice(b"\xf6\xdf");
        }
        file
    };
    let words = ["image 3", "Gr\u{fffd}\u{fffd}e.png", "not UTF-8"];
    for (files, extension) in [(model.binary(), "bin"), (model.text(), "txt")] {
        let error = load_files(&model, files.map(latin), extension).unwrap_err();
        names_the_remedy(error, &words);
    }
    // In a comment it does no harm.
    let model = Model::example();
    let [cameras, images, points] = model.text();
    let commented = [b"# Gr\xf6\xdfe\n", &images[..]].concat();
    assert!(load_files(&model, [cameras, commented, points], "txt").is_ok());
}
