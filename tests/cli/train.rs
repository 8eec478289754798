//! `fit`.

use std::fs;

use serde_json::json;

use super::program::Place;
use super::scene;
use super::shared::{QUICK_FIT, place_with_run, place_with_scene};
use super::splat_file::SplatFile;

#[test]
fn the_run_is_named_after_the_folder() {
    let place = place_with_scene();
    place.succeed(&QUICK_FIT);
    assert_eq!(
        place.files("runs"),
        [
            "scene/contact-sheet.png",
            "scene/log.csv",
            "scene/luma.ply",
            "scene/report.json"
        ]
    );
    let mut again = QUICK_FIT;
    again[1] = "scene/";
    place.succeed(&again);
    again[1] = "scene/../scene/.";
    place.succeed(&again);
    assert_eq!(fs::read_dir(place.path("runs")).expect("runs").count(), 1);

    place.succeed(&[&QUICK_FIT[..], &["-o", "deep/er/run"]].concat());
    assert_eq!(
        place.files("deep"),
        [
            "er/run/contact-sheet.png",
            "er/run/log.csv",
            "er/run/luma.ply",
            "er/run/report.json"
        ]
    );
}

#[test]
fn json_is_the_report() {
    let place = place_with_scene();
    let printed = place.json(&[&QUICK_FIT[..], &["--json", "--seed", "5"]].concat());
    assert_eq!(printed, place.report("runs/scene"));
    assert_eq!(printed["luma"]["settings"]["seed"], 5);
    assert_eq!(printed["preset"], "draft");
    assert_eq!(printed["luma"]["iterations"], 3);
    let capture = &printed["capture"];
    assert_eq!(capture["views"], scene::VIEWS);
    assert_eq!(capture["train"], scene::VIEWS - scene::HELD_OUT);
    assert_eq!(capture["test"], scene::HELD_OUT);
    assert_eq!(capture["points"], scene::POINTS);
    assert_eq!(capture["holdout"], true);
    let names: Vec<_> = (0..scene::HELD_OUT)
        .map(|k| &printed["luma"]["held_out_views"][k]["name"])
        .collect();
    assert_eq!(names, [&json!(scene::name(0)), &json!(scene::name(8))]);
    assert!(printed.get("chroma").is_none());
}

#[test]
fn a_memory_limit_lowers_the_cap() {
    let place = place_with_scene();
    let done = place.run(&[&QUICK_FIT[..], &["--memory-limit", "1"]].concat());
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(
        done.stderr.contains("Gaussians fit into 1 MiB"),
        "{}",
        done.stderr
    );
    let luma = &place.report("runs/scene")["luma"];
    assert!(
        luma["estimated_device_memory"]
            .as_u64()
            .is_some_and(|bytes| bytes <= 1 << 20),
        "{luma}"
    );
    let cap = &luma["settings"]["max_splats"];
    assert!(cap.as_u64().is_some_and(|cap| cap < 12_000), "{luma}");
}

/// The training's numerics are in the report and change its result.
#[test]
fn numerics_are_told_and_change_the_training() {
    let place = place_with_scene();
    let printed = place.json(&[&QUICK_FIT[..], &["--json"]].concat());
    let usual = &printed["luma"]["settings"]["numerics"];
    assert_eq!(
        *usual,
        json!({
            "alpha_min": 1.0 / 255.0,
            "transmittance_min": 1e-4,
            "depth_bits": 32,
            "storage": "full",
            "adam": "exact",
            "ssim_window": 11,
        })
    );
    let luma = |run: &str| fs::read(place.path(run)).expect("luma.ply");
    let plain = luma("runs/scene/luma.ply");
    let named =
        "alpha-min=0.02,transmittance-min=0.01,depth-bits=16,storage=half,ssim-window=7,adam=lazy";
    let words = ["--numerics", named, "--json", "-o", "runs/fast"];
    let report = place.json(&[&QUICK_FIT[..], &words].concat());
    let numerics = &report["luma"]["settings"]["numerics"];
    assert_eq!(numerics["alpha_min"], 0.02);
    assert_eq!(numerics["storage"], "half");
    assert_eq!(numerics["ssim_window"], 7);
    assert!(luma("runs/fast/luma.ply") != plain);
    // All that is named is the default: the same bytes.
    let named = "depth-bits=32,storage=full,ssim-window=11,adam=exact";
    let words = ["--numerics", named, "-o", "runs/named"];
    place.succeed(&[&QUICK_FIT[..], &words].concat());
    assert!(luma("runs/named/luma.ply") == plain);
}

