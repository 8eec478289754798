//! Captures loaded from small COLMAP folders.

use std::fs;

use glam::{DMat3, DVec3};

use super::fixtures::{Model, folder, load, load_files, write};
use super::{
    Capture, CaptureError, CaptureOptions, Choice, LoadOptions, Loader, Observation, Position,
    split,
};

/// The error's one line, which must name the file.
fn message(result: Result<Capture, CaptureError>, file: &str) -> String {
    let text = result.expect_err("this capture is faulty").to_string();
    assert!(text.contains(file), "{text:?} does not name {file}");
    assert!(!text.contains('\n'), "{text:?} has more than a line");
    text
}

#[track_caller]
fn assert_says(result: Result<Capture, CaptureError>, file: &str, words: &[&str]) {
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
        fs::write(dir.path().join(below).join("rigs.bin"), b"x").unwrap();
        fs::write(dir.path().join(below).join("frames.bin"), b"x").unwrap();
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
        let mut model = Model::example();
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

/// The example with a lens for its first camera.
fn with_lens(model: (&'static str, i32), parameters: &[f64]) -> Model {
    let mut example = Model::example();
    example.cameras[0].model = model;
    example.cameras[0].parameters = parameters.into();
    example
}

/// Loads with a choice about lenses.
fn load_choosing(model: &Model, lens: Choice) -> Result<Capture, CaptureError> {
    let dir = folder(model);
    write(dir.path(), "sparse/0", model.binary(), "bin");
    let options = CaptureOptions {
        lens,
        max_side: None,
    };
    Capture::load_with(dir.path(), &options)
}

#[test]
fn lenses_are_taken_out_where_they_show_or_as_asked() {
    // 0.2 · 0.5³ at the corner, times 10.
    let model = with_lens(("SIMPLE_RADIAL", 2), &[10.0, 4.0, 3.0, 0.2]);
    let text = load_files(&model, model.text(), "txt").unwrap();
    let binary = load(&model).unwrap();
    assert_eq!(
        (&text.views[0].camera, text.distortion),
        (&binary.views[0].camera, binary.distortion)
    );
    assert!(
        (0.18..0.26).contains(&binary.distortion),
        "{}",
        binary.distortion
    );
    let undistorted = |capture: Capture| -> Vec<bool> {
        let views = capture.views.iter();
        views.map(|view| view.undistortion.is_some()).collect()
    };
    // The third view's camera is a pinhole.
    assert_eq!(undistorted(binary), [false; 3]);
    assert_eq!(
        undistorted(load_choosing(&model, Choice::On).unwrap()),
        [true, true, false]
    );
    let strong = with_lens(("SIMPLE_RADIAL", 2), &[10.0, 4.0, 3.0, 2.0]);
    assert_eq!(undistorted(load(&strong).unwrap()), [true, true, false]);
    assert_eq!(
        undistorted(load_choosing(&strong, Choice::Off).unwrap()),
        [false; 3]
    );
    // What cannot be seen at working size is none.
    let dir = folder(&strong);
    write(dir.path(), "sparse/0", strong.binary(), "bin");
    let options = CaptureOptions {
        lens: Choice::Auto,
        max_side: Some(1),
    };
    let small = Capture::load_with(dir.path(), &options).unwrap();
    assert!(small.distortion < 0.5, "{}", small.distortion);
    assert_eq!(undistorted(small), [false; 3]);
}

#[test]
fn wide_photos_become_faces_of_one_photo() {
    let model = with_lens(("SIMPLE_FISHEYE", 14), &[3.0, 4.0, 3.0]);
    let dir = folder(&model);
    write(dir.path(), "sparse/0", model.binary(), "bin");
    let capture = Capture::load(dir.path()).unwrap();
    let names: Vec<&str> = capture
        .views
        .iter()
        .map(|view| view.name.as_str())
        .collect();
    let expected = [
        "a@down.png",
        "a@front.png",
        "a@left.png",
        "a@right.png",
        "a@up.png",
        "b@down.png",
        "b@front.png",
        "b@left.png",
        "b@right.png",
        "b@up.png",
        "left/a c.png",
    ];
    assert_eq!(names, expected);
    let centre = capture.views[0].camera.center();
    let loader = Loader::new(LoadOptions::default());
    for view in &capture.views[..5] {
        assert_eq!(view.photo, "a.png");
        assert_eq!(view.photo_size(), [8, 6]);
        assert!(view.camera.center().distance(centre) < 1e-12);
        assert!(loader.load(view).is_ok());
    }
    // Three photos: the first is held out.
    assert_eq!(split(&capture.views, true).test, [0, 1, 2, 3, 4]);
    // The pixel (5, 0.5) is right of and above the middle: 2.5 of 3 rad·px up.
    let track = &capture.points[0].track;
    let seen = |i: usize| capture.views[track[i].view].name.as_str();
    assert_eq!(
        (track.len(), seen(0), seen(1)),
        (2, "b@up.png", "a@right.png")
    );
    for seen in track {
        let camera = &capture.views[seen.view].camera;
        let within = |c: f64, side: u32| (0.0..=f64::from(side)).contains(&c);
        assert!(within(seen.pixel[0], camera.width) && within(seen.pixel[1], camera.height));
    }
    let flat = load_choosing(&model, Choice::Off).unwrap();
    assert_eq!(flat.views.len(), 3);
    assert_eq!(
        tracks(&flat)[0],
        [("b.png", [5.0, 0.5]), ("a.png", [6.5, 1.75])]
    );
}

#[test]
fn tracks_move_with_the_lens() {
    let model = with_lens(("SIMPLE_RADIAL", 2), &[10.0, 4.0, 3.0, 2.0]);
    let capture = load(&model).unwrap();
    let seen = capture.points[0].track[0];
    let camera = &capture.views[seen.view].camera;
    // Back through the formula: from the pinhole's pixel to the photo's.
    let u = (seen.pixel[0] - camera.cx) / camera.fx;
    let v = (seen.pixel[1] - camera.cy) / camera.fy;
    let scale = 1.0 + 2.0 * (u * u + v * v);
    assert!((10.0 * u * scale + 4.0 - 5.0).abs() < 1e-9);
    assert!((10.0 * v * scale + 3.0 - 0.5).abs() < 1e-9);
}

#[test]
fn calibrations_of_no_lens_name_the_camera() {
    let folded = with_lens(("SIMPLE_RADIAL", 2), &[10.0, 4.0, 3.0, -1e9]);
    let words = ["camera 7", "SIMPLE_RADIAL", "folds"];
    assert_says(load(&folded), "cameras.bin", &words);
    assert!(load_choosing(&folded, Choice::Off).is_ok());
    let strange = with_lens(("EUCM", 16), &[10.0, 10.0, 4.0, 3.0, 2.0, 1.0]);
    assert_says(load(&strange), "cameras.bin", &["camera 1 of 2", "alpha"]);
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
        let mut model = Model::example();
        model.cameras[0].parameters[index] = value;
        assert_says(load(&model), "cameras.bin", &["camera 1 of 2", "byte"]);
        assert_says(
            load_files(&model, model.text(), "txt"),
            "cameras.txt",
            &["line 2"],
        );
    }
    let mut model = Model::example();
    model.cameras[1].width = u64::MAX;
    assert_says(load(&model), "cameras.bin", &["camera 2 of 2", "width"]);
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
fn rounded_quaternions_are_normalised() {
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
    assert_says(
        replaced(0, "10 11", "10 eleven"),
        "cameras.txt",
        &["line 2", "\"eleven\""],
    );
    assert_says(
        replaced(0, " 3\n", "\n"),
        "cameras.txt",
        &["line 2", "the parameters"],
    );
    assert_says(
        replaced(1, "0.25 2 7 b.png", "0.25"),
        "images.txt",
        &["line 3", "the translation"],
    );
    assert_says(
        replaced(1, " b.png", ""),
        "images.txt",
        &["line 3", "names no file"],
    );
    assert_says(
        replaced(2, "200", "256"),
        "points3D.txt",
        &["line 1", "the colour"],
    );
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
    // Centres at x = -1, 1, 0: their mean is in the middle.
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
fn large_coordinates_are_recentred_by_whole_numbers() {
    let plain = load(&Model::example()).unwrap();
    let utm = DVec3::new(567_890.5, 4_123_456.25, -321.75);
    let mut model = Model::example();
    for (image, view) in model.images.iter_mut().zip([1, 2, 0]) {
        let camera = plain.views[view].camera.recentred(-utm);
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

/// Views by name and pixels of each point's track.
fn tracks(capture: &Capture) -> Vec<Vec<(&str, [f64; 2])>> {
    let named = |seen: &Observation| (capture.views[seen.view].name.as_str(), seen.pixel);
    (capture.points.iter())
        .map(|point| point.track.iter().map(named).collect())
        .collect()
}

#[test]
fn tracks_say_where_views_saw_a_point() {
    let model = Model::example();
    for capture in [load(&model), load_files(&model, model.text(), "txt")] {
        let capture = capture.unwrap();
        let expected: [&[_]; 2] = [
            &[("b.png", [5.0, 0.5]), ("a.png", [6.5, 1.75])],
            &[("b.png", [1.5, 2.5])],
        ];
        assert_eq!(tracks(&capture), expected);
    }
}

#[test]
fn tracks_leave_out_what_no_view_saw() {
    // A view without a pose.
    let mut model = Model::example();
    model.images[0].quaternion = [0.0; 4];
    // An unknown image, no such 2D point, one of no point, one of another point.
    model.points[0].2.extend([(9, 0), (2, 7)]);
    model.points[1].2.extend([(0, 1), (2, 0)]);
    for capture in [load(&model), load_files(&model, model.text(), "txt")] {
        let expected: [&[_]; 2] = [&[("a.png", [6.5, 1.75])], &[]];
        assert_eq!(tracks(&capture.unwrap()), expected);
    }
    // Where an image has no finite pixel for it.
    let mut model = Model::example();
    model.images[0].observations[2].0 = f64::NAN;
    for capture in [load(&model), load_files(&model, model.text(), "txt")] {
        assert_eq!(tracks(&capture.unwrap())[0], [("a.png", [6.5, 1.75])]);
    }
}

#[test]
fn models_without_observations_have_empty_tracks() {
    let mut model = Model::example();
    for image in &mut model.images {
        image.observations.clear();
    }
    let without = load(&model).unwrap();
    assert!(without.points.iter().all(|point| point.track.is_empty()));
    for point in &mut model.points {
        point.2.clear();
    }
    assert_eq!(load(&model).unwrap().points, without.points);
}

#[test]
fn faulty_tracks_name_their_place() {
    let model = Model::example();
    let mut files = model.binary();
    let at = files[2].len() - 8 - 8;
    files[2][at..at + 8].copy_from_slice(&(u64::MAX / 8).to_le_bytes());
    let words = ["point 2 of 2", &format!("byte {at}"), "track elements"];
    assert_says(load_files(&model, files, "bin"), "points3D.bin", &words);
    for (file, from, to, name, words) in [
        (
            1,
            "1.5 2.5 1",
            "1.5 x 1",
            "images.txt",
            ["line 4", "in threes"],
        ),
        (
            1,
            "1.5 2.5 1",
            "1.5 2.5 -2",
            "images.txt",
            ["line 4", "in threes"],
        ),
        (
            2,
            "0.5 0 2 2 0",
            "0.5 0 2 2",
            "points3D.txt",
            ["line 1", "the track"],
        ),
        (
            2,
            "0.5 0 2 2 0",
            "0.5 0 2 2 -1",
            "points3D.txt",
            ["line 1", "the track"],
        ),
    ] {
        let mut files = model.text();
        let text = String::from_utf8(files[file].clone()).unwrap();
        assert!(text.contains(from), "{text}");
        files[file] = text.replacen(from, to, 1).into_bytes();
        assert_says(load_files(&model, files, "txt"), name, &words);
    }
}

/// The bundled scene, in which pycolmap 4.2.1 finds 21578 observations at a mean of
/// 0.11353800868335 pixels from where it projects their points.
#[test]
fn tracks_of_a_real_model_are_where_its_points_project() {
    let dir = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/demo");
    let capture = Capture::load(&dir).unwrap();
    let (mut count, mut sum) = (0, 0.0);
    for point in &capture.points {
        for seen in &point.track {
            let camera = &capture.views[seen.view].camera;
            let [x, y, z] = (camera.rotation * point.position + camera.translation).to_array();
            let (u, v) = (camera.fx * x / z + camera.cx, camera.fy * y / z + camera.cy);
            sum += (u - seen.pixel[0]).hypot(v - seen.pixel[1]);
            count += 1;
        }
    }
    assert_eq!(count, 21578);
    let mean = sum / f64::from(count);
    assert!((mean - 0.113_538_008_683_35).abs() < 1e-9, "{mean}");
}
