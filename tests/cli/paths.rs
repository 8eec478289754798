//! `render --path`.

use std::fs;

use serde_json::json;

use super::program::{Done, Place};
use super::scene;
use super::shared::{QUICK_FIT, place_with_run, place_with_scene};

/// The arguments of a short path.
fn short<'a>(way: &'a str, rest: &[&'a str]) -> Vec<&'a str> {
    let path = ["render", "--path", way, "--fps", "8", "--seconds", "0.5"];
    [&path[..], rest].concat()
}

#[test]
fn a_path_s_pictures_are_numbered_and_the_same_when_the_path_is_read_again() {
    let place = place_with_run();
    for way in ["orbit", "photos"] {
        let saved = format!("{way}.json");
        let printed = place.succeed(&short(way, &["-o", way, "--save-path", &saved]));
        assert!(
            printed.contains("drew 4 frames of 64 x 48 pixels: 0.5 s at 8 a second"),
            "{printed}"
        );
        assert!(printed.contains(&format!("wrote {saved}")), "{printed}");
        let names: Vec<String> = (0..4).map(|k| format!("frame-{k:04}.png")).collect();
        assert_eq!(place.files(way), names);
        let path: serde_json::Value = serde_json::from_slice(&place.read(&saved)).expect("JSON");
        assert_eq!(path["fps"], 8.0);
        let again = format!("{way}-again");
        place.succeed(&["render", "--path", &saved, "-o", &again]);
        let mut apart = 0;
        for name in &names {
            let [a, b] = [way, &again].map(|folder| {
                let path = place.path(&format!("{folder}/{name}"));
                image::open(path).expect("a picture").into_rgb8()
            });
            // Numbers go through decimals: a pixel may round otherwise.
            let most = a.iter().zip(b.iter()).map(|(a, b)| a.abs_diff(*b)).max();
            assert!(most <= Some(1), "{name}: {most:?}");
            apart += usize::from(
                place.read(&format!("{way}/{name}")) != place.read(&format!("{way}/{}", names[0])),
            );
        }
        assert!(apart > 0, "the path stands still");
    }
}

#[test]
fn a_path_that_never_ends_is_refused() {
    let place = place_with_run();
    for more in [["--seconds", "1e12"], ["--fps", "4000000000"]] {
        let render = ["render", "--path", "orbit", "-o", "pictures"];
        let done = place.run(&[&render[..], &more].concat());
        let told = done.stderr.lines().last().unwrap_or_default();
        assert_eq!(done.code, Some(1), "{more:?}: {}", done.stderr);
        assert!(told.contains("100000 at most"), "{told}");
        assert!(!place.path("pictures").exists());
    }
}

#[test]
fn a_path_in_a_moved_scene_is_in_colmaps_coordinates() {
    let offset = [5000.0, -3000.0, 100.0];
    let place = Place::new();
    scene::write_moved(&place.path("scene"), offset);
    place.succeed(&QUICK_FIT);
    place.succeed(&short("photos", &["--save-path", "path.json"]));
    let path: serde_json::Value = serde_json::from_slice(&place.read("path.json")).expect("JSON");
    let matrix = &path["camera_path"][0]["camera_to_world"];
    for (row, offset) in offset.iter().enumerate() {
        let at = matrix[4 * row + 3].as_f64().expect("a number");
        assert!((at - offset).abs() < 50.0, "{at} {offset}");
    }
}

#[test]
fn gray_and_color_side_by_side() {
    let place = place_with_run();
    place.succeed(&short(
        "orbit",
        &["-o", "both", "--side-by-side", "--size", "40x30"],
    ));
    let both = image::open(place.path("both/frame-0001.png"))
        .expect("a picture")
        .into_rgb8();
    assert_eq!(both.dimensions(), (80, 30));
    let is_gray = |left: u32| {
        let mut pixels = (left..left + 40).flat_map(|x| (0..30).map(move |y| (x, y)));
        pixels.all(|(x, y)| both.get_pixel(x, y).0 == [both.get_pixel(x, y).0[0]; 3])
    };
    assert!(is_gray(0) && !is_gray(40));
    fs::remove_file(place.path("runs/scene/color.ply")).expect("a file");
    let done = place.run(&short("orbit", &["-o", "both", "--side-by-side"]));
    assert_eq!(done.code, Some(1));
    assert!(
        done.stderr.contains("gs-chroma colorize"),
        "{}",
        done.stderr
    );
}

#[test]
fn a_splat_file_needs_no_cameras_to_be_gone_around() {
    let place = place_with_run();
    let file = "runs/scene/color.ply";
    let mut orbit = short("orbit", &["-o", "orbit"]);
    orbit.insert(1, file);
    let printed = place.succeed(&orbit);
    assert!(printed.contains("1280 x 720"), "{printed}");
    let picture = image::open(place.path("orbit/frame-0002.png"))
        .expect("a picture")
        .into_rgb8();
    assert!(
        picture
            .pixels()
            .any(|pixel| pixel.0 != picture.get_pixel(0, 0).0)
    );
    let mut photos = short("photos", &["-o", "photos"]);
    photos.insert(1, file);
    let done = place.run(&photos);
    assert_eq!(done.code, Some(1));
    assert!(done.stderr.contains("--colmap"), "{}", done.stderr);
    // A viewer's animation is in the file's own coordinates.
    let animation = json!({
        "poseSets": [{"poses": [
            {"frame": 0, "position": [0, 0, -6], "target": [0, 0, 0], "fov": 40},
            {"frame": 2, "position": [1, 0, -6], "target": [0, 0, 0], "fov": 40},
        ]}],
        "timeline": {"frames": 3, "frameRate": 30, "loop": false},
    });
    place.write("document.json", animation.to_string());
    let printed = place.succeed(&[
        "render",
        file,
        "--path",
        "document.json",
        "-o",
        "viewer",
        "--size",
        "64x48",
    ]);
    assert!(
        printed.contains("drew 3 frames of 64 x 48 pixels: 0.1 s at 30 a second"),
        "{printed}"
    );
}

/// A stand-in for ffmpeg that writes what it is given.
#[cfg(unix)]
fn with_encoder(place: &Place, script: &str, arguments: &[&str]) -> Done {
    use std::os::unix::fs::PermissionsExt as _;
    place.write(
        "bin/ffmpeg",
        format!("#!/bin/sh\n[ \"$1\" = -version ] && exit 0\n{script}\n"),
    );
    let encoder = place.path("bin/ffmpeg");
    fs::set_permissions(encoder, fs::Permissions::from_mode(0o755)).expect("executable");
    let path = format!("{}:/usr/bin:/bin", place.path("bin").display());
    Done::of(place.command(arguments).env("PATH", path).output())
}

#[cfg(unix)]
#[test]
fn a_film_has_all_frames_at_its_rate() {
    let place = place_with_run();
    let script = "echo \"$@\" > told.txt; for last; do :; done; cat > \"$last\"";
    let film = short("orbit", &["--video", "films/orbit.mp4", "-o", "orbit"]);
    let done = with_encoder(&place, script, &film);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let mut frames = Vec::new();
    for name in place.files("orbit") {
        let path = place.path(&format!("orbit/{name}"));
        frames.extend_from_slice(image::open(path).expect("a picture").into_rgb8().as_raw());
    }
    assert!(place.read("films/orbit.mp4") == frames);
    let told = String::from_utf8(place.read("told.txt")).expect("text");
    assert!(
        told.contains("-framerate 8/1") && told.contains("64x48"),
        "{told}"
    );
    // What fails leaves the film that was there.
    let done = with_encoder(&place, "echo 'no such codec' >&2; exit 3", &film);
    assert_eq!(done.code, Some(1));
    assert!(
        done.stderr.contains("ffmpeg failed: no such codec"),
        "{}",
        done.stderr
    );
    assert_eq!(place.files("films"), ["orbit.mp4"]);
    assert!(place.read("films/orbit.mp4") == frames);
    let mut command = place.command(&film);
    let done = Done::of(command.env("PATH", "").output());
    assert_eq!(done.code, Some(1));
    for part in [
        "ffmpeg is not installed",
        "apt-get install ffmpeg",
        "-o FOLDER",
    ] {
        assert!(done.stderr.contains(part), "{part}: {}", done.stderr);
    }
}

#[test]
fn what_a_path_cannot_be() {
    let place = place_with_scene();
    place.succeed(&QUICK_FIT);
    for wrong in [
        &["--path", "around", "-o", "out"][..],
        &["--path", "orbit"],
        &["--path", "orbit", "--views", "all", "-o", "out"],
        &["--path", "orbit", "--video", "film.avi"],
        &["--path", "orbit", "-o", "out", "--size", "64"],
        &["--path", "orbit", "-o", "out", "--size", "0x48"],
        &["--path", "orbit", "-o", "out", "--fps", "0"],
        &["--path", "path.json", "-o", "out", "--seconds", "3"],
        &["--seconds", "3", "-o", "out"],
        &["--path", "orbit", "-o", "out", "--luma", "--side-by-side"],
    ] {
        let done = place.run(&[&["render"], wrong].concat());
        assert_eq!(done.code, Some(2), "{wrong:?}: {}", done.stderr);
    }
    for (text, words) in [
        ("{}", "no camera path"),
        ("{\"camera_path\": []}", "render_width"),
        (
            "{\"camera_path\": [], \"render_width\": 4, \"render_height\": 4}",
            "0 frames",
        ),
        ("[1, 2]", "cameras"),
        ("nothing", "no JSON"),
    ] {
        place.write("path.json", text);
        let done = place.run(&["render", "--path", "path.json", "-o", "out"]);
        assert_eq!(
            (done.code, done.stderr.lines().count()),
            (Some(1), 1),
            "{}",
            done.stderr
        );
        let named = done.stderr.contains("path.json");
        assert!(
            named && (done.stderr.contains(words) || text.starts_with('[')),
            "{}",
            done.stderr
        );
    }
}
