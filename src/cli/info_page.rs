//! Findings of `info`, as a page to read.

use std::{fmt::Write, fs, path::Path};

use serde_json::Value;

use super::bar::WIDTH;
use crate::report::Report;

/// Columns of what a line is about.
const LABEL: usize = 10;

/// A page: paragraphs of lines, the first of which says what they are about.
#[derive(Default)]
struct Page(String);

impl Page {
    /// Adds lines about something, none where they are empty.
    fn about(&mut self, label: &str, lines: impl IntoIterator<Item = String>) {
        let lines = lines.into_iter().filter(|line| !line.is_empty());
        for (i, line) in lines.enumerate() {
            let label = if i == 0 { label } else { "" };
            for (k, part) in wrapped(&line, WIDTH - LABEL).iter().enumerate() {
                let label = if k == 0 { label } else { "" };
                // Writing to a string cannot fail.
                let _ = writeln!(self.0, "{label:LABEL$}{part}");
            }
        }
    }
}

/// A line broken between words, into lines of so many columns.
fn wrapped(line: &str, columns: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in line.split(' ') {
        match lines.last_mut() {
            Some(last) if last.chars().count() + 1 + word.chars().count() <= columns => {
                last.push(' ');
                last.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

/// Page of a run, from its report.
pub(super) fn of_run(path: &Path, report: &Report) -> String {
    let mut page = Page::default();
    page.about("Run", [path.display().to_string()]);
    of_photos(&mut page, report);
    of_scene(&mut page, report);
    of_colors(&mut page, report);
    let device = &report.device;
    let software = if device.software { ", software" } else { "" };
    let device = format!("{} ({}{software})", device.name, device.backend);
    page.about("Device", [device]);
    page.about("Files", [files_of(path)]);
    let chroma = report.chroma.iter().flat_map(|chroma| &chroma.warnings);
    page.about("Warnings", report.warnings.iter().chain(chroma).cloned());
    page.0
}

fn of_photos(page: &mut Page, report: &Report) {
    let capture = &report.capture;
    let side = match capture.load.max_side {
        Some(side) => format!("seen at {side} pixels on their longer side at most"),
        None => "seen at their full size".to_owned(),
    };
    let masks = match capture.masked_views {
        0 => String::new(),
        count => format!(", {count} with a mask"),
    };
    let left_out = match capture.rejected.len() {
        0 => String::new(),
        count => format!("{count} left out: {}", capture.rejected.join("; ")),
    };
    let moved = match capture.offset.iter().any(|&x| x != 0.0) {
        true => {
            let [x, y, z] = capture.offset;
            format!("moved to the origin by ({x}, {y}, {z}) of COLMAP's units")
        }
        false => String::new(),
    };
    let lines = [
        format!(
            "{} with a pose from {}: {} trained on, {} held out{masks}",
            capture.views, capture.path, capture.train, capture.test
        ),
        side,
        format!("{} triangulated points", count(capture.points)),
        left_out,
        moved,
    ];
    page.about("Photos", lines);
}

fn of_scene(page: &mut Page, report: &Report) {
    let luma = &report.luma;
    let held_out = luma.held_out.map_or_else(
        || "no photo was held out to measure it on".to_owned(),
        |quality| quality.in_words(),
    );
    let names = |on: bool| {
        let effects = report.effects.iter().filter(|effect| effect.on == on);
        let names: Vec<String> = effects.map(|effect| effect.name.to_string()).collect();
        names.join(", ")
    };
    let effects = match (names(true), names(false)) {
        (on, off) if on.is_empty() => format!("no effect modeled ({off})"),
        (on, _) => format!("effects modeled: {on}"),
    };
    let lines = [
        format!(
            "{} Gaussians, SH degree {}",
            count(luma.splats),
            luma.settings.sh_degree
        ),
        format!(
            "{} iterations with the preset {}, {}{}",
            count(luma.iterations),
            report.preset,
            duration(luma.seconds.all),
            memory(luma.peak_host_memory, luma.peak_device_memory)
        ),
        held_out,
        effects,
    ];
    page.about("Scene", lines);
}

fn of_colors(page: &mut Page, report: &Report) {
    let Some(chroma) = &report.chroma else {
        page.about("Colors", ["none yet".to_owned()]);
        return;
    };
    let teachers = chroma.teachers.iter().map(|teacher| {
        let weight = match chroma.teachers.len() {
            1 => String::new(),
            _ => format!(", weight {}", teacher.weight),
        };
        format!("from {} ({}{weight})", teacher.info.name, teacher.info.kind)
    });
    let hints = match chroma.hints {
        0 => String::new(),
        count => format!(", {count} of them painted"),
    };
    let percent = 100.0 * chroma.unseen.unwrap_or(0.0);
    let unseen = match percent < 0.05 {
        true => String::new(),
        false => format!("; no colored photo shows {percent:.1} % of the Gaussians"),
    };
    let truth = chroma.pictures.delta_e.map_or(String::new(), |error| {
        format!(
            "differ from the photos' own by ΔE00 {:.2} (95th percentile {:.1})",
            error.mean, error.percentile_95
        )
    });
    let teacher = chroma.pictures.teacher_colorfulness;
    let teacher = teacher.map_or(String::new(), |c| {
        format!(", the teacher's pictures {c:.1}")
    });
    let lines = [
        format!(
            "{} photos{hints}, SH degree {}, {}{}{unseen}",
            chroma.colored_views,
            chroma.settings.sh_degree,
            duration(chroma.seconds.all),
            memory(chroma.peak_host_memory, chroma.peak_device_memory)
        ),
        truth,
        format!("colorfulness {:.1}{teacher}", chroma.pictures.colorfulness),
        format!(
            "color.ply differs from the solved colors by ΔE00 {:.2}",
            chroma.bake.mean
        ),
    ];
    page.about("Colors", teachers.chain(lines));
}

/// Page of a COLMAP folder or a splat file, from what `info --json` prints of it.
pub(super) fn of_found(path: &Path, found: &Value) -> String {
    let number = |key: &str| found[key].as_u64().unwrap_or(0) as usize;
    let triple = |key: &str| {
        let value = |axis: usize| found[key][axis].as_f64().unwrap_or(f64::NAN);
        [0, 1, 2].map(value)
    };
    let mut page = Page::default();
    let offset = match triple("offset") {
        [0.0, 0.0, 0.0] => String::new(),
        [x, y, z] => format!("moved to the origin by ({x}, {y}, {z}) of COLMAP's units"),
    };
    if found["kind"] == "COLMAP folder" {
        page.about("COLMAP", [path.display().to_string()]);
        let kinds = found["photos"].as_object().into_iter().flatten();
        let kinds = kinds.map(|(kind, count)| format!("{count} files: {kind}"));
        let [width, height] = [0, 1].map(|i| found["largest_photo"][i].as_u64().unwrap_or(0));
        let masks = match number("masked_views") {
            0 => String::new(),
            masks => format!("{masks} with a mask"),
        };
        let rejected = found["rejected"].as_array().into_iter().flatten();
        let rejected = rejected.filter_map(|line| Some(format!("left out {}", line.as_str()?)));
        let views = [
            format!("{} views with a pose", number("views")),
            format!("{width} x {height} pixels the largest"),
            masks,
        ];
        page.about("Photos", views.into_iter().chain(kinds).chain(rejected));
        let error = found["reprojection_error"]
            .as_f64()
            .map_or(String::new(), |pixels| {
                format!(", median reprojection error {pixels:.2} pixels")
            });
        let extent = found["extent"].as_f64().unwrap_or(f64::NAN);
        page.about(
            "Model",
            [
                format!("{} triangulated points{error}", count(number("points"))),
                format!("the cameras' radius is {extent:.2} of COLMAP's units"),
                offset,
            ],
        );
    } else {
        page.about("Splats", [path.display().to_string()]);
        let gray = found["gray"] == true;
        let skipped = match number("skipped") {
            0 => String::new(),
            skipped => format!("{} more cannot be drawn", count(skipped)),
        };
        let drawn = match found["antialiased"] == true {
            true => "made to be drawn antialiased (Mip-Splatting)",
            false => "",
        };
        let [low, high] = ["lowest", "highest"].map(triple);
        let sides = [0, 1, 2].map(|axis| format!("{:.2}", high[axis] - low[axis]));
        page.about(
            "Scene",
            [
                format!(
                    "{} Gaussians, {}, SH degree {}",
                    count(number("splats")),
                    if gray { "gray" } else { "in color" },
                    number("sh_degree")
                ),
                skipped,
                drawn.to_owned(),
                format!("{} units across, along x, y and z", sides.join(" x ")),
                offset,
            ],
        );
        let size = fs::metadata(path).map_or(0, |file| file.len());
        page.about("File", [bytes(size)]);
    }
    page.0
}

/// The files of a run with their sizes.
fn files_of(path: &Path) -> String {
    let entries = fs::read_dir(path).into_iter().flatten().flatten();
    let mut files: Vec<String> = entries
        .filter_map(|entry| {
            let (name, file) = (entry.file_name(), entry.metadata().ok()?);
            let name = name.to_string_lossy();
            let shown = !name.starts_with('.');
            let folder = || format!("{name}/");
            let file = file
                .is_dir()
                .then(folder)
                .unwrap_or_else(|| format!("{name} {}", bytes(file.len())));
            shown.then_some(file)
        })
        .collect();
    files.sort();
    files.join(", ")
}

/// A number with its thousands apart.
fn count(number: usize) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

fn bytes(bytes: u64) -> String {
    match bytes {
        0..1_000 => format!("{bytes} B"),
        1_000..1_000_000 => format!("{:.0} kB", bytes as f64 / 1e3),
        1_000_000..1_000_000_000 => format!("{:.1} MB", bytes as f64 / 1e6),
        _ => format!("{:.2} GB", bytes as f64 / 1e9),
    }
}

fn duration(seconds: f64) -> String {
    match seconds {
        ..120.0 => format!("{seconds:.1} s"),
        ..7200.0 => format!("{:.1} minutes", seconds / 60.0),
        _ => format!("{:.1} hours", seconds / 3600.0),
    }
}

/// Peak memory of a stage, as far as the system reports it.
fn memory(host: Option<u64>, device: Option<u64>) -> String {
    let host = host.map(|most| format!("{} of memory", bytes(most)));
    let device = device.map(|most| format!("{} on the device", bytes(most)));
    let told: Vec<String> = host.into_iter().chain(device).collect();
    match told.is_empty() {
        true => String::new(),
        false => format!(", {}", told.join(" and ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_easily() {
        let counts = [0, 999, 1_000, 12_345_678].map(count);
        assert_eq!(counts, ["0", "999", "1,000", "12,345,678"]);
        let sizes = [12, 34_567, 1_234_567, 5_000_000_000].map(bytes);
        assert_eq!(sizes, ["12 B", "35 kB", "1.2 MB", "5.00 GB"]);
        let times = [0.04, 90.0, 300.0, 9000.0].map(duration);
        assert_eq!(times, ["0.0 s", "90.0 s", "5.0 minutes", "2.5 hours"]);
        assert_eq!(memory(None, None), "");
        let both = memory(Some(2_000_000), Some(3_000));
        assert_eq!(both, ", 2.0 MB of memory and 3 kB on the device");
    }

    #[test]
    fn lines_are_broken_between_words() {
        assert_eq!(wrapped("one two three", 7), ["one two", "three"]);
        assert_eq!(wrapped("a-word-too-long b", 4), ["a-word-too-long", "b"]);
        let mut page = Page::default();
        page.about(
            "Photos",
            ["first".to_owned(), String::new(), "second".to_owned()],
        );
        assert_eq!(page.0, "Photos    first\n          second\n");
    }
}
