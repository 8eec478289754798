//! `prepare`: from photos or a film to what `fit` takes.

#[cfg(unix)]
mod archive;
mod fakes;
mod film;
mod folders;
mod real;
mod reel;
mod restored;
mod still;

use std::fs;
use std::process::Stdio;
use std::thread::sleep;
use std::time::{Duration, Instant};

use serde_json::Value;

use super::program::{Place, files_below};
#[cfg(unix)]
use super::program::{Signal, is_running, send};
use super::scene;
use fakes::{
    all_views, calls, command, commands, piece, place_with, refused, run, succeed, version,
};

const ALL: [&str; 3] = ["feature_extractor", "exhaustive_matcher", "mapper"];
const PHOTOS: [&str; 4] = ["prepare", "photos", "-o", "house"];

/// With more options.
fn with<'a>(options: &[&'a str]) -> Vec<&'a str> {
    [&PHOTOS[..], options].concat()
}

fn json(place: &Place, options: &[&str]) -> Value {
    let done = succeed(place, &with(&[options, &["--json"]].concat()));
    serde_json::from_str(&done.stdout).expect("JSON")
}

#[test]
fn photos_become_what_fit_takes() {
    let place = place_with(&["colmap"]);
    place.write("photos/notes.txt", "notes");
    let done = succeed(&place, &PHOTOS);
    let told = "10 of 10 photos have a pose (COLMAP 3.8, 2 points)\n";
    assert!(done.stdout.starts_with(told), "{done:?}");
    let next = "\nnext: gs-chroma fit house\n";
    assert!(done.stdout.ends_with(next), "{done:?}");
    assert!(
        done.stderr
            .contains("warning: left out 1 of 11 files that are no photos"),
        "{done:?}"
    );
    for view in all_views() {
        let photo = place.read(&format!("photos/{view}"));
        assert!(
            place.read(&format!("house/images/{view}")) == photo,
            "{view}"
        );
    }
    let info = place.json(&["info", "house", "--json"]);
    assert_eq!((&info["views"], &info["points"]), (&10.into(), &2.into()));
    let kept = place.files("house");
    assert!(kept.contains(&"database.db".to_owned()), "{kept:?}");
    assert!(
        !kept.iter().any(|name| name.starts_with(".prepare")),
        "{kept:?}"
    );
}

#[test]
fn options_are_those_of_the_version() {
    for (found, use_gpu) in [
        (
            "3.8",
            ["--SiftExtraction.use_gpu 0", "--SiftMatching.use_gpu 0"],
        ),
        (
            "4.1.0",
            [
                "--FeatureExtraction.use_gpu 0",
                "--FeatureMatching.use_gpu 0",
            ],
        ),
    ] {
        let place = place_with(&["colmap"]);
        version(&place, found);
        let told = succeed(&place, &PHOTOS).stdout;
        assert!(told.contains(&format!("COLMAP {found}")), "{told}");
        let calls = calls(&place);
        for (call, option) in calls.iter().zip(use_gpu) {
            assert!(call.contains(option), "{call}");
            assert!(call.matches("use_gpu").count() == 1, "{call}");
            assert!(call.contains("--random_seed 0"), "{call}");
        }
        assert!(
            calls[0].contains("--ImageReader.single_camera_per_folder 1"),
            "{calls:?}"
        );
    }
    let place = place_with(&["colmap"]);
    succeed(
        &place,
        &with(&[
            "--cameras",
            "one",
            "--lens",
            "OPENCV",
            "--match",
            "sequential",
        ]),
    );
    let calls = calls(&place);
    assert!(
        calls[0].contains("--ImageReader.single_camera 1"),
        "{calls:?}"
    );
    assert!(
        calls[0].contains("--ImageReader.camera_model OPENCV"),
        "{calls:?}"
    );
    assert!(calls[1].contains("sequential_matcher"), "{calls:?}");
}

