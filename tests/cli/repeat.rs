//! Same seed, same bytes.

use super::program::Place;
use super::shared::{onnx, place_with_scene};

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
    let place = place_with_scene();
    let fit = ["scene", "--iterations", "120"];
    let outcome = |run: &str, seed: &str| {
        let luma = fitted(&place, run, &fit, seed);
        [luma, colored(&place, run, "130")]
    };
    let first = outcome("first", "7");
    let report = place.report("first");
    let (points, splats) = (&report["capture"]["points"], &report["luma"]["splats"]);
    assert_ne!(points, splats, "the set of Gaussians changes");
    // Not assert_eq!, which would print the files.
    assert!(first == outcome("second", "7"));
    let other = outcome("other", "8");
    assert!(first[0] != other[0] && first[1] != other[1]);
}