#[test]
fn timings_name_every_kernel() {
    let place = place_with_scene();
    let words = place.succeed(&[&QUICK_FIT[..], &["--timings"]].concat());
    assert!(words.contains("| blend_backward "), "{words}");
    let report = place.report("runs/scene");
    let rows = report["luma"]["timings"].as_array().expect("rows");
    let total = |key: &str| -> f64 { rows.iter().filter_map(|row| row[key].as_f64()).sum() };
    assert!((total("share") - 1.0).abs() < 1e-9 && total("seconds") > 0.0);
    // A scan is one kernel on a processor and three on a GPU.
    for kernel in ["project", "luma_loss", "scan_"] {
        let row = (rows.iter())
            .find(|row| (row["kernel"].as_str()).is_some_and(|name| name.starts_with(kernel)));
        let row = row.unwrap_or_else(|| panic!("{kernel} is missing"));
        // Once an iteration, and again where the lists overflowed.
        assert!(row["dispatches"].as_u64() >= Some(3), "{kernel}");
        assert!(row["minimum_bytes"].as_f64() > Some(0.0), "{kernel}");
    }

    let teacher = super::shared::onnx("ddcolor_tiny.onnx");
    let colorize = [
        "colorize",
        "--teacher",
        &teacher,
        "--solver",
        "adam",
        "--until",
        "5",
        "--timings",
    ];
    let words = place.succeed(&colorize);
    assert!(words.contains("| chroma_loss "), "{words}");
    let report = place.report("runs/scene");
    assert!(report["chroma"]["timings"][0]["seconds"].as_f64() > Some(0.0));
}

#[test]
fn words_without_json() {
    let place = place_with_scene();
    let printed = place.succeed(&QUICK_FIT);
    // What came of it, seconds, two files, how to look at it, and what to type next in two lines.
    assert_eq!(printed.lines().count(), 7, "{printed}");
    assert!(
        printed.contains(" Gaussians after 3 iterations"),
        "{printed}"
    );
    assert!(
        printed.contains("PSNR") && printed.contains("luma.ply"),
        "{printed}"
    );
}

#[test]
fn training_makes_better_pictures() {
    let place = place_with_run();
    place.succeed(&[&QUICK_FIT[..], &["-o", "runs/short"]].concat());
    let psnr = |run: &str| {
        let value = &place.report(run)["luma"]["held_out"]["psnr"];
        value.as_f64().expect("a number")
    };
    let (long, short) = (psnr("runs/scene"), psnr("runs/short"));
    assert!(long > short + 0.5, "{long} {short}");
}

#[test]
fn no_holdout_trains_on_all_views() {
    let place = place_with_scene();
    let report = place.json(&[&QUICK_FIT[..], &["--no-holdout", "--json"]].concat());
    assert_eq!(report["capture"]["train"], scene::VIEWS);
    assert_eq!(report["capture"]["test"], 0);
    assert_eq!(report["capture"]["holdout"], false);
    assert!(report["luma"]["held_out"].is_null());
    assert_eq!(report["luma"]["held_out_views"], json!([]));
}

#[test]
fn max_splats_is_a_cap() {
    let place = place_with_scene();
    // Below the number of COLMAP's points, and where densification would exceed it.
    for (cap, iterations) in [(1, "3"), (40, "160"), (80, "160")] {
        let max = cap.to_string();
        let options = ["--iterations", iterations, "--max-splats", &max];
        place.succeed(&[&["fit", "scene", "--preset", "draft"][..], &options].concat());
        let count = SplatFile::read(&place, "runs/scene/luma.ply").count();
        assert!(count <= cap, "{count} of {cap}");
        assert!(count > cap / 2, "{count} of {cap}");
        let report = place.report("runs/scene");
        assert_eq!(report["luma"]["settings"]["max_splats"], cap);
        assert_eq!(report["luma"]["splats"], count);
    }
    assert!(place.report("runs/scene")["luma"]["splats"].as_u64() > Some(64));
}