#[test]
fn what_was_made_is_not_made_again() {
    let place = place_with(&["colmap"]);
    let first = json(&place, &[]);
    assert_eq!(commands(&place), ALL);
    assert_eq!(json(&place, &[]), first);
    assert_eq!(commands(&place), [""; 0]);
    // What depends on what has changed, and no more.
    fs::remove_dir_all(place.path("house/sparse")).expect("a model");
    succeed(&place, &PHOTOS);
    assert_eq!(commands(&place), ["mapper"]);
    succeed(&place, &with(&["--lens", "OPENCV"]));
    assert_eq!(commands(&place), ALL);
    // Matches of another kind begin with features alone.
    let sequential = ["--lens", "OPENCV", "--match", "sequential"];
    succeed(&place, &with(&sequential));
    assert_eq!(
        commands(&place),
        ["feature_extractor", "sequential_matcher", "mapper"]
    );
    assert!(
        place
            .read("house/database.db")
            .ends_with(b"features\nmatches\n")
    );
    // A photo that the user takes away, or a mask that the user paints.
    fs::remove_file(place.path("house/images/00.png")).expect("a photo");
    let [width, height] = scene::SIZE;
    let mask = image::GrayImage::from_fn(width, height, |x, _| {
        image::Luma([if x < 9 { 0 } else { 255 }])
    });
    fs::create_dir_all(place.path("house/masks")).expect("writable");
    piece(&place, 0, &all_views()[1..]);
    succeed(&place, &with(&sequential));
    mask.save(place.path("house/masks/01.png.png"))
        .expect("writable");
    assert_eq!(commands(&place).len(), 3);
    let done = succeed(&place, &with(&sequential));
    assert!(
        done.stdout.contains("9 of 9") && done.stdout.contains("1 with a mask"),
        "{done:?}"
    );
    assert_eq!(commands(&place).len(), 3);
    // All anew.
    fs::remove_dir_all(place.path("house/masks")).expect("masks");
    refused(
        &place,
        &with(&["--force"]),
        &["house/images", "was changed"],
    );
    fs::remove_dir_all(place.path("house/images")).expect("photos");
    piece(&place, 0, &all_views());
    succeed(&place, &with(&["--force"]));
    assert_eq!(commands(&place), ALL);
}

#[test]
fn a_failure_is_told_and_gone_on_from() {
    let place = place_with(&["colmap"]);
    for (step, command) in ALL.into_iter().enumerate() {
        let fail = format!("fake/fail-{command}");
        place.write(&fail, "");
        refused(
            &place,
            &PHOTOS,
            &["colmap failed", &format!("no {command} today")],
        );
        assert_eq!(commands(&place).last().map(String::as_str), Some(command));
        assert!(!place.path("house/sparse").exists());
        fs::remove_file(place.path(&fail)).expect("a file");
        let kept = place.files("house");
        assert!(
            !kept.iter().any(|name| name.contains(".prepare-")),
            "{kept:?}"
        );
        assert_eq!(kept.contains(&"database.db".to_owned()), step > 0);
    }
    succeed(&place, &PHOTOS);
    assert_eq!(commands(&place), ["mapper"]);
}

#[cfg(unix)]
#[test]
fn an_interrupt_ends_the_program_that_runs() {
    let place = place_with(&["colmap"]);
    for (signal, ended, step) in [
        (Signal::SIGINT, 130, "feature_extractor"),
        (Signal::SIGTERM, 143, "exhaustive_matcher"),
    ] {
        let wait = format!("fake/wait-{step}");
        place.write(&wait, "");
        let mut command = command(&place, &PHOTOS);
        let quiet = command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = quiet.spawn().expect("the program starts");
        let begun = Instant::now();
        let waiting = loop {
            let told = fs::read_to_string(place.path("fake/waiting")).unwrap_or_default();
            if told.ends_with('\n') {
                break told.trim().parse().expect("a process");
            }
            assert!(
                begun.elapsed() < Duration::from_secs(60),
                "it does not begin"
            );
            sleep(Duration::from_millis(5));
        };
        send(signal, child.id());
        assert_eq!(child.wait().expect("a child").code(), Some(ended));
        assert!(!is_running(waiting), "{step} goes on");
        let kept = place.files("house");
        assert!(
            !kept.iter().any(|name| name.contains(".prepare-")),
            "{kept:?}"
        );
        for file in [wait.as_str(), "fake/waiting"] {
            fs::remove_file(place.path(file)).expect("a file");
        }
    }
    assert!(place.read("house/database.db").ends_with(b"features\n"));
    commands(&place);
    succeed(&place, &PHOTOS);
    assert_eq!(commands(&place), ALL[1..]);
}

/// Killed, it can remove nothing; the next one does.
#[test]
fn what_a_dead_process_left_is_removed() {
    let place = place_with(&["colmap"]);
    place.write("house/.prepare-x1/database.db", "half");
    place.write("house/.tmpx1", "half");
    succeed(&place, &PHOTOS);
    assert!(!place.path("house/.prepare-x1").exists());
}

