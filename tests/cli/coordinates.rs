//! Scenes far from the origin: files beside a run lie where COLMAP has the cameras.

use super::picture::{png, psnr};
use super::program::Place;
use super::scene;
use super::shared::{QUICK_FIT, onnx};
use super::splat_file::SplatFile;

const OFFSET: [f64; 3] = [3000.25, -2000.5, 500.0];

fn run_far_away() -> Place {
    let place = Place::new();
    scene::write_moved(&place.path("scene"), OFFSET);
    let mut fit = QUICK_FIT;
    fit[5] = "40";
    // The shell around them is far from being in their middle.
    place.succeed(&[&fit[..], &["--no-surround"]].concat());
    place
}

/// The mean of the Gaussians' centers.
fn middle(place: &Place, name: &str) -> [f64; 3] {
    let file = SplatFile::read(place, name);
    ["x", "y", "z"].map(|axis| {
        let column = file.column(axis);
        column.iter().map(|&v| f64::from(v)).sum::<f64>() / column.len() as f64
    })
}

fn assert_near(found: [f64; 3], wanted: [f64; 3]) {
    for axis in 0..3 {
        assert!(
            (found[axis] - wanted[axis]).abs() < 1.0,
            "{found:?} {wanted:?}"
        );
    }
}

/// Checks that a splat file renders in gray like the run's luma, whose images are in `run/`.
#[track_caller]
fn draws_like_the_run(place: &Place, file: &str) {
    let ply = format!("{file}.ply");
    let render = ["render", &ply, "--colmap", "scene", "--views", "all", "-o"];
    let done = place.run(&[&render[..], &[file, "--luma"]].concat());
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(!done.stderr.contains("warning"), "{}", done.stderr);
    for index in [0, 5] {
        let name = scene::name(index);
        let [run, file] = ["run", file].map(|from| png(place, &format!("{from}/{name}")));
        assert!(run.iter().any(|v| *v > 0.2), "something is to be seen");
        assert!(psnr(&run, &file) > 40.0, "{name}: {} dB", psnr(&run, &file));
    }
}

#[test]
fn export_gives_colmaps_coordinates_back() {
    let place = run_far_away();
    let report = place.report("runs/scene");
    let offset: Vec<f64> = (0..3)
        .map(|k| report["capture"]["offset"][k].as_f64().expect("a number"))
        .collect();
    // In the run and beside it they lie near the origin, where f32 is fine enough.
    let inside = std::array::from_fn(|k| OFFSET[k] - offset[k]);
    assert_near(middle(&place, "runs/scene/luma.ply"), inside);
    let said = place.succeed(&["export", "-o", "near.ply"]);
    assert_near(middle(&place, "near.ply"), inside);
    let moved = format!("{} {} {}", offset[0], offset[1], offset[2]);
    assert!(said.contains(&format!("less {moved},")), "{said}");
    let header = SplatFile::read(&place, "near.ply").header;
    assert!(header.contains(&format!("comment offset {moved}")));
    let info = place.json(&["info", "near.ply", "--json"]);
    assert_eq!(info["offset"], report["capture"]["offset"]);
    // Where the steps of f32 do no harm they may lie where COLMAP has the cameras.
    let said = place.succeed(&["export", "--colmap-coordinates", "-o", "far.ply"]);
    assert_near(middle(&place, "far.ply"), OFFSET);
    assert_eq!(said.lines().count(), 4, "{said}");
    assert!(!said.contains("COLMAP's less"), "{said}");
    assert!(offset.iter().any(|v| v.abs() > 100.0));
}

#[test]
fn exported_files_come_back_to_their_photos() {
    let place = run_far_away();
    place.succeed(&["export", "-o", "near.ply"]);
    place.succeed(&["export", "--colmap-coordinates", "-o", "far.ply"]);
    place.succeed(&["render", "--views", "all", "-o", "run"]);
    // The run's own, named as any other file.
    let own = place.read("runs/scene/luma.ply");
    place.write("own.ply", own);
    for file in ["near", "far", "own"] {
        draws_like_the_run(&place, file);
    }

    let teacher = onnx("ddcolor_tiny.onnx");
    let colorize = |run: &str, more: &[&str]| {
        let begin = ["colorize", run, "--solver", "adam", "--teacher", &teacher];
        place.succeed(&[&begin[..], more].concat());
    };
    // Each lies where the gray file did, and says so.
    for file in ["near", "far"] {
        let gray = format!("{file}.ply");
        colorize(&gray, &["--colmap", "scene", "--until", "5"]);
        let [gray, color] = [gray, format!("{file}-color.ply")].map(|f| middle(&place, &f));
        assert_near(color, gray);
        draws_like_the_run(&place, &format!("{file}-color"));
    }
    colorize("runs/scene", &["--until", "45", "-o", "beside.ply"]);
    draws_like_the_run(&place, "beside");

    let held_out = |run: &str| {
        let psnr = &place.report(run)["luma"]["held_out"]["psnr"];
        psnr.as_f64().expect("a number")
    };
    let mut fit = QUICK_FIT;
    fit[5] = "1";
    place.succeed(&[&fit[..], &["-o", "runs/points"]].concat());
    for (run, init) in [("runs/init", "near.ply"), ("runs/own", "own.ply")] {
        place.succeed(&[&fit[..], &["-o", run, "--init", init]].concat());
        let [trained, init, points] = ["runs/scene", run, "runs/points"].map(held_out);
        assert!((trained - init).abs() < 0.5, "{trained} {init}");
        assert!(init > points + 0.5, "{init} {points}");
    }
}

/// Georeferenced: where the steps of `f32` are half a unit.
#[test]
#[ignore = "three trainings; others train away from the origin: make test-all"]
fn utm_coordinates_train_like_those_at_the_origin() {
    let utm = [512_345.25, 5_403_210.5, 321.0];
    let [near, far] = [[0.0; 3], utm].map(|offset| {
        let place = Place::new();
        scene::write_moved(&place.path("scene"), offset);
        let mut fit = QUICK_FIT;
        fit[5] = "150";
        place.succeed(&fit);
        place
    });
    let [near, away] = [&near, &far].map(|place| {
        let held_out = &place.report("runs/scene")["luma"]["held_out"];
        held_out["psnr"].as_f64().expect("a number")
    });
    assert!((near - away).abs() < 0.5, "{near} dB and {away} dB");
    assert!(near > 15.0, "{near} dB");
    // Beside the run, too, nothing is lost.
    far.succeed(&["export", "-o", "utm.ply"]);
    far.succeed(&["render", "--views", "all", "-o", "run"]);
    draws_like_the_run(&far, "utm");
    let asked = far.run(&["export", "--colmap-coordinates", "-o", "coarse.ply"]);
    assert_eq!(asked.code, Some(1), "{}", asked.stderr);
    for word in [
        "coarse.ply",
        "near 540321",
        "are 0.5 apart",
        "leave --colmap-coordinates out",
    ] {
        assert!(asked.stderr.contains(word), "no {word}: {}", asked.stderr);
    }
    assert!(!far.path("coarse.ply").exists());
}
