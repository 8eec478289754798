//! Poison in any number of a COLMAP model: an error of one line that names the
//! place, or a capture without it.

use std::{fmt::Write, fs};

use gs_chroma::capture::{Capture, LoadOptions, Loader};
use proptest::prelude::*;

const POISON: [&str; 12] = [
    "nan",
    "inf",
    "-inf",
    "1e400",
    "-1e39",
    "1e308",
    "1e-320",
    "-0",
    "0",
    "-1",
    "18446744073709551616",
    "x",
];

const PINHOLE: &str = "1 PINHOLE 8 6 7.5 7.5 4 3";

/// A lens of every kind of formula, wide enough for the fisheyes to become faces.
const LENSES: [&str; 7] = [
    "1 FULL_OPENCV 8 6 7.5 7.5 4 3 -0.2 0.05 0.01 -0.01 0.01 0.1 0.02 0.01",
    "1 THIN_PRISM_FISHEYE 8 6 3.5 3.5 4 3 -0.02 0.05 0.01 -0.01 0.01 0.01 0.02 0.01",
    "1 RAD_TAN_THIN_PRISM_FISHEYE 8 6 3 3 4 3 0.1 0 0 0 0 0 0.01 0.01 0.01 0 0.01 0",
    "1 FOV 8 6 4 4 4 3 0.9",
    "1 DIVISION 8 6 7.5 7.5 4 3 -0.3",
    "1 EUCM 8 6 7.5 7.5 4 3 0.6 1.1",
    "1 EQUIRECTANGULAR 8 6 8 6",
];

/// The numbers of a small model, file by file and line by line.
fn model(camera: &str) -> [Vec<Vec<String>>; 3] {
    let words = |line: &str| line.split(' ').map(str::to_owned).collect::<Vec<_>>();
    let cameras = vec![words(camera)];
    let mut images = Vec::new();
    for i in 1..=9 {
        images.push(words(&format!(
            "{i} 1 0 0 0 {} 0.1 2 1 photo{i}.png",
            f64::from(i) * 0.1
        )));
        images.push(words("3.5 2.5 1"));
    }
    let points = (1..=6)
        .map(|i| words(&format!("{i} 0.{i} -0.2 1 90 91 92 0.5 1 0 2 0")))
        .collect();
    [cameras, images, points]
}

/// Writes the model of a camera with the number at `(file, line, word)` replaced, and
/// reads it and its first photo back.
fn load(camera: &str, change: Option<(usize, usize, usize, &str)>) -> Result<Capture, String> {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let sparse = folder.path().join("sparse/0");
    fs::create_dir_all(&sparse).unwrap();
    fs::create_dir_all(folder.path().join("images")).unwrap();
    for i in 1..=9 {
        let photo = folder.path().join(format!("images/photo{i}.png"));
        image::GrayImage::new(8, 6).save(photo).unwrap();
    }
    let mut model = model(camera);
    if let Some((file, line, word, poison)) = change {
        let lines = &mut model[file];
        let line = line % lines.len();
        let word = word % lines[line].len();
        lines[line][word] = poison.to_owned();
    }
    for (name, lines) in ["cameras", "images", "points3D"].into_iter().zip(model) {
        let mut text = String::new();
        for words in lines {
            writeln!(text, "{}", words.join(" ")).unwrap();
        }
        fs::write(sparse.join(format!("{name}.txt")), text).unwrap();
    }
    let capture = Capture::load(folder.path()).map_err(|error| error.to_string())?;
    for view in capture
        .views
        .iter()
        .filter(|view| view.photo == "photo1.png")
    {
        let (photo, camera) = Loader::new(LoadOptions::default())
            .load(view)
            .map_err(|error| error.to_string())?;
        assert_eq!((photo.width, photo.height), (camera.width, camera.height));
    }
    Ok(capture)
}

fn check(
    camera: &str,
    file: usize,
    line: usize,
    word: usize,
    poison: &str,
) -> Result<(), TestCaseError> {
    match load(camera, Some((file, line, word, poison))) {
        Err(message) => {
            prop_assert_eq!(message.lines().count(), 1);
            let named = ["cameras", "images", "points3D", "photo", "camera", "sparse"];
            prop_assert!(
                named.iter().any(|name| message.contains(name)),
                "{}",
                message
            );
        }
        Ok(capture) => {
            prop_assert!(!capture.views.is_empty() && !capture.points.is_empty());
            for view in &capture.views {
                let camera = &view.camera;
                prop_assert!(camera.rotation.is_finite() && camera.translation.is_finite());
                let lens = [camera.fx, camera.fy, camera.cx, camera.cy];
                prop_assert!(lens.iter().all(|v| v.is_finite()), "{:?}", lens);
                prop_assert!(camera.fx > 0.0 && camera.fy > 0.0 && camera.width > 0);
            }
            for point in &capture.points {
                prop_assert!(point.position.is_finite());
                for seen in &point.track {
                    prop_assert!(seen.view < capture.views.len());
                    prop_assert!(seen.pixel.iter().all(|c| c.is_finite()));
                }
            }
            prop_assert!((0.0..1e9).contains(&capture.distortion));
            let extent = capture.extent();
            prop_assert!(extent.is_finite() && extent > 0.0, "extent {}", extent);
        }
    }
    Ok(())
}

#[test]
fn the_model_itself_is_sound() {
    let capture = load(PINHOLE, None).unwrap();
    assert_eq!((capture.views.len(), capture.points.len()), (9, 6));
    for camera in LENSES {
        let capture = load(camera, None).unwrap();
        assert_eq!(capture.views.len() % 9, 0, "{camera}");
        assert!(capture.distortion > 0.05, "{camera}");
    }
}

/// Every poison in every number of one camera, one image and one point.
#[test]
fn every_poison_in_every_number() {
    for (file, words) in [(0, 8), (1, 10), (2, 12)] {
        for word in 0..words {
            for poison in POISON {
                check(PINHOLE, file, 0, word, poison)
                    .unwrap_or_else(|reason| panic!("{poison} in {file}, word {word}: {reason}"));
            }
        }
    }
}

/// Every poison in every number of every lens.
#[test]
fn every_poison_in_a_lens() {
    for camera in LENSES {
        for word in 0..camera.split(' ').count() {
            for poison in POISON {
                check(camera, 0, 0, word, poison)
                    .unwrap_or_else(|reason| panic!("{poison} in {camera}, word {word}: {reason}"));
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn poison_anywhere(
        file in 0..3_usize,
        line in 0..20_usize,
        word in 0..12_usize,
        value in prop_oneof![
            proptest::sample::select(POISON.to_vec()).prop_map(str::to_owned),
            proptest::num::f64::ANY.prop_map(|v| v.to_string()),
        ],
    ) {
        check(PINHOLE, file, line, word, &value)?;
    }
}
