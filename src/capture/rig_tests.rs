//! Rigs and frames beside images.

use std::fs;
use std::path::Path;

use super::fixtures::{Model, folder, write};
use super::*;

/// A rig of both cameras of the example, with an IMU; the second is two units beside the first.
const RIGS: &str = "# a comment\n1 3 CAMERA 7 IMU 5 1 1 0 0 0 0 0 0 CAMERA 3 1 1 0 0 0 -2 0 0\n";
/// The first two images of the example are one frame, the third another.
const FRAMES: &str = "1 1 0.8 0 0.6 0 1 0.25 2 3 CAMERA 7 0 IMU 5 9 CAMERA 3 1
2 1 0.8 0 0.6 0 0 0.25 2 1 CAMERA 7 2\n";

/// The same as a binary file, of which records begin with integers of these sizes; 0 stands for a
/// pose. The last ones repeat to the record's end.
fn binary(text: &str, begin: &[usize], repeated: &[usize]) -> Vec<u8> {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let mut bytes = (lines.clone().count() as u64).to_le_bytes().to_vec();
    for line in lines {
        let mut words = line.split(' ').peekable();
        let mut sizes = begin.iter().chain(repeated.iter().cycle());
        while words.peek().is_some() {
            match sizes.next() {
                Some(0) => (words.by_ref().take(7))
                    .for_each(|word| bytes.extend(word.parse::<f64>().unwrap().to_le_bytes())),
                size => {
                    let number: u64 = match words.next() {
                        Some("CAMERA") => 0,
                        Some("IMU") => 1,
                        word => word.unwrap().parse().unwrap(),
                    };
                    bytes.extend(&number.to_le_bytes()[..*size.unwrap()]);
                }
            }
        }
    }
    bytes
}

fn binary_files(rigs: &str, frames: &str) -> [Vec<u8>; 2] {
    [
        binary(rigs, &[4, 4, 4, 4], &[4, 4, 1, 0]),
        binary(frames, &[4, 4, 0, 4], &[4, 4, 8]),
    ]
}

/// Loads the example with such files beside it, as text and binary, which are alike.
fn load(rigs: &str, frames: &str) -> Result<Capture, String> {
    let model = Model::example();
    let dir = folder(&model);
    let sparse = dir.path().join("sparse/0");
    let load = |extension: &str, files, [rigs, frames]: [Vec<u8>; 2]| {
        write(dir.path(), "sparse/0", files, extension);
        fs::write(sparse.join("rigs").with_extension(extension), rigs).unwrap();
        fs::write(sparse.join("frames").with_extension(extension), frames).unwrap();
        let capture = Capture::load(dir.path()).map_err(|error| error.to_string());
        fs::remove_dir_all(&sparse).unwrap();
        capture.map(|capture| Capture {
            root: "scene".into(),
            photos: "scene/images".into(),
            doubts: (capture.doubts.iter())
                .map(|doubt| doubt.replace(&*dir.path().to_string_lossy(), "scene"))
                .collect(),
            views: (capture.views.into_iter())
                .map(|view| View {
                    image_path: Path::new("scene").join(&view.photo),
                    ..view
                })
                .collect(),
            ..capture
        })
    };
    let text = load("txt", model.text(), [rigs, frames].map(Vec::from));
    if let Ok(text) = &text {
        let files = binary_files(rigs, frames);
        assert_eq!(&load("bin", model.binary(), files).unwrap(), text);
    }
    text
}

fn camera(capture: &Capture, name: &str) -> Camera {
    let view = capture.views.iter().find(|view| view.name == name);
    view.unwrap().camera.clone()
}

#[test]
fn poses_that_agree_keep_their_digits_without_a_word() {
    let plain = super::fixtures::load(&Model::example()).unwrap();
    for turn in ["0.8 0 0.6 0", "0.800000000001 0 0.6 0"] {
        let found = load(RIGS, &FRAMES.replace("0.8 0 0.6 0", turn)).unwrap();
        assert!(found.doubts.is_empty(), "{:?}", found.doubts);
        for view in &plain.views {
            assert_eq!(camera(&found, &view.name), view.camera);
        }
    }
}

