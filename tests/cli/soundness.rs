//! Photos and models that contradict each other, made from the bundled scene.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use glam::{DMat3, DQuat, DVec3};
use gs_chroma::capture::{Camera, Capture, Point};
use serde_json::{Value, json};

use super::program::{Done, Place};
use super::shared::FEW;

const DEMO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo");

/// The bundled scene's model, to be changed and written as text.
#[derive(Clone)]
struct Model {
    /// Name and camera of each image.
    images: Vec<(String, Camera)>,
    points: Vec<Point>,
}

impl Model {
    fn demo() -> Self {
        let capture = Capture::load(Path::new(DEMO)).expect("the bundled scene");
        let views = capture.views.into_iter();
        Self {
            images: views.map(|view| (view.photo, view.camera)).collect(),
            points: capture.points,
        }
    }

    fn cameras(&mut self) -> impl Iterator<Item = &mut Camera> {
        self.images.iter_mut().map(|(_, camera)| camera)
    }

    /// Every pixel at which something was seen.
    fn pixels(&mut self) -> impl Iterator<Item = &mut [f64; 2]> {
        let tracks = self.points.iter_mut().flat_map(|point| &mut point.track);
        tracks.map(|seen| &mut seen.pixel)
    }

    /// Writes the model into a folder, each image with a camera of its own.
    fn write(&self, place: &Place, folder: &str) {
        let (mut cameras, mut images, mut points) = (String::new(), String::new(), String::new());
        let mut seen = vec![Vec::new(); self.images.len()];
        for (id, point) in self.points.iter().enumerate() {
            let [x, y, z] = point.position.to_array();
            let [r, g, b] = point.color;
            write!(points, "{id} {x} {y} {z} {r} {g} {b} 0.5").expect("a string");
            for observation in &point.track {
                let of_view: &mut Vec<String> = &mut seen[observation.view];
                write!(points, " {} {}", observation.view, of_view.len()).expect("a string");
                let [x, y] = observation.pixel;
                of_view.push(format!("{x} {y} {id}"));
            }
            points.push('\n');
        }
        for (id, ((name, camera), seen)) in self.images.iter().zip(&seen).enumerate() {
            let Camera {
                width,
                height,
                fx,
                fy,
                cx,
                cy,
                rotation,
                translation,
            } = camera;
            writeln!(cameras, "{id} PINHOLE {width} {height} {fx} {fy} {cx} {cy}")
                .expect("a string");
            let DQuat { x, y, z, w } = DQuat::from_mat3(rotation);
            let [tx, ty, tz] = translation.to_array();
            let seen = seen.join(" ");
            writeln!(
                images,
                "{id} {w} {x} {y} {z} {tx} {ty} {tz} {id} {name}\n{seen}"
            )
            .expect("a string");
        }
        for (name, text) in [
            ("cameras", cameras),
            ("images", images),
            ("points3D", points),
        ] {
            place.write(&format!("{folder}/{name}.txt"), text);
        }
    }
}

/// A place with the bundled photos in `scene/`, and the model after `spoil`.
fn place_with(spoil: impl FnOnce(&mut Model)) -> Place {
    let place = Place::new();
    for photo in fs::read_dir(format!("{DEMO}/images")).expect("photos") {
        let photo = photo.expect("a photo");
        let name = photo.file_name().to_string_lossy().into_owned();
        let bytes = fs::read(photo.path()).expect("a photo");
        place.write(&format!("scene/images/{name}"), bytes);
    }
    let mut model = Model::demo();
    spoil(&mut model);
    model.write(&place, "scene/sparse/0");
    place
}

/// Replaces a photo by what becomes of it.
fn change_photo(
    place: &Place,
    index: usize,
    to: impl Fn(image::DynamicImage) -> image::DynamicImage,
) {
    let path = place.path(&format!("scene/images/garden_{index:02}.jpg"));
    let photo = to(image::open(&path).expect("a photo"));
    photo.save(&path).expect("writable");
}

/// The lines that begin with `warning:`.
fn warnings(done: &Done) -> Vec<&str> {
    let lines = done.stderr.lines();
    lines
        .filter_map(|line| line.strip_prefix("warning: "))
        .collect()
}

