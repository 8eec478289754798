//! Errors of runs, splat files and output paths.

use super::{COLORIZE, Case, Place, case, nothing};

const REPORT: &str = "runs/scene/report.json";

/// A splat file's header without a Gaussian.
fn empty_ply(place: &Place) {
    const END: &[u8] = b"end_header\n";
    let bytes = place.read("runs/scene/luma.ply");
    let end = bytes.windows(END.len()).position(|window| window == END);
    let header = std::str::from_utf8(&bytes[..end.expect("a header")]).expect("text");
    let lines = header
        .lines()
        .map(|line| match line.strip_prefix("element vertex ") {
            Some(_) => "element vertex 0\n".to_owned(),
            None => format!("{line}\n"),
        });
    place.write("empty.ply", lines.collect::<String>() + "end_header\n");
}

fn cut_ply(place: &Place) {
    let bytes = place.read("runs/scene/luma.ply");
    place.write("cut.ply", &bytes[..bytes.len() - 10]);
}

fn no_runs(place: &Place) {
    std::fs::remove_dir_all(place.path("runs")).expect("a folder");
}

fn cut_report(place: &Place) {
    let bytes = place.read(REPORT);
    place.write(REPORT, &bytes[..bytes.len() / 2]);
}

/// All views are trained on.
fn no_holdout(place: &Place) {
    let text = String::from_utf8(place.read(REPORT)).expect("text");
    let changed = text.replace("\"holdout\": true", "\"holdout\": false");
    assert_ne!(text, changed);
    place.write(REPORT, changed);
}

