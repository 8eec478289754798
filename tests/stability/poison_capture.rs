//! Poison in any number of a COLMAP model: an error of one line that names the
//! place, or a capture without it.

use std::{fmt::Write, fs};

use gs_chroma::capture::Capture;
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

/// The numbers of a small model, file by file and line by line.
fn model() -> [Vec<Vec<String>>; 3] {
    let words = |line: &str| line.split(' ').map(str::to_owned).collect::<Vec<_>>();
    let cameras = vec![words("1 PINHOLE 8 6 7.5 7.5 4 3")];
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

/// Writes the model with the number at `(file, line, word)` replaced, and reads it back.
fn load(change: Option<(usize, usize, usize, &str)>) -> Result<Capture, String> {
    let folder = tempfile::tempdir_in(env!("CARGO_TARGET_TMPDIR")).unwrap();
    let sparse = folder.path().join("sparse/0");
    fs::create_dir_all(&sparse).unwrap();
    fs::create_dir_all(folder.path().join("images")).unwrap();
    for i in 1..=9 {
        let photo = folder.path().join(format!("images/photo{i}.png"));
        image::GrayImage::new(8, 6).save(photo).unwrap();
    }
    let mut model = model();
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
    Capture::load(folder.path()).map_err(|error| error.to_string())
}

fn check(file: usize, line: usize, word: usize, poison: &str) -> Result<(), TestCaseError> {
    match load(Some((file, line, word, poison))) {
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
            }
            let extent = capture.extent();
            prop_assert!(extent.is_finite() && extent > 0.0, "extent {}", extent);
        }
    }
    Ok(())
}

#[test]
fn the_model_itself_is_sound() {
    let capture = load(None).unwrap();
    assert_eq!((capture.views.len(), capture.points.len()), (9, 6));
}

/// Every poison in every number of one camera, one image and one point.
#[test]
fn every_poison_in_every_number() {
    for (file, words) in [(0, 8), (1, 10), (2, 12)] {
        for word in 0..words {
            for poison in POISON {
                check(file, 0, word, poison)
                    .unwrap_or_else(|reason| panic!("{poison} in {file}, word {word}: {reason}"));
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
        check(file, line, word, &value)?;
    }
}