const PLAN: [&str; 7] = [
    "plan",
    "scene",
    "--json",
    "--preset",
    "draft",
    "--max-side",
    "160",
];

/// Output of a command that succeeds with one warning, in words and in JSON, that contains these
/// words.
#[track_caller]
fn warns(place: &Place, arguments: &[&str], words: &[&str]) -> Value {
    let done = place.run(arguments);
    assert_eq!(done.code, Some(0), "{arguments:?}: {}", done.stderr);
    let [told] = warnings(&done)[..] else {
        panic!("{arguments:?}: not one warning: {}", done.stderr)
    };
    for word in words {
        assert!(told.contains(word), "{arguments:?}: no {word:?} in: {told}");
    }
    let printed: Value = serde_json::from_str(&done.stdout).expect("JSON");
    assert_eq!(printed["warnings"], json!([told]));
    printed
}

/// Checks that `plan` and `fit` refuse the scene with one line that contains these words, and write
/// nothing.
#[track_caller]
fn is_refused(place: &Place, words: &[&str]) {
    let fit = ["fit", "scene", "--preset", "draft", "-o", "out"];
    for arguments in [&PLAN[..], &fit] {
        let done = place.run(arguments);
        assert_eq!(done.code, Some(1), "{arguments:?}: {}", done.stderr);
        let line = done.stderr.lines().last().unwrap_or_default();
        assert!(line.starts_with("error: "), "{}", done.stderr);
        for word in words.iter().chain(&["scene", "--force"]) {
            assert!(line.contains(word), "no {word:?} in: {line}");
        }
    }
    assert!(place.files("out").is_empty());
}

#[test]
fn a_sound_scene_gives_no_warning() {
    let place = place_with(|_| {});
    let teacher = format!("{DEMO}/images");
    let fit = ["fit", "scene", "--json", "-o", "run", "--max-side", "96"];
    let colorize = [
        "colorize",
        "run",
        "--json",
        "--rounds",
        "1",
        "--teacher",
        &teacher,
    ];
    let eval = ["eval", "run", "--json", "--frames", "31"];
    for arguments in [
        &["info", "scene", "--json"][..],
        &["info", DEMO, "--json"],
        &PLAN,
        &[&fit[..], &FEW].concat(),
        &colorize,
        &eval,
    ] {
        let done = place.run(arguments);
        assert_eq!(done.code, Some(0), "{arguments:?}: {}", done.stderr);
        assert_eq!(warnings(&done), [""; 0], "{arguments:?}");
        let printed: Value = serde_json::from_str(&done.stdout).expect("JSON");
        assert_eq!(printed["warnings"], json!([]), "{arguments:?}");
        if arguments[0] == "info" {
            let error = printed["reprojection_error"].as_f64().expect("a number");
            assert!((0.01..0.3).contains(&error), "{error}");
        }
        if arguments[0] == "plan" {
            let soundness = &printed["soundness"];
            let error = soundness["reprojection_error"].as_f64();
            assert!(error.is_some_and(|error| error < 0.3), "{soundness}");
            let lowest = soundness["lowest_correlation"].as_f64();
            assert!(lowest.is_some_and(|lowest| lowest > 0.6), "{soundness}");
        }
        if arguments[0] == "colorize" {
            assert_eq!(printed["chroma"]["warnings"], json!([]));
        }
    }
}

#[test]
fn models_that_contradict_themselves_are_refused() {
    let inverted = place_with(|model| {
        for camera in model.cameras() {
            camera.rotation = camera.rotation.transpose();
            camera.translation = -(camera.rotation * camera.translation);
        }
    });
    let words = ["median reprojection error is", " px", "camera-to-world"];
    is_refused(&inverted, &words);
    // `info` never refuses.
    warns(&inverted, &["info", "scene", "--json"], &words);
    let forced = [&PLAN[..], &["--force"]].concat();
    let plan = warns(&inverted, &forced, &words);
    assert_eq!(plan["effects"][2]["name"], "exposure");
    assert_eq!(plan["effects"][2]["evidence"], Value::Null);

    let flipped = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    let opengl = place_with(|model| {
        for camera in model.cameras() {
            camera.rotation = flipped * camera.rotation;
            camera.translation = flipped * camera.translation;
        }
    });
    is_refused(&opengl, &["behind the cameras", "OpenGL"]);
    let unscaled = place_with(|model| {
        for camera in model.cameras() {
            let [width, height] = [camera.width, camera.height];
            *camera = camera.resized(4 * width, 4 * height);
            [camera.width, camera.height] = [width, height];
        }
    });
    is_refused(&unscaled, &["intrinsics", "4.00 times"]);
}