#[test]
fn init_starts_from_a_file() {
    let place = place_with_run();
    // Fewer Gaussians than COLMAP has points: what comes out tells where it began.
    place.succeed(&[&QUICK_FIT[..], &["--max-splats", "40", "-o", "runs/few"]].concat());
    let init = ["--init", "runs/few/luma.ply", "-o", "runs/init"];
    place.succeed(&[&QUICK_FIT[..], &init].concat());
    assert_eq!(place.report("runs/init")["luma"]["splats"], 40);

    let psnr = |run: &str| {
        let value = &place.report(run)["luma"]["held_out"]["psnr"];
        value.as_f64().expect("a number")
    };
    for (file, degree) in [("luma.ply", "2"), ("luma.ply", "0"), ("color.ply", "3")] {
        let init = format!("runs/scene/{file}");
        let options = ["--init", &init, "--sh-degree", degree, "-o", "runs/init"];
        place.succeed(&[&QUICK_FIT[..], &options].concat());
        let (before, after) = (psnr("runs/scene"), psnr("runs/init"));
        assert!(
            (before - after).abs() < 1.0,
            "{file} {degree}: {before} {after}"
        );
    }
}

/// The paper's schedule scaled down to a few iterations: 15,000 of luma, chroma until 30,000.
#[test]
fn as_the_paper_does_it() {
    let place = place_with_scene();
    let fit = ["fit", "scene", "--as-paper", "--no-fill-gaps", "--json"];
    let fit = [&fit[..], &["--iterations", "60", "-o", "runs/scene"]].concat();
    let report = place.json(&fit);
    assert_eq!(report["preset"], "paper");
    let luma = &report["luma"];
    assert_eq!(luma["iterations"], 60);
    let settings = &luma["settings"];
    assert_eq!(settings["rules"], "3dgs");
    assert_eq!(settings["iterations"], 60);
    assert_eq!(settings["sh_degree"], 3);
    assert_eq!(settings["stop_when_flat"], json!(null));
    assert_eq!(settings["pull_threshold"], 2e-4);
    assert_eq!(settings["prune_opacity"], 0.005);
    let rates = &settings["rates"];
    assert_eq!(rates["opacity_logits"], 0.05);
    assert_eq!(rates["sh_constant"], 0.0025);
    let [first, last] = [0, 1].map(|k| rates["means"][k].as_f64().expect("a rate"));
    assert!(
        (first - 1.6e-4).abs() < 1e-12 && (last - 1.6e-5).abs() < 1e-12,
        "{last}"
    );

    let teacher = super::shared::onnx("ddcolor_tiny.onnx");
    let colorize = ["colorize", "runs/scene", "--as-paper", "--json"];
    let until = ["--until", "120", "--teacher", &teacher];
    let chroma = &place.json(&[&colorize[..], &until].concat())["chroma"];
    assert_eq!(chroma["settings"]["solver"], "adam");
    assert_eq!(chroma["settings"]["scales"], 2);
    assert_eq!(chroma["settings"]["iterations"], 60);
    assert_eq!(chroma["until"], 120);

    for more in [
        &["fit", "scene", "--preset", "draft"][..],
        &["fit", "scene", "--densify", "own"],
        &["fit", "runs/scene"],
        &["colorize", "--teacher", &teacher, "--solver", "adam"],
    ] {
        let done = place.run(&[more, &["--as-paper"]].concat());
        assert_eq!(done.code, Some(2), "{more:?}: {}", done.stderr);
    }
}

