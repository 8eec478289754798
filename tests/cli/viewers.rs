//! Splat files in the viewers that people use, drawn by Chromium without a GPU: tools/viewers.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use serde_json::Value;

use super::program::Place;

/// Folder of the harness.
fn tools() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tools/viewers")
}

/// The bundled scene. Of the tests' own, discs lie at one depth, which viewers sort as they like.
fn demo() -> String {
    format!("{}/assets/demo", env!("CARGO_MANIFEST_DIR"))
}

/// Median PSNR in dB of what a viewer shows of a file, compared with `gs-chroma render`.
#[track_caller]
fn psnr(results: &Value, file: &str, viewer: &str) -> f64 {
    let results = results.as_array().expect("a list");
    let found = results
        .iter()
        .find(|result| result["file"] == file && result["viewer"] == viewer);
    let found = found.unwrap_or_else(|| panic!("{viewer} was not asked for {file}"));
    found["psnr"]
        .as_f64()
        .unwrap_or_else(|| panic!("{file} in {viewer}: {}", found["error"]))
}

/// Draws files of a place in viewers; the screenshots stay in the target folder.
fn shown(place: &Place, files: &[&str]) -> Value {
    let out = Path::new(env!("CARGO_TARGET_TMPDIR")).join("viewers");
    let mut command = Command::new("node");
    command.arg(tools().join("src/main.mjs"));
    command.arg("--colmap").arg(demo());
    command.arg("--reference").arg(place.path("renders"));
    command.arg("--out").arg(&out).args(["--y-up", "glb"]);
    command.args(files.iter().map(|file| place.path(file)));
    let done = command.output().expect("Node runs");
    println!("{}", String::from_utf8_lossy(&done.stdout));
    let said = String::from_utf8_lossy(&done.stderr);
    assert!(done.status.success(), "{said}");
    let results = std::fs::read_to_string(out.join("results.json")).expect("results");
    serde_json::from_str(&results).expect("JSON")
}

#[test]
#[ignore = "needs Chromium, Node and the viewers: make test-all"]
fn viewers_show_what_is_rendered() {
    let place = Place::new();
    let fit = ["fit", &demo(), "-o", "run", "--preset", "draft"];
    place.succeed(&[&fit[..], &["--iterations", "200", "--max-side", "200"]].concat());
    let teacher = format!("{}/../teacher/demo-teacher.onnx", demo());
    place.succeed(&["colorize", "run", "--teacher", &teacher]);
    place.succeed(&["render", "run", "-o", "renders"]);
    for format in ["ply", "compressed.ply", "splat", "spz", "sog", "glb"] {
        place.succeed(&["export", "run", "-o", &format!("plain.{format}")]);
    }
    let said = place.json(&[
        "export",
        "run",
        "--viewer",
        "playcanvas",
        "-o",
        "playcanvas.ply",
        "--json",
    ]);
    assert_eq!(said["shown"][1]["viewer"], "playcanvas");
    let [before, after] = ["before", "after"].map(|key| said["shown"][1][key].as_f64());
    assert!(after > before, "{said}");
    place.succeed(&["export", "run", "--viewer", "any", "-o", "any.ply"]);
    let results = shown(
        &place,
        &[
            "plain.ply:spark,playcanvas,three",
            "plain.compressed.ply:spark,playcanvas",
            "plain.splat:spark,three",
            "plain.spz:spark,three",
            "plain.sog:spark,playcanvas",
            "plain.glb:playcanvas,three",
            "playcanvas.ply:playcanvas",
            "any.ply:spark,playcanvas",
        ],
    );
    let psnr = |file, viewer| psnr(&results, file, viewer);
    assert!(psnr("plain.ply", "spark") > 34.0);
    // Neither draws as the scene was trained.
    let plain = psnr("plain.ply", "playcanvas");
    assert!(plain.min(psnr("plain.ply", "three")) > 15.0);
    for (file, viewer) in [
        ("plain.compressed.ply", "spark"),
        ("plain.compressed.ply", "playcanvas"),
        ("plain.spz", "spark"),
        ("plain.spz", "three"),
        ("plain.sog", "spark"),
        ("plain.sog", "playcanvas"),
        ("plain.glb", "playcanvas"),
        ("plain.glb", "three"),
    ] {
        let [found, plain] = [file, "plain.ply"].map(|file| psnr(file, viewer));
        assert!(
            found > plain - 3.0,
            "{file} in {viewer}: {found} and {plain} dB"
        );
    }
    // It has no harmonics.
    assert!(psnr("plain.splat", "spark").min(psnr("plain.splat", "three")) > 15.0);
    assert!(psnr("playcanvas.ply", "playcanvas") > plain + 3.0);
    let any = ["spark", "playcanvas"].map(|viewer| psnr("any.ply", viewer));
    assert!(any[1] > plain + 1.0, "{any:?}");
    assert!(any[0] > 28.0, "{any:?}");
}
