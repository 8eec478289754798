//! Captures loaded from small COLMAP folders.

use std::fs;

use glam::{DMat3, DVec3};

use super::fixtures::{Model, folder, load, load_files, write};
use super::{Capture, CaptureError, Position};

/// The error's one line, which must name the file.
fn message(result: Result<Capture, CaptureError>, file: &str) -> String {
    let text = result.expect_err("this capture is faulty").to_string();
    assert!(text.contains(file), "{text:?} does not name {file}");
    assert!(!text.contains('\n'), "{text:?} has more than a line");
    text
}

#[track_caller]
pub(super) fn assert_says(result: Result<Capture, CaptureError>, file: &str, words: &[&str]) {
    let text = message(result, file);
    for word in words {
        assert!(text.contains(word), "{text:?} does not say {word:?}");
    }
}

#[test]
fn binary_and_text_give_the_same_capture() {
    let model = Model::example();
    let dir = folder(&model);
    write(dir.path(), "sparse/0", model.binary(), "bin");
    let binary = Capture::load(dir.path()).unwrap();
    fs::remove_dir_all(dir.path().join("sparse")).unwrap();
    write(dir.path(), "sparse/0", model.text(), "txt");
    assert_eq!(Capture::load(dir.path()).unwrap(), binary);

    let names: Vec<&str> = binary.views.iter().map(|v| v.name.as_str()).collect();
    assert_eq!(names, ["a.png", "b.png", "left/a c.png"]);
    let [a, _, c] = &binary.views[..] else {
        unreachable!()
    };
    assert_eq!(
        (a.camera.fx, a.camera.fy, a.camera.cx, a.camera.cy),
        (10.0, 11.0, 4.0, 3.0)
    );
    assert_eq!(
        (c.camera.fx, c.camera.fy, c.camera.cx, c.camera.cy),
        (12.0, 12.0, 4.5, 3.5)
    );
    assert_eq!(c.camera.translation, DVec3::new(-1.0, 0.25, 2.0));
    // w x y z = 0.8 0 0.6 0 turns by 2 acos 0.8 about y.
    let turned = DMat3::from_rotation_y(2.0 * 0.8_f64.acos());
    assert!(a.camera.rotation.abs_diff_eq(turned, 1e-12));
    assert_eq!(binary.points.len(), 2);
    assert_eq!(binary.points[0].position, DVec3::new(0.5, -0.125, 6.0));
    assert_eq!(binary.points[1].color, [0, 255, 7]);
    assert_eq!(binary.offset, DVec3::ZERO);
    assert!(binary.rejected.is_empty());
}

#[test]
fn models_are_found_in_all_three_places_and_binary_is_preferred() {
    let model = Model::example();
    for below in ["sparse/0", "sparse", ""] {
        let dir = folder(&model);
        write(dir.path(), below, model.binary(), "bin");
        write(
            dir.path(),
            below,
            [b"x".to_vec(), b"x".to_vec(), b"x".to_vec()],
            "txt",
        );
        fs::write(dir.path().join(below).join("rigs.txt"), b"x").unwrap();
        fs::write(dir.path().join(below).join("frames.txt"), b"x").unwrap();
        assert_eq!(Capture::load(dir.path()).unwrap().views.len(), 3, "{below}");
    }
}

#[test]
fn missing_folders_and_files_are_named() {
    let model = Model::example();
    let dir = folder(&model);
    assert_says(
        Capture::load(&dir.path().join("none")),
        "none",
        &["no such folder"],
    );
    assert_says(
        Capture::load(dir.path()),
        "",
        &["no COLMAP model", "sparse/0"],
    );
    write(dir.path(), "sparse/0", model.binary(), "bin");
    fs::remove_file(dir.path().join("sparse/0/points3D.bin")).unwrap();
    assert_says(Capture::load(dir.path()), "sparse/0", &["no points3D.bin"]);
    write(dir.path(), "sparse/0", model.binary(), "bin");
    fs::remove_file(dir.path().join("images/b.png")).unwrap();
    assert_says(Capture::load(dir.path()), "b.png", &["1 of 3"]);
    fs::remove_file(dir.path().join("images/a.png")).unwrap();
    assert_says(Capture::load(dir.path()), "a.png", &["2 of 3"]);
    fs::remove_dir_all(dir.path().join("images")).unwrap();
    assert_says(Capture::load(dir.path()), "", &["no images/ folder"]);
}

