//! Loading a model's images: views through lenses, and tracks of points.

use super::fixtures::{Model, folder, load, load_files, write};
use super::tests::assert_says;
use super::{Capture, CaptureError, Choice, LoadOptions, Loader, Observation, split};

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
    let options = LoadOptions {
        lens,
        ..LoadOptions::default()
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
    let options = LoadOptions {
        max_side: Some(1),
        ..LoadOptions::default()
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
    let center = capture.views[0].camera.center();
    let loader = Loader::new(LoadOptions::default());
    for view in &capture.views[..5] {
        assert_eq!(view.photo, "a.png");
        assert_eq!(view.photo_size(), [8, 6]);
        assert!(view.camera.center().distance(center) < 1e-12);
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
    let of_all = |model, parameters: &[f64]| {
        let mut example = with_lens(model, parameters);
        (example.images.iter_mut()).for_each(|image| image.camera = 7);
        example
    };
    let folded = of_all(("SIMPLE_RADIAL", 2), &[10.0, 4.0, 3.0, -1e9]);
    let words = ["camera 7", "SIMPLE_RADIAL", "folds"];
    assert_says(load(&folded), "cameras.bin", &words);
    assert!(load_choosing(&folded, Choice::Off).is_ok());
    let strange = of_all(("EUCM", 16), &[10.0, 10.0, 4.0, 3.0, 2.0, 1.0]);
    assert_says(load(&strange), "cameras.bin", &["camera 1 of 2", "alpha"]);
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
