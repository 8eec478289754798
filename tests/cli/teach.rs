//! `colorize`.

use std::fs;
use std::time::{Duration, SystemTime};

use image::imageops::{FilterType, resize};
use image::{Rgb, RgbImage};

use super::program::Place;
use super::scene;
use super::shared::{LUMA, UNTIL, onnx, place_with_run};
use super::splat_file::SplatFile;

fn network() -> String {
    onnx("ddcolor_tiny.onnx")
}

/// Colors `painted/` into the run, a few iterations long.
fn with_painted(place: &Place) -> serde_json::Value {
    let until = (LUMA + 60).to_string();
    place.json(&[
        "colorize",
        "--teacher",
        "painted",
        "--solver",
        "adam",
        "--until",
        &until,
        "--json",
    ])
}

#[test]
fn the_files_of_a_colored_run() {
    let place = place_with_run();
    let files = place.files("runs/scene");
    let own: Vec<_> = files.iter().filter(|name| !name.contains('/')).collect();
    let wanted = [
        "chroma.npy",
        "color.ply",
        "contact-sheet.png",
        "log.csv",
        "luma.ply",
        "report.json",
    ];
    assert_eq!(own, wanted);
    let answers = files.iter().filter(|name| name.starts_with("teacher/"));
    assert_eq!(answers.count(), scene::VIEWS);

    let sheet = image::open(place.path("runs/scene/contact-sheet.png")).expect("a picture");
    let [width, height] = scene::SIZE;
    assert_eq!(sheet.width(), 4 * (width + 4) + 4);
    // Headings and captions are lines of 12 pixels.
    let rows = scene::HELD_OUT as u32;
    assert_eq!(sheet.height(), 12 + rows * (12 + height + 4) + 4);

    let report = place.report("runs/scene");
    let chroma = &report["chroma"];
    assert_eq!(chroma["until"], UNTIL);
    assert_eq!(chroma["iterations"], UNTIL - LUMA);
    assert_eq!(chroma["settings"]["sh_degree"], 1);
    assert_eq!(chroma["colored_views"], scene::VIEWS - scene::HELD_OUT);
    assert_eq!(chroma["teachers"][0]["kind"], "DDColor");
    assert_eq!(chroma["teachers"][0]["name"], "ddcolor_tiny.onnx");
    assert_eq!(chroma["measured_on"], "test");
}

#[test]
fn json_is_the_report_and_words_name_the_files() {
    let place = place_with_run();
    let teacher = network();
    let colorize = [
        "colorize",
        "runs/scene",
        "--solver",
        "adam",
        "--teacher",
        &teacher,
    ];
    let short = [&colorize[..], &["--until", "65"]].concat();
    let printed = place.json(&[&short[..], &["--json"]].concat());
    assert_eq!(printed, place.report("runs/scene"));
    assert_eq!(printed["chroma"]["iterations"], 5);
    let words = place.succeed(&short);
    assert!(words.contains("colored from 8 views"), "{words}");
    assert!(
        words.contains("color.ply") && words.contains("contact-sheet.png"),
        "{words}"
    );

    // Without --until as many iterations as the preset's.
    let printed = place.json(&[&colorize[..], &["--json"]].concat());
    assert_eq!(printed["chroma"]["iterations"], 150);

    // Rows of the coloring before are replaced.
    let log = String::from_utf8(place.read("runs/scene/log.csv")).expect("text");
    let rows: Vec<&str> = log.lines().collect();
    assert_eq!(rows[0], "iteration,loss,splats,seconds,poisoned");
    let iterations: Vec<usize> = rows[1..]
        .iter()
        .map(|row| {
            row.split(',')
                .next()
                .and_then(|n| n.parse().ok())
                .expect("a row")
        })
        .collect();
    assert!(iterations.is_sorted_by(|a, b| a < b), "{iterations:?}");
    assert_eq!(iterations.last(), Some(&(LUMA + 150)));
}

#[test]
fn the_newest_run_is_taken() {
    let place = place_with_run();
    for run in ["newer", "newest"] {
        for file in ["luma.ply", "report.json", "log.csv"] {
            place.write(
                &format!("runs/{run}/{file}"),
                place.read(&format!("runs/scene/{file}")),
            );
        }
    }
    // Neither a file nor a folder without a report is a run.
    place.write("runs/notes.txt", "text");
    place.write("runs/zzz/luma.ply", "text");
    let now = SystemTime::now();
    for (run, age) in [("scene", 300), ("newer", 200), ("newest", 100)] {
        let report = place.path("runs").join(run).join("report.json");
        let file = fs::File::options()
            .append(true)
            .open(report)
            .expect("a report");
        file.set_modified(now - Duration::from_secs(age))
            .expect("a time");
    }
    place.succeed(&[
        "colorize",
        "--teacher",
        &network(),
        "--solver",
        "adam",
        "--until",
        "62",
    ]);
    assert!(place.path("runs/newest/color.ply").exists());
    assert!(!place.path("runs/newer/color.ply").exists());
}

#[test]
fn an_own_output_leaves_the_runs_colors() {
    let place = place_with_run();
    let own = || ["color.ply", "chroma.npy"].map(|name| place.read(&format!("runs/scene/{name}")));
    let before = own();
    let teacher = network();
    place.succeed(&[
        "colorize",
        "--teacher",
        &teacher,
        "--solver",
        "adam",
        "--until",
        "62",
        "-o",
        "new/out.ply",
    ]);
    assert!(own() == before);
    assert!(place.read("new/out.ply") != before[0]);
}

