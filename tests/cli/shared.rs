//! One run that many tests read: trained and colored once.

use std::fs;
use std::path::PathBuf;
use std::sync::LazyLock;

use super::program::{Place, files_below};
use super::scene;

/// Luma iterations of the shared run.
pub const LUMA: usize = 60;
/// Last chroma iteration of the shared run.
pub const UNTIL: usize = 80;

/// Arguments of a short `fit` of `scene/`. The ground that its discs lie on is far away for
/// all that photos say; Gaussians for it would be more than those of the discs.
pub const QUICK_FIT: [&str; 9] = [
    "fit",
    "scene",
    "--preset",
    "draft",
    "--iterations",
    "3",
    "--without",
    "background",
    // What is behind the discs moves with the camera: where it matches, it is not.
    "--no-fill-gaps",
];

/// Makes a `fit` of the bundled photos quick. Points stay large and thin, so pictures of all of
/// them blend thousands.
pub const FEW: [&str; 6] = [
    "--preset",
    "draft",
    "--iterations",
    "3",
    "--max-splats",
    "600",
];

/// The tests' networks.
pub fn onnx(name: &str) -> String {
    format!("{}/tests/fixtures/onnx/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// A folder with `scene/` and nothing else.
pub fn place_with_scene() -> Place {
    let place = Place::new();
    scene::write(&place.path("scene"));
    place
}

/// Files with their bytes, and the path of `scene/` in their report.
type Made = (Vec<(String, Vec<u8>)>, String);

/// A folder with `scene/` and its colored run in `runs/scene`, luma of degree 2
/// and chroma of degree 1.
pub fn place_with_run() -> Place {
    static MADE: LazyLock<Made> = LazyLock::new(|| {
        let place = place_with_scene();
        let (luma, until) = (LUMA.to_string(), UNTIL.to_string());
        let fit = [
            "fit",
            "scene",
            "--preset",
            "draft",
            "--sh-degree",
            "2",
            "--without",
            "background",
        ];
        place.succeed(&[&fit[..], &["--iterations", &luma]].concat());
        let teacher = onnx("ddcolor_tiny.onnx");
        let colorize = ["colorize", "--sh-degree", "1", "--teacher", &teacher];
        place.succeed(&[&colorize[..], &["--solver", "adam", "--until", &until]].concat());
        (files_below(&place.path("")), absolute(place.path("scene")))
    });
    let place = Place::new();
    for (name, bytes) in &MADE.0 {
        place.write(name, bytes);
    }
    // The report names the photos' folder.
    let report = String::from_utf8(place.read("runs/scene/report.json")).expect("text");
    assert!(report.contains(&MADE.1), "{report}");
    let here = absolute(place.path("scene"));
    place.write("runs/scene/report.json", report.replace(&MADE.1, &here));
    place
}

/// A path as a report has it.
fn absolute(path: PathBuf) -> String {
    let path = fs::canonicalize(path).expect("a folder");
    let quoted = serde_json::to_string(&path.to_string_lossy()).expect("text");
    quoted.trim_matches('"').to_owned()
}