#[test]
fn observations_of_another_scale_are_no_evidence() {
    let sound = place_with(|_| {});
    let place = place_with(|model| {
        for pixel in model.pixels() {
            *pixel = pixel.map(|along| 0.25 * along);
        }
    });
    let words = ["observations", "0.25 times", "reprojecting the points"];
    let plan = warns(&place, &PLAN, &words);
    warns(&place, &["info", "scene", "--json"], &words);
    // Where points project to they show what they show in the sound scene, but for a twentieth
    // of a pixel.
    let exposure = |plan: &Value| {
        assert_eq!(plan["effects"][2]["name"], "exposure");
        plan["effects"][2]["evidence"].as_f64().expect("evidence")
    };
    let [found, expected] = [exposure(&plan), exposure(&sound.json(&PLAN))];
    assert!((found - expected).abs() < 0.3, "{found}, not {expected}");
    // That the photos are the right ones is looked at all the same.
    for index in 0..14 {
        change_photo(&place, index, |photo| photo.rotate180());
    }
    is_refused(&place, &["14 of 14 photos", "turned"]);
}

#[test]
fn photos_of_another_model_are_refused() {
    let place = place_with(|_| {});
    for index in 0..14 {
        change_photo(&place, index, |photo| photo.rotate180());
    }
    let words = ["images", "14 of 14 photos", "turned, cropped"];
    is_refused(&place, &words);
    warns(&place, &[&PLAN[..], &["--force"]].concat(), &words);
    // Of the photos `info` reads headers only.
    assert_eq!(
        place.json(&["info", "scene", "--json"])["warnings"],
        json!([])
    );
    // A splat file's photos are looked at before they are colored.
    let fit = ["fit", DEMO, "-o", "run", "--max-side", "96"];
    place.succeed(&[&fit[..], &FEW].concat());
    let teacher = format!("{DEMO}/images");
    let colorize = [
        "colorize",
        "run/luma.ply",
        "--colmap",
        "scene",
        "--teacher",
        &teacher,
    ];
    let done = place.run(&colorize);
    assert_eq!(done.code, Some(1), "{}", done.stderr);
    assert!(done.stderr.contains("14 of 14 photos"), "{}", done.stderr);
    let short = ["--rounds", "1", "--sh-degree", "0"];
    let forced = [&colorize[..], &["--force"], &short].concat();
    let told = place.run(&forced);
    assert_eq!(told.code, Some(0), "{}", told.stderr);
    assert!(warnings(&told)[0].contains("14 of 14 photos"), "{told:?}");
}