#[test]
fn a_network_is_asked_once_for_each_photo() {
    let place = place_with_run();
    let first = place.report("runs/scene")["chroma"]["pictures"]["teacher_colorfulness"]
        .as_f64()
        .expect("a number");
    assert!(first > 5.0, "{first}");
    // Whoever asks the network anew does not see that the answers became gray.
    let names = place.files("runs/scene/teacher");
    for name in &names {
        let path = format!("runs/scene/teacher/{name}");
        let mut bytes = place.read(&path);
        let values = bytes.len() - 2 * 32 * 32 * 4;
        bytes[values..].fill(0);
        place.write(&path, bytes);
    }
    let colorize = [
        "colorize",
        "--solver",
        "adam",
        "--until",
        "62",
        "--json",
        "--teacher",
    ];
    let report = place.json(&[&colorize[..], &[&network()]].concat());
    let gray = &report["chroma"]["pictures"]["teacher_colorfulness"];
    assert!(gray.as_f64().expect("a number") < 0.5, "{gray}");
    assert_eq!(place.files("runs/scene/teacher"), names);

    // A damaged answer is asked for again.
    for name in &names {
        place.write(&format!("runs/scene/teacher/{name}"), "damaged");
    }
    let report = place.json(&[&colorize[..], &[&network()]].concat());
    let again = &report["chroma"]["pictures"]["teacher_colorfulness"];
    assert_eq!(again.as_f64(), Some(first));
}

#[test]
fn a_folder_teaches_some_views_at_its_own_sizes() {
    let place = place_with_run();
    fs::create_dir_all(place.path("painted/left")).expect("writable");
    let [width, height] = scene::SIZE;
    // Views 1, 2 and 9 are trained on; view 0 would be held out, but single images count.
    for (index, [w, h], extension) in [
        (1, [2 * width, 2 * height], "png"),
        (2, [width / 2, height / 2], "jpg"),
        (9, [width, height], "jpeg"),
        (0, [width, height], "png"),
    ] {
        let name = std::path::Path::new(&scene::name(index)).with_extension(extension);
        let image = resize(&scene::photo(index), w, h, FilterType::Triangle);
        image
            .save(place.path("painted").join(name))
            .expect("writable");
    }
    let report = with_painted(&place);
    let chroma = &report["chroma"];
    assert_eq!(chroma["colored_views"], 4);
    assert_eq!(chroma["painted_held_out"][0], scene::name(0));
    assert_eq!(chroma["teachers"][0]["kind"], "folder");
    assert_eq!(chroma["teachers"][0]["name"], "painted");
    // View 8 is left to measure, and the teacher does not know it.
    assert_eq!(chroma["views"][0]["name"], scene::name(8));
    assert!(chroma["views"][0]["teacher_colorfulness"].is_null());
}

#[test]
fn the_teachers_color_becomes_the_scenes() {
    let place = place_with_run();
    let [width, height] = scene::SIZE;
    let colors = [[200, 90, 60], [60, 110, 200]];
    let mut reds = Vec::new();
    for color in colors {
        for index in 0..scene::VIEWS {
            let image = RgbImage::from_pixel(width, height, Rgb(color));
            let path = place.path("painted").join(scene::name(index));
            fs::create_dir_all(path.parent().expect("a parent")).expect("writable");
            image.save(path).expect("writable");
        }
        with_painted(&place);
        let file = SplatFile::read(&place, "runs/scene/color.ply");
        let [red, blue] = ["f_dc_0", "f_dc_2"].map(|name| file.column(name));
        let redder = red
            .iter()
            .zip(&blue)
            .filter(|(red, blue)| red > blue)
            .count();
        reds.push(redder as f64 / file.count() as f64);
    }
    assert!(reds[0] > 0.8 && reds[1] < 0.2, "{reds:?}");
}

#[test]
fn a_splat_file_is_colored_with_colmaps_cameras() {
    let place = place_with_run();
    fs::rename(place.path("runs/scene/luma.ply"), place.path("gray.ply")).expect("a file");
    let teacher = network();
    let colorize = [
        "colorize",
        "gray.ply",
        "--colmap",
        "scene",
        "--teacher",
        &teacher,
    ];
    let report = place.json(
        &[
            &colorize[..],
            &["--solver", "adam", "--until", "9", "--json"],
        ]
        .concat(),
    );
    assert_eq!(report["chroma"]["iterations"], 9);
    assert_eq!(report["capture"]["views"], scene::VIEWS);
    let (gray, color) = (
        SplatFile::read(&place, "gray.ply"),
        SplatFile::read(&place, "gray-color.ply"),
    );
    assert_eq!(report["luma"]["splats"], gray.count());
    for property in ["x", "scale_0", "opacity", "rot_3"] {
        let pairs = gray
            .column(property)
            .into_iter()
            .zip(color.column(property));
        for (before, after) in pairs {
            assert!(
                (before - after).abs() < 1e-5,
                "{property}: {before} {after}"
            );
        }
    }
    place.succeed(
        &[
            &colorize[..],
            &["--solver", "adam", "--until", "9", "-o", "out.ply"],
        ]
        .concat(),
    );
    assert!(place.read("out.ply") == place.read("gray-color.ply"));
    assert!(!place.path("teacher").exists());
}

#[test]
fn photos_that_have_moved_are_named_with_colmap() {
    let place = place_with_run();
    fs::rename(place.path("scene"), place.path("moved")).expect("a folder");
    let teacher = network();
    let colorize = [
        "colorize",
        "--solver",
        "adam",
        "--until",
        "62",
        "--teacher",
        &teacher,
    ];
    let done = place.run(&colorize);
    assert_eq!(done.code, Some(1));
    assert!(done.stderr.contains("scene"), "{}", done.stderr);
    place.succeed(&[&colorize[..], &["--colmap", "moved"]].concat());
    place.succeed(&["render", "--colmap", "moved", "-o", "pictures"]);
}