#[test]
fn the_piece_of_the_most_photos_is_taken() {
    let place = place_with(&["colmap"]);
    let views = all_views();
    piece(&place, 0, &views[..3]);
    piece(&place, 1, &views[3..9]);
    let done = succeed(&place, &PHOTOS);
    assert!(
        done.stderr.contains("2 pieces") && done.stderr.contains("of 6 photos"),
        "{done:?}"
    );
    let warning = done
        .stderr
        .lines()
        .find(|line| line.starts_with("warning: 4 of 10 photos"));
    let warning = warning.expect("a warning");
    assert!(
        warning.contains("3 are in other pieces, 1 have too few"),
        "{warning}"
    );
    assert!(
        warning.contains("00.png, 01.png, 02.png, left/09.png"),
        "{warning}"
    );
    assert!(done.stdout.starts_with("6 of 10 photos"), "{done:?}");
    let told = json(&place, &[]);
    assert_eq!(told["poses"]["pieces"], serde_json::json!([6, 3]));
    assert_eq!(told["poses"]["unplaced"].as_array().map(Vec::len), Some(4));
    assert_eq!(told["warnings"].as_array().map(Vec::len), Some(1));
    assert_eq!(place.json(&["info", "house", "--json"])["views"], 6);
}

#[test]
fn nothing_that_fits_together() {
    let place = place_with(&["colmap"]);
    fs::remove_dir_all(place.path("fake/models")).expect("a model");
    fs::create_dir_all(place.path("fake/models")).expect("writable");
    let words = ["no photo has a pose", "overlap", "try more of them"];
    refused(&place, &PHOTOS, &words);
    refused(
        &place,
        &with(&["--match", "sequential"]),
        &["exhaustive matching"],
    );
}

#[test]
fn without_colmap_its_module_serves() {
    let place = place_with(&["python3"]);
    let words = [
        "COLMAP is not installed",
        "apt-get install colmap",
        "--install",
    ];
    refused(&place, &PHOTOS, &words);
    assert!(!place.path("house").exists());
    place.write("fake/pycolmap", "4.2.1");
    let done = succeed(&place, &PHOTOS);
    assert!(done.stdout.contains("pycolmap 4.2.1"), "{done:?}");
    assert_eq!(commands(&place), ALL);
    refused(&place_with(&[]), &PHOTOS, &words);
}

/// No file of the current folder is imported (the fake refuses), and every wheel is pinned.
#[test]
fn the_module_is_installed_by_its_digits() {
    let place = place_with(&["python3"]);
    let install = with(&["--install"]);
    place.write(
        "fake/pip-fails",
        "ERROR: No matching distribution found for pycolmap\n",
    );
    refused(
        &place,
        &install,
        &["pinned for Python 3.10", "install COLMAP"],
    );
    place.write("fake/pip-fails", "ERROR: \u{1b}[31mno network\n");
    refused(
        &place,
        &install,
        &["python3 failed", "\\u{1b}[31mno network"],
    );
    fs::remove_file(place.path("fake/pip-fails")).expect("a file");
    calls(&place);
    let done = succeed(&place, &install);
    assert!(done.stdout.contains("pycolmap 4.2.1"), "{done:?}");
    let pip = &calls(&place)[0];
    assert!(
        pip.contains("--require-hashes --only-binary :all: -r "),
        "{pip}"
    );
}

/// As cameras number photos; COLMAP's own matcher sorts plainly.
#[test]
fn photos_one_after_the_other_are_matched_by_number() {
    let place = place_with(&["colmap"]);
    let names: Vec<String> = (1..=scene::VIEWS).map(|k| format!("IMG_{k}.png")).collect();
    for (view, name) in names.iter().enumerate() {
        let from = place.path(&format!("photos/{}", scene::name(view)));
        fs::rename(from, place.path(&format!("photos/{name}"))).expect("writable");
    }
    piece(&place, 0, &names);
    let sequential = with(&["--match", "sequential"]);
    succeed(&place, &sequential);
    assert_eq!(commands(&place)[1], "matches_importer");
    let pairs = String::from_utf8(place.read("fake/pairs")).expect("text");
    let lines: Vec<&str> = pairs.lines().collect();
    assert_eq!(lines[0], "IMG_1.png IMG_2.png");
    assert!(lines.contains(&"IMG_9.png IMG_10.png"), "{lines:?}");
    assert_eq!(lines.len(), 45);
    // Its file of pairs parts names at spaces.
    fs::rename(
        place.path("photos/IMG_3.png"),
        place.path("photos/IMG 3.png"),
    )
    .expect("writable");
    piece(&place, 0, &names[3..]);
    let done = succeed(&place, &sequential);
    assert!(
        done.stderr.contains("warning: photos are matched by name"),
        "{done:?}"
    );
    assert_eq!(commands(&place)[1], "sequential_matcher");
}