#[test]
fn unknown_camera_models_name_the_remedy() {
    for number in [-1, 18, i32::MAX] {
        let mut model = Model::of_one_camera();
        model.cameras[0].model = ("WARP", number);
        let words = ["camera 7", "image_undistorter"];
        let number = number.to_string();
        assert_says(
            load(&model),
            "cameras.bin",
            &[&words[..], &[&number]].concat(),
        );
        let text = load_files(&model, model.text(), "txt");
        assert_says(text, "cameras.txt", &[&words[..], &["WARP"]].concat());
    }
}

#[test]
fn every_truncation_is_an_error_and_none_panics() {
    let model = Model::example();
    let whole = model.binary();
    let dir = folder(&model);
    for (file, name) in ["cameras", "images", "points3D"].into_iter().enumerate() {
        write(dir.path(), "sparse/0", whole.clone(), "bin");
        let cut = dir.path().join("sparse/0").join(name).with_extension("bin");
        let shortened = fs::OpenOptions::new().write(true).open(&cut).unwrap();
        for end in (0..whole[file].len()).rev() {
            shortened.set_len(end as u64).unwrap();
            let error = Capture::load(dir.path()).unwrap_err();
            let CaptureError::Malformed {
                path,
                position: Position::Byte(offset),
                ..
            } = &error
            else {
                panic!("{error}");
            };
            assert_eq!(*path, cut);
            assert!(*offset <= end as u64, "{error}");
        }
    }
}

#[test]
fn lying_counts_are_refused_without_allocating() {
    let model = Model::example();
    for lie in [4, 1_000_000, u64::MAX] {
        for (file, name) in ["cameras.bin", "images.bin", "points3D.bin"]
            .iter()
            .enumerate()
        {
            let mut files = model.binary();
            files[file][..8].copy_from_slice(&lie.to_le_bytes());
            assert_says(load_files(&model, files, "bin"), name, &["byte"]);
        }
    }
    // The number of observations of the first image, after its name.
    let mut files = model.binary();
    let at = 8 + 4 + 7 * 8 + 4 + "b.png".len() + 1;
    files[1][at..at + 8].copy_from_slice(&(u64::MAX / 24 + 2).to_le_bytes());
    let words = ["image 1 of 3", &format!("byte {at}"), "observations"];
    assert_says(load_files(&model, files, "bin"), "images.bin", &words);
    // A count that is too small would lose views.
    let mut files = model.binary();
    files[1][..8].copy_from_slice(&2_u64.to_le_bytes());
    assert_says(
        load_files(&model, files, "bin"),
        "images.bin",
        &["bytes follow", "image 2 of 2"],
    );
}

#[test]
fn names_must_end_be_text_and_stay_inside() {
    let model = Model::example();
    let at = 8 + 4 + 7 * 8 + 4;
    let mut files = model.binary();
    files[1].truncate(at + 3);
    files[1].extend([b'x'; 200]);
    files[1][..8].copy_from_slice(&1_u64.to_le_bytes());
    let words = ["image 1 of 1", &format!("byte {at}"), "does not end"];
    assert_says(load_files(&model, files, "bin"), "images.bin", &words);
    let mut files = model.binary();
    files[1][at] = 0xff;
    assert_says(load_files(&model, files, "bin"), "images.bin", &["UTF-8"]);
    for name in [
        "../b.png",
        "/etc/b.png",
        "x/../../b.png",
        "C:\\b.png",
        "..\\b.png",
    ] {
        let mut model = Model::example();
        model.images[2].name = name.into();
        assert_says(load(&model), "images.bin", &["image 3 of 3", "leads out"]);
        assert_says(
            load_files(&model, model.text(), "txt"),
            "images.txt",
            &["line 7", "leads out"],
        );
    }
}

