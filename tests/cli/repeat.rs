//! Same seed, same bytes.

use super::program::Place;
use super::shared::{UNTIL, onnx, place_with_run, place_with_scene};

/// luma.ply and color.ply of a short run.
fn outcome(place: &Place, run: &str, fit: &[&str], until: &str, seed: &str) -> [Vec<u8>; 2] {
    let common = ["fit", "-o", run, "--preset", "draft", "--seed", seed];
    place.succeed(&[&common[..], fit].concat());
    let teacher = onnx("ddcolor_tiny.onnx");
    place.succeed(&[
        "colorize",
        run,
        "--teacher",
        &teacher,
        "--solver",
        "adam",
        "--until",
        until,
    ]);
    ["luma.ply", "color.ply"].map(|file| place.read(&format!("{run}/{file}")))
}

fn assert_repeats(place: &Place, fit: &[&str], until: &str) {
    let first = outcome(place, "first", fit, until, "7");
    // Not assert_eq!, which would print the files.
    assert!(first == outcome(place, "second", fit, until, "7"));
    let other = outcome(place, "other", fit, until, "8");
    assert!(first[0] != other[0] && first[1] != other[1]);
}

#[test]
fn same_seed_same_bytes_other_seed_other_bytes() {
    let demo = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo");
    let small = [
        "--max-side",
        "64",
        "--max-splats",
        "1500",
        "--iterations",
        "40",
    ];
    assert_repeats(&Place::new(), &[&[demo][..], &small].concat(), "55");
}

#[test]
fn densified_runs_repeat_too() {
    let place = place_with_scene();
    assert_repeats(&place, &["scene", "--iterations", "240"], "245");
    let report = place.report("first");
    let (points, splats) = (&report["capture"]["points"], &report["luma"]["splats"]);
    assert_ne!(points, splats, "the set of Gaussians changes");
}

/// Relocation draws lots and adds noise; the first sixty iterations are coarse.
#[test]
fn relocated_and_coarse_runs_repeat_too() {
    let place = place_with_scene();
    let cap = [
        "--densify",
        "relocate",
        "--coarse",
        "0.25",
        "--max-splats",
        "320",
    ];
    let fit = ["scene", "--iterations", "240"];
    assert_repeats(&place, &[&fit[..], &cap].concat(), "245");
    let luma = &place.report("first")["luma"];
    assert!(luma["splats"].as_u64() <= Some(320), "{luma}");
    assert_ne!(luma["splats"], place.report("first")["capture"]["points"]);
}

#[test]
fn coloring_again_gives_the_same_bytes() {
    let place = place_with_run();
    let teacher = onnx("ddcolor_tiny.onnx");
    let until = UNTIL.to_string();
    let colorize = [
        "colorize",
        "--sh-degree",
        "1",
        "--solver",
        "adam",
        "--until",
        &until,
    ];
    place.succeed(&[&colorize[..], &["--teacher", &teacher, "-o", "again.ply"]].concat());
    assert!(place.read("again.ply") == place.read("runs/scene/color.ply"));
}
