//! Commands on a terminal, which is made by `script` (util-linux).

use std::process::{Command, Stdio};

use super::program::{Done, Place};
use super::shared::{QUICK_FIT, place_with_scene};

/// Columns of the terminal, more than any bar may take: what is longer than it may be is seen.
const COLUMNS: usize = 200;

/// Lines that a command draws, in the order of drawing, and its output at the end.
fn shown(place: &Place, arguments: &[&str]) -> Vec<String> {
    let program = env!("CARGO_BIN_EXE_gs-chroma");
    let command = format!(
        "stty cols {COLUMNS} rows 24; {program} {}",
        arguments.join(" ")
    );
    let mut script = Command::new("script");
    script
        .args(["-qefc", &command, "/dev/null"])
        .current_dir(place.path(""))
        .env("XDG_RUNTIME_DIR", place.path(""))
        .stdin(Stdio::null());
    let done = Done::of(script.output());
    assert_eq!(done.code, Some(0), "{}", done.stdout);
    // A line that is drawn over begins anew, and one that stays is filled up with blanks.
    let lines = done.stdout.split(['\n', '\r']).map(without_colors);
    lines
        .flat_map(|line| {
            let line: Vec<char> = line.chars().collect();
            let lines = line.chunks(COLUMNS).map(|line| line.iter().collect());
            lines.collect::<Vec<String>>()
        })
        .map(|line| line.trim_end().to_owned())
        .filter(|line| !line.is_empty())
        .collect()
}

/// The text without what moves the cursor.
fn without_colors(text: &str) -> String {
    let mut parts = text.split('\u{1b}');
    let first = parts.next().unwrap_or_default().to_owned();
    let end = |part: &str| part.find(|c: char| c.is_ascii_alphabetic());
    parts.fold(first, |text, part| {
        text + end(part).map_or("", |at| &part[at + 1..])
    })
}

/// Every stage has ended with a full bar, none is longer than a terminal, and their seconds
/// make up all.
fn is_watched(lines: &[String], stages: &[&str]) {
    let ends: Vec<&String> = lines
        .iter()
        .filter(|l| l.contains("████████████ "))
        .collect();
    for (index, stage) in stages.iter().enumerate() {
        let place = format!("{} of {}", index + 1, stages.len());
        let ended = |line: &&String| line.starts_with(stage) && line.contains(&place);
        assert!(ends.iter().any(ended), "{stage}, {place}: {lines:#?}");
    }
    let bars = lines.iter().filter(|line| line.contains(['█', '░']));
    for line in bars.clone() {
        assert!(line.chars().count() <= 80, "{line}");
    }
    assert!(bars.count() >= stages.len());

    let text = lines.join("\n").replace("\n  ", " ");
    let told = text.lines().find_map(|line| {
        let (all, parts) = line.split_once(" s")?;
        Some((all.parse::<f64>().ok()?, parts.trim_start_matches(": ")))
    });
    let (all, parts) = told.unwrap_or_else(|| panic!("no seconds: {text}"));
    let sum: f64 = (parts.split(", "))
        .filter(|part| !part.is_empty())
        .map(|part| {
            let (stage, seconds) = part.rsplit_once(' ').expect("a stage");
            assert!(stages.contains(&stage), "{stage}");
            seconds.parse::<f64>().expect("seconds")
        })
        .sum();
    assert!((sum - all).abs() < 1.0, "{sum} of {all}");
    // It may be explained in one line more.
    let last = &lines[lines.len() - 2..];
    assert!(
        last.iter().any(|line| line.starts_with("next: ")),
        "{lines:#?}"
    );
}

#[test]
fn every_stage_of_every_command_is_seen() {
    let place = Place::new();
    let asset = |name: &str| format!("{}/assets/{name}", env!("CARGO_MANIFEST_DIR"));
    let (scene, teacher) = (asset("demo"), asset("teacher/demo-teacher.onnx"));
    let small = [
        "--preset",
        "draft",
        "--iterations",
        "30",
        "--max-side",
        "64",
        "--max-splats",
        "600",
    ];
    let fit = ["fit", &scene, "-o", "runs/scene"];
    is_watched(
        &shown(&place, &[&fit[..], &small].concat()),
        &[
            "device",
            "model",
            "photos",
            "plan",
            "placing",
            "training",
            "measuring",
            "saving",
        ],
    );
    let taught = ["--teacher", &teacher];
    let colorize = ["colorize", "--rounds", "2", "--sh-degree", "auto"];
    is_watched(
        &shown(&place, &[&colorize[..], &taught].concat()),
        &[
            "device",
            "model",
            "teacher",
            "lists",
            "degree",
            "solving",
            "strength",
            "bake",
            "measuring",
            "saving",
        ],
    );
    let eval = ["eval", "--frames", "31", "--baselines"];
    is_watched(
        &shown(&place, &[&eval[..], &taught].concat()),
        &[
            "model",
            "teacher",
            "device",
            "baseline",
            "measuring",
            "path",
            "views",
            "pairs",
            "strength",
            "page",
        ],
    );
    is_watched(
        &shown(&place, &["render", "-o", "pictures"]),
        &["model", "device", "rendering"],
    );
    is_watched(
        &shown(&place, &["plan", &scene, "--preset", "draft"]),
        &["model", "photos", "plan"],
    );
}

#[test]
fn nothing_is_drawn_where_there_is_no_terminal() {
    let place = place_with_scene();
    let done = place.run(&QUICK_FIT);
    let drawn = |text: &str| text.contains(['█', '░', '\u{1b}', '\r']);
    assert!(
        !drawn(&done.stderr) && !drawn(&done.stdout),
        "{}",
        done.stderr
    );
    // The plan is a table all the same, and no line of escaped ones.
    let rows = done.stderr.lines().filter(|line| line.contains(" off "));
    assert!(rows.count() >= 3, "{}", done.stderr);
}

#[test]
fn the_plan_says_what_to_type_next() {
    let place = place_with_scene();
    let plan = [
        "plan",
        "scene",
        "--preset",
        "draft",
        "--without",
        "exposure",
    ];
    let words = place.succeed(&plan);
    let last = words.lines().last().expect("a line");
    assert_eq!(
        last,
        "next: gs-chroma fit scene --preset draft --without exposure"
    );
    assert!(words.contains("exposure     off ") && words.contains("; set by you"));
}