#[test]
fn unknown_and_doubled_ids_and_names_are_errors() {
    let mut model = Model::example();
    model.images[1].camera = 99;
    assert_says(load(&model), "images.bin", &["image 2 of 3", "camera 99"]);
    assert_says(
        load_files(&model, model.text(), "txt"),
        "images.txt",
        &["line 5", "camera 99"],
    );
    let mut model = Model::example();
    model.cameras[1].id = 7;
    assert_says(load(&model), "cameras.bin", &["camera 7", "twice"]);
    let mut model = Model::example();
    model.images[2].name = "./b.png".into();
    assert_says(load(&model), "images.bin", &["b.png", "two images"]);
}

#[test]
fn damaged_cameras_are_errors() {
    for (index, value) in [(0, f64::NAN), (0, -1.0), (1, 0.0), (2, f64::INFINITY)] {
        let mut model = Model::of_one_camera();
        model.cameras[0].parameters[index] = value;
        assert_says(load(&model), "cameras.bin", &["camera 1 of 2", "byte"]);
        assert_says(
            load_files(&model, model.text(), "txt"),
            "cameras.txt",
            &["line 2"],
        );
    }
    let mut model = Model::of_one_camera();
    model.cameras[0].width = u64::MAX;
    assert_says(load(&model), "cameras.bin", &["camera 1 of 2", "width"]);
    let mut model = Model::example();
    model.cameras[0].parameters.push(1.0);
    assert_says(
        load_files(&model, model.text(), "txt"),
        "cameras.txt",
        &["4 parameters"],
    );
}

#[test]
fn empty_models_are_errors() {
    let mut model = Model::example();
    model.points.clear();
    assert_says(load(&model), "points3D.bin", &["no usable points"]);
    assert_says(
        load_files(&model, model.text(), "txt"),
        "points3D.txt",
        &["no usable points"],
    );
    let mut model = Model::example();
    model.images.clear();
    assert_says(load(&model), "images.bin", &["no images"]);
    assert_says(
        load_files(&model, model.text(), "txt"),
        "images.txt",
        &["no images"],
    );
}

#[test]
fn views_with_bad_poses_are_rejected_by_name() {
    let bad: [([f64; 4], [f64; 3], &str); 6] = [
        ([f64::NAN, 0.0, 0.0, 0.0], [0.0; 3], "not finite"),
        (
            [1.0, 0.0, 0.0, 0.0],
            [0.0, f64::INFINITY, 0.0],
            "not finite",
        ),
        ([0.0; 4], [0.0; 3], "length 0"),
        ([1.01, 0.0, 0.0, 0.0], [0.0; 3], "length 1.01"),
        ([1e200; 4], [0.0; 3], "length inf"),
        ([1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1e38], "1e12"),
    ];
    for (quaternion, translation, reason) in bad {
        let mut model = Model::example();
        model.images[0].quaternion = quaternion;
        model.images[0].translation = translation;
        for capture in [load(&model), load_files(&model, model.text(), "txt")] {
            let capture = capture.unwrap();
            assert_eq!(capture.views.len(), 2);
            assert_eq!(capture.rejected.len(), 1);
            assert_eq!(capture.rejected[0].name, "b.png");
            assert!(
                capture.rejected[0].reason.contains(reason),
                "{:?}",
                capture.rejected
            );
        }
    }
    let mut model = Model::example();
    for image in &mut model.images {
        image.quaternion = [0.0; 4];
    }
    assert_says(
        load(&model),
        "images.bin",
        &["none of its 3", "a.png", "length 0"],
    );
}

#[test]
fn rounded_quaternions_are_normalized() {
    let mut model = Model::example();
    model.images[0].quaternion = [0.8005, 0.0, 0.6, 0.0];
    let capture = load(&model).unwrap();
    let rotation = capture.views[1].camera.rotation;
    assert!((rotation * rotation.transpose()).abs_diff_eq(DMat3::IDENTITY, 1e-14));
}

#[test]
fn points_without_a_place_are_left_out() {
    for poison in [f64::NAN, f64::INFINITY, -1e38, 1e300] {
        let mut model = Model::example();
        model.points[0].0[1] = poison;
        let capture = load(&model).unwrap();
        assert_eq!(capture.points.len(), 1);
        assert_eq!(capture.rejected[0].name, "points3D.bin");
        assert!(capture.rejected[0].reason.starts_with("1 of 2 points"));
        model.points[1].0[1] = poison;
        assert_says(load(&model), "points3D.bin", &["no usable points"]);
    }
}

