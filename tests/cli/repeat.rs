//! Same seed, same bytes.

use super::program::Place;
use super::shared::{UNTIL, onnx, place_with_run, place_with_scene};

/// luma.ply of a short run.
fn fitted(place: &Place, run: &str, fit: &[&str], seed: &str) -> Vec<u8> {
    let common = ["fit", "-o", run, "--preset", "draft", "--seed", seed];
    place.succeed(&[&common[..], fit].concat());
    place.read(&format!("{run}/luma.ply"))
}

/// Its color.ply.
fn colored(place: &Place, run: &str, until: &str) -> Vec<u8> {
    let teacher = onnx("ddcolor_tiny.onnx");
    let adam = ["--teacher", &teacher, "--solver", "adam", "--until", until];
    place.succeed(&[&["colorize", run], &adam[..]].concat());
    place.read(&format!("{run}/color.ply"))
}

#[test]
fn same_seed_same_bytes_other_seed_other_bytes() {
    let place = Place::new();
    let demo = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/demo");
    let small = [
        demo,
        "--max-side",
        "64",
        "--max-splats",
        "1500",
        "--iterations",
        "40",
    ];
    let outcome = |run: &str, seed: &str| {
        let luma = fitted(&place, run, &small, seed);
        [luma, colored(&place, run, "55")]
    };
    let first = outcome("first", "7");
    // Not assert_eq!, which would print the files.
    assert!(first == outcome("second", "7"));
    let other = outcome("other", "8");
    assert!(first[0] != other[0] && first[1] != other[1]);
}

#[test]
fn densified_and_coarse_runs_repeat_too() {
    let place = place_with_scene();
    let fit = ["scene", "--iterations", "240", "--coarse", "0.25"];
    let first = fitted(&place, "first", &fit, "7");
    assert!(first == fitted(&place, "second", &fit, "7"));
    let report = place.report("first");
    let (points, splats) = (&report["capture"]["points"], &report["luma"]["splats"]);
    assert_ne!(points, splats, "the set of Gaussians changes");
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
