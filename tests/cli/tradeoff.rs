//! `tradeoff`: a sweep of tiny runs.

use std::collections::BTreeSet;
use std::fs;
use std::process::Stdio;
use std::thread;
use std::time::{Duration, Instant};

use serde_json::Value;

use super::documented::conforms;
use super::program::Place;
use super::shared::{onnx, place_with_scene};

/// A sweep of `scene/` into `out/` whose points take a second or two.
const QUICK: [&str; 9] = [
    "tradeoff", "scene", "-o", "out", "--preset", "draft", "--budget", "5", "--json",
];

/// Options of every `fit` of it.
const FIT: [&str; 5] = ["--", "--iterations", "40", "--without", "background"];

fn sweep_in(place: &Place) -> Value {
    serde_json::from_slice(&place.read("out/tradeoff.json")).expect("JSON")
}

fn points(sweep: &Value) -> &[Value] {
    sweep["points"].as_array().expect("points")
}

/// Names of the points that ran, and not of those on their way.
fn names(sweep: &Value) -> Vec<&str> {
    let ran = points(sweep)
        .iter()
        .filter(|point| point["after"].is_null());
    let names = ran.map(|point| point["name"].as_str());
    names.map(|name| name.expect("a name")).collect()
}

#[test]
fn a_sweep_in_gray_and_color() {
    let place = place_with_scene();
    let teacher = onnx("ddcolor_tiny.onnx");
    let knobs = ["--knobs", "iterations,teacher-size"];
    let asked = [&QUICK[..], &["--teacher", &teacher], &knobs, &FIT].concat();
    let sweep = place.json(&asked);
    assert_eq!(sweep, sweep_in(&place));
    let names = names(&sweep);
    assert_eq!(names[..2], ["base", "color"]);
    for name in ["iterations-80", "teacher-size-16", "teacher-size-48"] {
        assert!(names.contains(&name), "{names:?}");
    }
    assert_eq!(names.iter().collect::<BTreeSet<_>>().len(), names.len());

    for point in points(&sweep)
        .iter()
        .filter(|point| point["after"].is_null())
    {
        let [name, outcome] = [&point["name"], &point["outcome"]];
        // The network sees 32 pixels and no other size: the sweep went on after that.
        let impossible = name.as_str().expect("a name").contains("teacher-size");
        assert_eq!(outcome.is_null(), impossible, "{point}");
        let reason = point["failed"].as_str().unwrap_or_default();
        assert_eq!(reason.contains("--teacher-size"), impossible, "{point}");
        if impossible {
            continue;
        }
        let run = format!("out/points/{}", name.as_str().expect("a name"));
        let report = place.report(&run);
        assert_eq!(outcome["psnr"], report["luma"]["held_out"]["psnr"]);
        assert_eq!(outcome["iterations"], report["luma"]["iterations"]);
        assert_eq!(
            outcome["delta_e"],
            report["chroma"]["pictures"]["delta_e"]["mean"]
        );
        assert_eq!(outcome["consistency"].is_null(), point["stage"] == "luma");
        let seconds = outcome["seconds"].as_f64().expect("seconds");
        assert!(seconds > outcome["teacher_seconds"].as_f64().expect("seconds"));
        assert!(
            place
                .path("out")
                .join(point["picture"].as_str().expect("a picture"))
                .is_file()
        );
    }
    what_is_on_the_way(&place, &sweep);
    what_the_files_hold(&place, &sweep);
    conforms(&sweep, "tradeoff");

    // All is done: the same again runs nothing, and prints the front.
    let done = place.read("out/tradeoff.json");
    let again: Vec<&str> = asked.into_iter().filter(|word| *word != "--json").collect();
    let printed = place.succeed(&again);
    // Which points are the best depends on how long they took.
    assert!(
        printed.contains("| point ") && printed.contains("tradeoff.html"),
        "{printed}"
    );
    assert!(place.read("out/tradeoff.json") == done);
    // Another subject is refused.
    let done = place.run(&[&QUICK[..], &FIT, &["--channel", "r"]].concat());
    assert_eq!(done.code, Some(1));
    assert!(
        done.stderr.contains("teacher") && done.stderr.contains("-o"),
        "{}",
        done.stderr
    );
}