#[test]
fn masks_of_all_kinds() {
    let place = place_with(&["colmap"]);
    let [width, height] = scene::SIZE;
    let corner = |x: u32, y: u32| image::Luma([if x < 8 && y < 8 { 0 } else { 255 }]);
    let mask = image::GrayImage::from_fn(width, height, corner);
    mask.save(place.path("corner.png")).expect("writable");
    let told = json(&place, &["--mask", "corner.png"]);
    assert_eq!(told["masked"], 10);
    let made = image::open(place.path("house/masks/left/08.png.png")).expect("a mask");
    assert_eq!(made.to_luma8(), mask);

    // Of single photos; COLMAP is given one for each.
    fs::create_dir_all(place.path("single")).expect("writable");
    mask.save(place.path("single/03.png")).expect("writable");
    mask.save(place.path("single/stranger.png"))
        .expect("writable");
    fs::remove_dir_all(place.path("fake/seen-masks")).expect("masks");
    let told = json(&place, &["--masks", "single"]);
    assert_eq!(told["masked"], 1);
    assert!(
        told["warnings"][0]
            .as_str()
            .expect("a warning")
            .contains("1 masks belong to no photo")
    );
    assert_eq!(place.files("house/masks"), ["03.png.png"]);
    assert_eq!(place.files("fake/seen-masks").len(), 10);
    assert_eq!(place.json(&["info", "house", "--json"])["masked_views"], 1);

    refused(
        &place,
        &with(&["--masks", "nowhere"]),
        &["nowhere", "--masks"],
    );
    fs::remove_file(place.path("single/03.png")).expect("a mask");
    refused(
        &place,
        &with(&["--masks", "single"]),
        &["no mask for any photo", "00.png.png"],
    );
    image::GrayImage::new(9, 9)
        .save(place.path("square.png"))
        .expect("writable");
    refused(
        &place,
        &with(&["--mask", "square.png"]),
        &["square.png", "9×9"],
    );
    image::GrayImage::new(width, height)
        .save(place.path("black.png"))
        .expect("writable");
    refused(
        &place,
        &with(&["--mask", "black.png"]),
        &["leaves no pixel"],
    );
}

#[test]
fn dark_photos_are_stretched_for_colmap() {
    let place = place_with(&["colmap"]);
    for view in 0..scene::VIEWS {
        let path = place.path(&format!("photos/{}", scene::name(view)));
        let deep = scene::photo(view).enumerate_pixels().fold(
            image::ImageBuffer::<image::Luma<u16>, Vec<u16>>::new(scene::SIZE[0], scene::SIZE[1]),
            |mut deep, (x, y, pixel)| {
                deep.put_pixel(x, y, image::Luma([8 * u16::from(pixel[0])]));
                deep
            },
        );
        deep.save(path).expect("writable");
    }
    succeed(&place, &PHOTOS);
    let calls = calls(&place);
    assert!(calls[0].contains("house/stretched"), "{calls:?}");
    let seen = image::open(place.path("house/stretched/00.png")).expect("a photo");
    let seen = seen.as_luma8().expect("gray of 8 bits");
    assert!(seen.iter().max() > Some(&240), "dark");
    assert!(place.read("house/images/00.png") == place.read("photos/00.png"));
}

#[test]
fn wrong_usage_is_told() {
    let place = place_with(&["colmap"]);
    for (options, word) in [
        (&["--end", "5"][..], "--start"),
        (&["--start", "9", "--end", "5"], "--end"),
        (&["--start", "1:99"], "must be a time"),
        (&["--lens", "GLASS"], "GLASS"),
        (&["--match", "some"], "sequential"),
    ] {
        let done = run(&place, &with(options));
        assert_eq!(done.code, Some(2), "{done:?}");
        assert!(done.stderr.contains(word), "{done:?}");
    }
    refused(
        &place,
        &with(&["--pose-fps", "3"]),
        &["frames a second", "folder of photos"],
    );
}