#[test]
fn presets_and_what_overrules_them() {
    let place = place_with_scene();
    let presets = [
        ("draft", 12_000, 0, json!(400)),
        ("balanced", 2_000_000, 2, json!(1600)),
        ("paper", 3_000_000, 3, json!(null)),
    ];
    for (preset, max_splats, degree, max_side) in presets {
        let fit = [
            "fit",
            "scene",
            "--iterations",
            "2",
            "--json",
            "--preset",
            preset,
        ];
        let report = place.json(&fit);
        assert_eq!(report["preset"], preset);
        let cap = report["luma"]["settings"]["max_splats"].as_u64();
        // Or as many as the device has room for.
        assert!(cap.is_some_and(|cap| cap == max_splats || preset != "draft" && cap < max_splats));
        assert_eq!(report["luma"]["settings"]["sh_degree"], degree);
        assert_eq!(report["capture"]["max_side"], max_side);
    }
    let own = ["--max-side", "32", "--max-splats", "99", "--sh-degree", "0"];
    let report = place.json(&[&QUICK_FIT[..], &own, &["--json"]].concat());
    assert_eq!(report["luma"]["settings"]["max_splats"], 99);
    assert_eq!(report["luma"]["settings"]["sh_degree"], 0);
    assert_eq!(report["capture"]["max_side"], 32);
}

#[test]
fn the_default_preset_depends_on_the_device() {
    let place = place_with_scene();
    let done = place.run(&["fit", "scene", "--iterations", "2"]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let report = place.report("runs/scene");
    let software = report["device"]["software"] == true;
    assert_eq!(report["preset"], if software { "draft" } else { "paper" });
    assert_eq!(
        done.stderr.contains("preset draft"),
        software,
        "{}",
        done.stderr
    );
}

#[test]
fn fitting_again_forgets_the_old_colors() {
    let place = place_with_run();
    place.succeed(&["eval", "--frames", "2"]);
    let mut fit = QUICK_FIT;
    fit[5] = "2";
    place.succeed(&fit);
    let mut files = place.files("runs/scene");
    files.retain(|name| !name.starts_with("teacher/"));
    assert_eq!(
        files,
        ["contact-sheet.png", "log.csv", "luma.ply", "report.json"]
    );
    assert!(place.report("runs/scene").get("chroma").is_none());
    let log = String::from_utf8(place.read("runs/scene/log.csv")).expect("text");
    let rows: Vec<_> = log.lines().map(|row| row.split(',').next()).collect();
    // After the first, surroundings are added.
    assert_eq!(rows, [Some("iteration"), Some("1"), Some("2")], "{log}");
}

#[test]
fn one_photo_one_point_or_nothing_but_black_will_do() {
    let place = Place::new();
    scene::write_moved(&place.path("scene"), [0.0; 3]);
    let first = |name: &str, lines: usize| {
        let text = String::from_utf8(place.read(name)).expect("text");
        let kept: String = text.split_inclusive('\n').take(lines).collect();
        place.write(name, kept);
    };
    let teacher = super::shared::onnx("ddcolor_tiny.onnx");
    let check = || {
        place.succeed(&QUICK_FIT);
        place.succeed(&[
            "colorize",
            "--solver",
            "adam",
            "--until",
            "5",
            "--teacher",
            &teacher,
        ]);
    };
    first("scene/sparse/points3D.txt", 1);
    check();
    first("scene/sparse/images.txt", 2);
    check();
    // A picture without any difference has an infinite PSNR, which JSON lacks.
    let [width, height] = scene::SIZE;
    let black = image::GrayImage::new(width, height);
    for index in 0..scene::VIEWS {
        let path = place.path("scene/images").join(scene::name(index));
        black.save(path).expect("writable");
    }
    scene::write_moved_model(&place.path("scene"), [0.0; 3]);
    let points = String::from_utf8(place.read("scene/sparse/points3D.txt")).expect("text");
    let dark: String = points
        .lines()
        .map(|line| line.split(' ').take(4).collect::<Vec<_>>().join(" ") + " 0 0 0 0.5\n")
        .collect();
    place.write("scene/sparse/points3D.txt", dark);
    check();
    assert!(place.report("runs/scene")["luma"]["held_out"]["psnr"].is_f64());
}