/// What the bases had reached before their end: held-out PSNR with a picture, and losses.
fn what_is_on_the_way(place: &Place, sweep: &Value) {
    let find = |name: &str| points(sweep).iter().find(|point| point["name"] == name);
    let [base, look] = ["base", "base+after-25"].map(|name| find(name).expect(name));
    let curve = &place.report("out/points/base")["luma"]["curve"];
    assert_eq!(curve[0]["iteration"], 25);
    let rise = |at: &Value, end: &Value| end.as_f64().expect("dB") - at.as_f64().expect("dB");
    let found = rise(&look["outcome"]["psnr"], &base["outcome"]["psnr"]);
    let known = rise(&curve[0]["psnr"], &curve[1]["psnr"]);
    assert!((found - known).abs() < 1e-9, "{found} {known}");
    assert_eq!(look["picture"], "points/base/album/25.png");
    assert!(place.path("out/points/base/album/25.png").is_file());
    let first = find("color+after-1").expect("a round");
    let losses = [first, find("color").expect("a base")].map(|p| p["outcome"]["loss"].as_f64());
    assert!(losses[0] > losses[1], "{losses:?}");
    for point in [look, first] {
        let base = if point["stage"] == "luma" {
            base
        } else {
            find("color").expect("a base")
        };
        let seconds = [point, base].map(|p| p["outcome"]["seconds"].as_f64().expect("seconds"));
        assert!(0.0 < seconds[0] && seconds[0] < seconds[1], "{seconds:?}");
        assert_eq!(point["took"], 0.0);
    }
}

fn what_the_files_hold(place: &Place, sweep: &Value) {
    let html = String::from_utf8(place.read("out/tradeoff.html")).expect("text");
    for name in names(sweep) {
        assert!(html.contains(&format!("points/{name} ")), "{name}");
    }
    // PSNR and SSIM of luma; four measures of color.
    assert_eq!(html.matches("<svg ").count(), 6);
    let pictures = points(sweep)
        .iter()
        .filter(|point| !point["picture"].is_null());
    assert_eq!(html.matches("<img ").count(), pictures.count());
    assert!(html.len() < 100_000 && !html.contains("<script"));
}

#[test]
fn a_sweep_that_was_killed_goes_on() {
    let place = place_with_scene();
    let knobs = ["--knobs", "iterations"];
    let arguments = [&QUICK[..], &knobs, &FIT, &["--max-splats", "60"]].concat();
    let mut command = place.command(&arguments);
    command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    let mut child = command.spawn().expect("the program starts");
    let begun = Instant::now();
    while !place.path("out/tradeoff.json").exists() {
        assert!(begun.elapsed() < Duration::from_secs(60), "no point");
        thread::sleep(Duration::from_millis(20));
    }
    // In the middle of the next point.
    thread::sleep(Duration::from_millis(300));
    child.kill().expect("killed");
    child.wait().expect("gone");
    let before = sweep_in(&place);
    assert!(names(&before).len() < 3, "too late");
    #[cfg(target_os = "linux")]
    nobody_works_in(&place.path("out"));

    let stderr = place.run(&arguments).stderr;
    let after = sweep_in(&place);
    assert_eq!(names(&after), ["base", "iterations-80", "iterations-160"]);
    assert_eq!(points(&after)[..points(&before).len()], points(&before)[..]);
    for point in points(&after)
        .iter()
        .filter(|point| point["after"].is_null())
    {
        assert_eq!(point["outcome"]["splats"], 60, "{point}");
    }
    for name in names(&before) {
        assert!(!stderr.contains(&format!("{name}: ")), "{stderr}");
    }
}

/// The point that was running ends with its sweep.
#[cfg(target_os = "linux")]
fn nobody_works_in(folder: &std::path::Path) {
    let folder = folder.to_string_lossy().into_owned();
    let working = || {
        let processes = fs::read_dir("/proc").expect("processes").flatten();
        let commands = processes.filter_map(|p| fs::read(p.path().join("cmdline")).ok());
        let commands: Vec<_> = commands
            .map(|c| String::from_utf8_lossy(&c).into_owned())
            .collect();
        commands.iter().any(|command| command.contains(&folder))
    };
    let begun = Instant::now();
    while working() {
        assert!(begun.elapsed() < Duration::from_secs(5), "a point goes on");
        thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_base_that_fails_ends_the_sweep() {
    let place = place_with_scene();
    let teacher = onnx("wrong_rank.onnx");
    let done = place.run(&[&QUICK[..], &["--teacher", &teacher], &FIT].concat());
    assert_eq!(done.code, Some(1), "{}", done.stderr);
    let last = done.stderr.lines().last().expect("a line");
    assert!(last.starts_with("error: color, which all"), "{last}");
    assert!(last.contains("wrong_rank.onnx"), "{last}");
}
