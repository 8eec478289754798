//! `info`, `export`, help, and who reads the output.

use std::fs;
use std::process::Stdio;

use super::pages::COMMANDS;
use super::program::{Done, Place};
use super::scene;
use super::shared::{place_with_run, place_with_scene};
use super::splat_file::SplatFile;

#[test]
fn info_on_a_run() {
    let place = place_with_run();
    assert_eq!(
        place.json(&["info", "runs/scene", "--json"]),
        place.report("runs/scene")
    );
    let words = place.succeed(&["info", "runs/scene"]);
    for part in [
        "Photos    10 with a pose from",
        "60 iterations with the preset draft",
        "held-out PSNR ",
        "from ddcolor_tiny.onnx (DDColor)",
        "luma.ply",
        "\nnext: gs-chroma frames runs/scene -o colored\n",
    ] {
        assert!(words.contains(part), "{part}: {words}");
    }
    let columns = words.lines().map(|line| line.chars().count());
    assert!(columns.max() <= Some(100), "{words}");
}

#[test]
fn info_on_splat_files() {
    let place = place_with_run();
    for (file, gray) in [("luma.ply", true), ("color.ply", false)] {
        let path = format!("runs/scene/{file}");
        let info = place.json(&["info", &path, "--json"]);
        assert_eq!(info["kind"], "splat file");
        assert_eq!(info["gray"], gray);
        assert_eq!(info["sh_degree"], 2);
        assert_eq!(info["skipped"], 0);
        let file = SplatFile::read(&place, &path);
        assert_eq!(info["splats"], file.count());
        let lowest = file.column("y").into_iter().fold(f32::INFINITY, f32::min);
        assert_eq!(info["lowest"][1].as_f64(), Some(f64::from(lowest)));
        let words = place.succeed(&["info", &path]);
        let kind = if gray {
            "Gaussians, gray,"
        } else {
            "Gaussians, in color,"
        };
        assert!(words.contains(kind), "{words}");
    }
}

#[test]
fn info_on_a_colmap_folder() {
    let place = place_with_scene();
    let info = place.json(&["info", "scene", "--json"]);
    assert_eq!(info["kind"], "COLMAP folder");
    assert_eq!(info["views"], scene::VIEWS);
    assert_eq!(info["points"], scene::POINTS);
    assert_eq!(info["largest_photo"], serde_json::json!(scene::SIZE));
    let words = place.succeed(&["info", "scene"]);
    for part in [
        "64 triangulated points",
        "64 x 48 pixels",
        "next: gs-chroma fit scene",
    ] {
        assert!(words.contains(part), "{part}: {words}");
    }
    // Larger than u32 can count pixels.
    scene::write_moved(&place.path("large"), [0.0; 3]);
    place.write(
        "large/sparse/cameras.txt",
        "1 PINHOLE 1048576 1048576 60 60 32 24\n",
    );
    let info = place.json(&["info", "large", "--json"]);
    assert_eq!(info["largest_photo"], serde_json::json!([1 << 20, 1 << 20]));
}

#[test]
fn export_writes_colors_or_luma() {
    let place = place_with_run();
    let count = SplatFile::read(&place, "runs/scene/color.ply").count();
    for (name, options) in [("new/color.ply", &[][..]), ("luma.ply", &["--luma"])] {
        let export = ["export", "runs/scene", "-o", name];
        let printed = place.succeed(&[&export[..], options].concat());
        assert!(printed.contains(&format!("{count} Gaussians")), "{printed}");
        let file = SplatFile::read(&place, name);
        assert_eq!(file.count(), count);
        let gray = file.column("f_dc_0") == file.column("f_dc_1");
        assert_eq!(gray, !options.is_empty());
    }
    // The run's color is what is exported, and luma where there is none.
    let [out, run] = ["new/color.ply", "runs/scene/color.ply"]
        .map(|name| SplatFile::read(&place, name).column("f_rest_3"));
    assert_eq!(out, run);
    fs::remove_file(place.path("runs/scene/color.ply")).expect("a file");
    place.succeed(&["export", "-o", "gray.ply"]);
    assert!(place.read("gray.ply") == place.read("luma.ply"));
}

#[test]
fn help_and_version() {
    let place = Place::new();
    let help = place.succeed(&["--help"]);
    assert!(
        COMMANDS.iter().all(|command| help.contains(command)),
        "{help}"
    );
    assert!(
        place
            .succeed(&["--version"])
            .contains(env!("CARGO_PKG_VERSION"))
    );
}

#[test]
fn a_reader_may_leave_early() {
    let place = place_with_run();
    for arguments in [
        &["info", "runs/scene"][..],
        &["info", "runs/scene", "--json"],
    ] {
        let mut command = place.command(arguments);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().expect("the program starts");
        drop(child.stdout.take());
        let done = Done::of(child.wait_with_output());
        assert_eq!((done.code, done.stderr.as_str()), (Some(0), ""));
    }
}