#[test]
fn poses_are_those_of_rigs_and_frames() {
    // A quarter turn about z, and the second camera two units along x of the first one's axes.
    let frames = FRAMES.replacen("0.8 0 0.6 0 1 0.25 2", "1 0 0 1 1 0.25 2", 1);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let frames = frames.replacen("1 0 0 1 ", &format!("{half} 0 0 {half} "), 1);
    let found = load(RIGS, &frames).unwrap();
    let [doubt] = &found.doubts[..] else {
        panic!("{:?}", found.doubts);
    };
    assert!(doubt.starts_with("scene/sparse/0: "), "{doubt}");
    assert!(doubt.contains("2 of 3 photos, such as b.png"), "{doubt}");
    let (first, second) = (camera(&found, "b.png"), camera(&found, "left/a c.png"));
    let turn = DMat3::from_rotation_z(std::f64::consts::FRAC_PI_2);
    let center = |translation: DVec3| -(turn.transpose() * translation);
    for (camera, translation) in [
        (first, DVec3::new(1.0, 0.25, 2.0)),
        (second, DVec3::new(-1.0, 0.25, 2.0)),
    ] {
        assert!(camera.center().abs_diff_eq(center(translation), 1e-12));
    }
    // A third of a turn of the sensor in the rig goes before.
    let rigs = RIGS.replace("CAMERA 3 1 1 0 0 0", "CAMERA 3 1 0.5 0.5 0.5 0.5");
    let found = camera(&load(&rigs, FRAMES).unwrap(), "left/a c.png");
    let frame = DMat3::from_quat(DQuat::from_xyzw(0.0, 0.6, 0.0, 0.8));
    let sensor = DMat3::from_quat(DQuat::from_xyzw(0.5, 0.5, 0.5, 0.5));
    let translation = sensor * DVec3::new(1.0, 0.25, 2.0) - 2.0 * DVec3::X;
    let center = -((sensor * frame).transpose() * translation);
    assert!(found.center().abs_diff_eq(center, 1e-12));
}

#[test]
fn photos_without_a_frames_pose_keep_theirs_and_are_told() {
    let plain = super::fixtures::load(&Model::example()).unwrap();
    let nowhere = FRAMES.replace("1 CAMERA 7 2", "0");
    let nan = FRAMES.replace("0.8 0 0.6 0 0 0.25 2", "NaN NaN NaN NaN NaN NaN NaN");
    for frames in [&nowhere, &nan] {
        let found = load(RIGS, frames).unwrap();
        let [doubt] = &found.doubts[..] else {
            panic!("{:?}", found.doubts);
        };
        assert!(doubt.contains("give 1 of 3 photos, such as a.png, no pose"));
        assert_eq!(camera(&found, "a.png"), camera(&plain, "a.png"));
    }
}

#[test]
fn damaged_files_are_refused() {
    for (rigs, frames, words) in [
        (
            RIGS,
            "1 2 1 0 0 0 0 0 0 0\n",
            "rig 2 is not in the rigs file",
        ),
        (
            RIGS,
            "1 1 1 0 0 0 0 0 0 1 CAMERA 9 0\n",
            "camera 9 is not in rig 1",
        ),
        (
            RIGS,
            &FRAMES.replace("CAMERA 7 2", "CAMERA 7 1"),
            "image 1 is in two frames",
        ),
        (RIGS, "1 1 1 0 0 0 0 0\n", "the line ends before the pose"),
        (RIGS, "1 1 1 0 0 0 0 0 0 0 CAMERA\n", "\"CAMERA\" follows"),
        (RIGS, "1 1 1 0 0 0 0 0 x 0\n", "\"x\" cannot be the pose"),
        (
            "1 2 CAMERA 7\n",
            FRAMES,
            "the line ends before the sensor's kind",
        ),
    ] {
        let message = load(rigs, frames).unwrap_err();
        assert!(message.contains(words), "{words}: {message}");
    }
    let model = Model::example();
    let dir = folder(&model);
    write(dir.path(), "sparse/0", model.binary(), "bin");
    let [rigs, frames] =
        ["rigs.bin", "frames.bin"].map(|name| dir.path().join("sparse/0").join(name));
    let load = || Capture::load(dir.path()).map_err(|error| error.to_string());
    let [of_rigs, of_frames] = binary_files(RIGS, FRAMES);
    fs::write(&rigs, &of_rigs).unwrap();
    assert!(load().unwrap_err().contains("no frames.bin"));
    fs::write(&frames, &of_frames).unwrap();
    assert!(load().is_ok());
    for (path, sound) in [(&rigs, &of_rigs), (&frames, &of_frames)] {
        for length in 0..sound.len() {
            fs::write(path, &sound[..length]).unwrap();
            assert!(load().is_err(), "{length}");
        }
        fs::write(path, [&sound[..], &[0]].concat()).unwrap();
        assert!(load().unwrap_err().contains("1 bytes follow"));
        fs::write(path, sound).unwrap();
    }
    // Text beside a binary model is not read, by COLMAP neither.
    fs::write(rigs.with_extension("txt"), "nonsense").unwrap();
    assert!(load().is_ok());
}

#[test]
fn errors_quote_little_of_a_long_line() {
    let model = Model::example();
    let [cameras, images, points] = model.text();
    let long = "x".repeat(70_000);
    let images = String::from_utf8(images).unwrap();
    for damaged in [
        images.replacen("0.8", &long, 1),
        images.replacen("b.png", &format!("../{long}"), 1),
        images.replacen("b.png", &long, 1),
    ] {
        let files = [cameras.clone(), damaged.into_bytes(), points.clone()];
        let message = super::fixtures::load_files(&model, files, "txt").unwrap_err();
        assert!(message.to_string().len() < 700, "{message}");
    }
}