#[test]
fn single_photos_are_left_out_and_named() {
    let place = place_with(|_| {});
    change_photo(&place, 5, |photo| photo.rotate180());
    let words = ["left out garden_05.jpg", "does not show what COLMAP saw"];
    let fit = ["fit", "scene", "--json", "-o", "run", "--max-side", "96"];
    let fit = [&fit[..], &FEW].concat();
    let report = warns(&place, &fit, &words);
    let capture = &report["capture"];
    assert_eq!(capture["views"], 13);
    assert_eq!(capture["left_out"][0]["name"], "garden_05.jpg");
    assert_eq!(capture["rejected"].as_array().map(Vec::len), Some(1));
    // Nor do later commands use it, and they say so.
    let teacher = format!("{DEMO}/images");
    let done = place.run(&["colorize", "run", "--rounds", "1", "--teacher", &teacher]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let told = warnings(&done);
    assert!(
        told.len() == 1 && told[0].contains("garden_05.jpg"),
        "{told:?}"
    );
    let report = place.report("run");
    assert_eq!(
        report["chroma"]["colored_views"],
        report["capture"]["train"]
    );
    assert_eq!(report["chroma"]["warnings"], json!([told[0]]));
    // Unless all are wanted.
    let forced = warns(
        &place,
        &[&fit[..], &["--force"]].concat(),
        &["used garden_05.jpg in spite of this"],
    );
    assert_eq!(forced["capture"]["views"], 14);
}

#[test]
fn of_two_photos_none_is_left_out() {
    let place = place_with(|model| {
        model.images.truncate(2);
        for point in &mut model.points {
            point.track.retain(|seen| seen.view < 2);
        }
    });
    for index in 2..14 {
        let photo = format!("scene/images/garden_{index:02}.jpg");
        fs::remove_file(place.path(&photo)).expect("a photo");
    }
    change_photo(&place, 1, |photo| photo.rotate180());
    warns(&place, &PLAN, &["used garden_01.jpg in spite of this"]);
}

#[test]
fn photos_without_a_pose_and_a_better_model_are_told() {
    let place = place_with(|_| {});
    let mut part = Model::demo();
    part.images.truncate(2);
    for point in &mut part.points {
        point.track.retain(|seen| seen.view < 2);
    }
    part.points.retain(|point| point.track.len() == 2);
    Model::demo().write(&place, "scene/sparse/1");
    part.write(&place, "scene/sparse/0");
    let words = [
        "2 of 14 photos in images/ have a pose",
        "sparse/1 places 14",
    ];
    warns(&place, &PLAN, &words);
    warns(&place, &["info", "scene", "--json"], &words);
    fs::remove_dir_all(place.path("scene/sparse/1")).expect("a folder");
    warns(&place, &PLAN, &["2 of 14 photos", "not used"]);
}

#[test]
fn cameras_that_cannot_be_matter_to_their_photos_alone() {
    for camera in [
        "SIMPLE_RADIAL 324 216 1.5 162 108 -8.1",
        "SIMPLE_PINHOLE 324 216 0 162 108",
        "PERSPECTIVE 324 216 150 162 108",
    ] {
        let place = place_with(|_| {});
        let file = "scene/sparse/0/cameras.txt";
        let cameras = String::from_utf8(place.read(file)).expect("text");
        place.write(file, format!("{cameras}99 {camera}\n"));
        let plan = place.json(&PLAN);
        assert_eq!(plan["warnings"], json!([]), "{camera}");
        assert_eq!(plan["effects"][0]["evidence"], 0.0, "{camera}");
        // The same as the camera of the fifth photo.
        let changed = cameras.lines().map(|line| match line.starts_with("4 ") {
            true => format!("4 {camera}\n"),
            false => format!("{line}\n"),
        });
        place.write(file, changed.collect::<String>());
        let words = ["left out garden_04.jpg", "cameras.txt", "camera"];
        warns(&place, &PLAN, &words);
        warns(
            &place,
            &["info", "scene", "--json"],
            &["garden_04.jpg", "cameras.txt"],
        );
    }
}

#[test]
fn photos_much_smaller_than_their_cameras_are_told() {
    let place = place_with(|_| {});
    for index in 0..14 {
        change_photo(&place, index, |photo| {
            photo.resize(108, 72, image::imageops::FilterType::Triangle)
        });
    }
    let words = ["14 photos", "garden_00.jpg", "108×72 of 324×216"];
    warns(&place, &PLAN, &words);
    warns(&place, &["info", "scene", "--json"], &words);
}

#[test]
fn without_observations_photos_that_see_nothing_are_told() {
    let untracked = |model: &mut Model| {
        for point in &mut model.points {
            point.track.clear();
        }
    };
    let sound = place_with(untracked);
    assert_eq!(sound.json(&PLAN)["warnings"], json!([]));
    assert_eq!(
        sound.json(&["info", "scene", "--json"])["reprojection_error"],
        Value::Null
    );
    let place = place_with(|model| {
        untracked(model);
        for camera in model.cameras() {
            camera.cx = -9_000.0;
        }
    });
    let words = [
        "14 of 14 photos",
        "garden_00.jpg",
        "9 more",
        "principal point",
    ];
    warns(&place, &PLAN, &words);
    warns(&place, &["info", "scene", "--json"], &words);
}