#[test]
fn faulty_text_names_its_line() {
    let model = Model::example();
    let replaced = |file: usize, from: &str, to: &str| {
        let mut files = model.text();
        let text = String::from_utf8(files[file].clone()).unwrap();
        assert!(text.contains(from), "{text}");
        files[file] = text.replacen(from, to, 1).into_bytes();
        load_files(&model, files, "txt")
    };
    for (file, from, to, said) in [
        (0, "10 11", "10 eleven", ["line 2", "\"eleven\""]),
        (0, " 3\n", "\n", ["line 2", "the parameters"]),
        (1, "0.25 2 7 b.png", "0.25", ["line 3", "the translation"]),
        (1, " b.png", "", ["line 3", "names no file"]),
        (2, "200", "256", ["line 1", "the color"]),
    ] {
        let name = ["cameras.txt", "images.txt", "points3D.txt"][file];
        assert_says(replaced(file, from, to), name, &said);
    }
    let mut files = model.text();
    files[2][0] = 0xff;
    assert_says(
        load_files(&model, files, "txt"),
        "points3D.txt",
        &["line 1", "UTF-8"],
    );
}

#[test]
fn text_images_without_their_second_lines_are_noticed() {
    let mut model = Model::example();
    model.images[1].name = "c.png".into();
    let mut files = model.text();
    let text = String::from_utf8(files[1].clone()).unwrap();
    let single: Vec<&str> = text.lines().filter(|line| line.contains(".png")).collect();
    files[1] = single.join("\n").into_bytes();
    assert_says(
        load_files(&model, files, "txt"),
        "images.txt",
        &["line 2", "two lines"],
    );
}

#[test]
fn text_may_end_without_the_last_line_and_have_windows_endings() {
    let mut model = Model::example();
    model.images[2].observations.clear();
    let expected = load(&model).unwrap().views.len();
    let files = model.text().map(|file| {
        let text = String::from_utf8(file).unwrap();
        text.trim_end().replace('\n', "\r\n").into_bytes()
    });
    let capture = load_files(&model, files, "txt").unwrap();
    assert_eq!(capture.views.len(), expected);
    assert_eq!(capture.views[0].name, "a.png");
}

#[test]
fn extent_is_the_camera_radius_or_else_the_distance_to_the_points() {
    let mut model = Model::example();
    for image in &mut model.images {
        image.quaternion = [1.0, 0.0, 0.0, 0.0];
    }
    // Centers at x = -1, 1, 0: their mean is in the middle.
    assert!((load(&model).unwrap().extent() - 1.1).abs() < 1e-12);
    for image in &mut model.images {
        image.translation = [0.0; 3];
    }
    model.points = vec![([0.0, 0.0, 5.0], [0; 3], Vec::new()); 3];
    assert!((load(&model).unwrap().extent() - 5.5).abs() < 1e-12);
    model.images.truncate(1);
    assert!((load(&model).unwrap().extent() - 5.5).abs() < 1e-12);
    model.points = vec![([0.0; 3], [0; 3], Vec::new()); 3];
    assert_eq!(load(&model).unwrap().extent(), 1.0);
}

#[test]
fn large_coordinates_are_recentered_by_whole_numbers() {
    let plain = load(&Model::example()).unwrap();
    let utm = DVec3::new(567_890.5, 4_123_456.25, -321.75);
    let mut model = Model::example();
    for (image, view) in model.images.iter_mut().zip([1, 2, 0]) {
        let camera = plain.views[view].camera.recentered(-utm);
        image.translation = camera.translation.to_array();
    }
    for point in &mut model.points {
        point.0 = (DVec3::from(point.0) + utm).to_array();
    }
    let capture = load(&model).unwrap();
    assert_eq!(capture.offset, capture.offset.round());
    assert!(capture.center().length() < 1.0);
    assert!((capture.extent() - plain.extent()).abs() < 1e-6);
    for (moved, original) in capture.points.iter().zip(&plain.points) {
        let back = moved.position + capture.offset - utm;
        assert!(back.distance(original.position) < 1e-8);
    }
    for (moved, original) in capture.views.iter().zip(&plain.views) {
        let back = moved.camera.center() + capture.offset - utm;
        assert!(back.distance(original.camera.center()) < 1e-8);
    }
}