pub(super) const CASES: &[Case] = &[
    case(
        "no run to color",
        no_runs,
        COLORIZE,
        &["no run under runs/", "gs-chroma fit"],
    ),
    case(
        "no run to render",
        no_runs,
        "render -o out",
        &["no run under runs/", "gs-chroma fit"],
    ),
    case(
        "no run to export",
        no_runs,
        "export -o out.ply",
        &["no run under runs/"],
    ),
    case(
        "no such run to color",
        nothing,
        "colorize runs/none --teacher onnx/ddcolor_tiny.onnx",
        &["runs/none/report.json", "gs-chroma fit"],
    ),
    case(
        "no such run to render",
        nothing,
        "render runs/none -o out",
        &["runs/none/report.json", "gs-chroma fit"],
    ),
    case(
        "no such run to export",
        nothing,
        "export runs/none -o out.ply",
        &["runs/none/report.json", "gs-chroma fit"],
    ),
    case(
        "no such run to look at",
        nothing,
        "view runs/none",
        &["runs/none/report.json", "gs-chroma fit"],
    ),
    case(
        "a cut splat file to look at",
        cut_ply,
        "view cut.ply",
        &["cut.ply", "cut off"],
    ),
    case(
        "a run without a scene to look at",
        |p| {
            for file in ["luma.ply", "color.ply"] {
                std::fs::remove_file(p.path("runs/scene").join(file)).expect("a file");
            }
        },
        "view",
        &["scene: has no scene", "gs-chroma fit"],
    ),
    case(
        "no run to send to someone",
        no_runs,
        "export -o out.html",
        &["no run under runs/", "gs-chroma fit"],
    ),
    case(
        "no such path for info",
        nothing,
        "info runs/none",
        &["runs/none", "no such folder"],
    ),
    case(
        "a damaged report to color",
        cut_report,
        COLORIZE,
        &[REPORT, "damaged", "line", "gs-chroma fit"],
    ),
    case(
        "a damaged report to render",
        cut_report,
        "render -o out",
        &[REPORT, "damaged"],
    ),
    case(
        "a damaged report to show",
        cut_report,
        "info runs/scene",
        &[REPORT, "damaged"],
    ),
    case(
        "a foreign report",
        |p| p.write(REPORT, "{\"version\": 1}"),
        COLORIZE,
        &[REPORT, "missing field"],
    ),
    case(
        "no luma",
        |p| std::fs::remove_file(p.path("runs/scene/luma.ply")).expect("a file"),
        COLORIZE,
        &["runs/scene/luma.ply"],
    ),
    case(
        "a cut splat file",
        cut_ply,
        "info cut.ply",
        &["cut.ply", "cut off"],
    ),
    case(
        "no splat file",
        nothing,
        "info onnx/truncated.onnx",
        &[
            "truncated.onnx",
            ".onnx files are not read; convert it to .ply",
        ],
    ),
    case(
        "colorize without cameras",
        nothing,
        "colorize runs/scene/luma.ply --teacher onnx/ddcolor_tiny.onnx",
        &["luma.ply", "--colmap"],
    ),
    case(
        "render without cameras",
        nothing,
        "render runs/scene/luma.ply -o out",
        &["luma.ply", "--colmap"],
    ),
    case(
        "an empty file to color",
        empty_ply,
        "colorize empty.ply --colmap scene --teacher onnx/ddcolor_tiny.onnx",
        &["empty.ply", "no Gaussians", "gs-chroma fit"],
    ),
    case(
        "an empty file to render",
        empty_ply,
        "render empty.ply --colmap scene -o out",
        &["empty.ply", "no Gaussians"],
    ),
    case(
        "an empty file to begin with",
        empty_ply,
        "fit scene --preset draft --init empty.ply -o out",
        &["empty.ply", "no Gaussians"],
    ),
    case(
        "a cut file to begin with",
        cut_ply,
        "fit scene --preset draft --init cut.ply -o out",
        &["cut.ply", "cut off"],
    ),
    case(
        "no file to begin with",
        nothing,
        "fit scene --preset draft --init none.ply -o out",
        &["none.ply"],
    ),
    case(
        "until before the end of luma",
        nothing,
        "colorize --teacher onnx/ddcolor_tiny.onnx --solver adam --until 60",
        &["--until 60", "60 iterations", "larger"],
    ),
    case(
        "nothing held out",
        no_holdout,
        "render --views test -o out",
        &["no view is held out", "--views"],
    ),
    case(
        "fit into a file",
        nothing,
        "fit scene --preset draft --iterations 3 -o onnx/truncated.onnx",
        &["truncated.onnx", "is a file", "folder"],
    ),
    case(
        "fit below a file",
        nothing,
        "fit scene --preset draft --iterations 3 -o onnx/truncated.onnx/run",
        &["truncated.onnx/run"],
    ),
    case(
        "render into a file",
        nothing,
        "render -o onnx/truncated.onnx",
        &["truncated.onnx", "is a file", "folder"],
    ),
    case(
        "colorize into a folder",
        nothing,
        "colorize --teacher onnx/ddcolor_tiny.onnx --solver adam --until 62 -o runs",
        &["runs", "is a folder", ".ply"],
    ),
    case(
        "colorize below a file",
        nothing,
        "colorize --teacher onnx/ddcolor_tiny.onnx --solver adam --until 62 -o onnx/truncated.onnx/color.ply",
        &["truncated.onnx"],
    ),
    case(
        "export into a folder",
        nothing,
        "export -o runs",
        &["runs", "is a folder", ".ply"],
    ),
    case(
        "export below a file",
        nothing,
        "export -o onnx/truncated.onnx/out.ply",
        &["truncated.onnx"],
    ),
];

/// Linux' view of its processes is a folder that not even root writes to.
#[cfg(target_os = "linux")]
pub(super) const UNWRITABLE: &[Case] = &[
    case(
        "fit",
        nothing,
        "fit scene --preset draft --iterations 3 -o /proc",
        &["/proc", "cannot be written to", "-o"],
    ),
    case(
        "colorize",
        nothing,
        "colorize --teacher onnx/ddcolor_tiny.onnx --solver adam --until 62 -o /proc/out.ply",
        &["/proc", "cannot be written to", "-o"],
    ),
    case(
        "export",
        nothing,
        "export -o /proc/out.ply",
        &["/proc", "cannot be written to"],
    ),
    case(
        "render",
        nothing,
        "render -o /proc",
        &["/proc", "cannot be written to"],
    ),
    case(
        "a folder that cannot be made",
        nothing,
        "fit scene --preset draft --iterations 3 -o /proc/run",
        &["/proc/run"],
    ),
];
