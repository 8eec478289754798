//! `auto`: everything in one command.

use std::io::{BufRead, BufReader};
use std::process::Stdio;

use super::program::Place;
use super::shared::{onnx, place_with_scene};

/// Names of the steps that were done, not skipped.
fn done(place: &Place, arguments: &[&str]) -> Vec<String> {
    let done = place.run(arguments);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    let steps = done.stderr.lines().filter(|line| line.starts_with("step "));
    let steps: Vec<&str> = steps.collect();
    assert_eq!(steps.len(), 6, "{}", done.stderr);
    let left = steps
        .into_iter()
        .filter(|line| !line.contains("its result is there"));
    left.filter_map(|line| Some(line.rsplit_once(", ")?.1.to_owned()))
        .collect()
}

/// So many steps that are not skipped, of which the last has only begun; what follows is not
/// waited for.
fn begun(place: &Place, arguments: &[&str], count: usize) -> Vec<String> {
    let mut command = place.command(arguments);
    let (command, said) = (command.stdin(Stdio::null()), Stdio::piped());
    let mut child = command.stdout(Stdio::null()).stderr(said).spawn().unwrap();
    let lines = BufReader::new(child.stderr.take().unwrap()).lines();
    let steps = (lines.map(|line| line.expect("text")))
        .filter(|line| line.starts_with("step ") && !line.contains("its result is there"))
        .filter_map(|line| Some(line.rsplit_once(", ")?.1.to_owned()));
    let steps = steps.take(count).collect();
    child.kill().unwrap();
    child.wait().unwrap();
    steps
}

#[test]
fn each_step_is_done_once_and_again_when_what_it_is_made_from_changes() {
    let place = place_with_scene();
    let teacher = onnx("ddcolor_tiny.onnx");
    let auto = [
        "auto",
        "scene",
        "-o",
        "out",
        "--preset",
        "draft",
        // Options of its steps.
        "--channel",
        "g",
        "--memory-limit",
        "900",
        "--teacher",
    ];
    let by = |teacher: &str| -> Vec<String> {
        let words = auto.iter().map(|&word| word.to_owned());
        words.chain([teacher.to_owned()]).collect()
    };
    let first = by(&teacher);
    let first: Vec<&str> = first.iter().map(String::as_str).collect();
    // COLMAP has been through the folder.
    let all = ["fit", "colorize", "frames", "export", "eval"];
    assert_eq!(done(&place, &first), all);
    for file in [
        "out/colored/00.png",
        "out/colored/left/09.png",
        "out/scene.ply",
        "out/run/eval/index.html",
        "out/run/contact-sheet.png",
    ] {
        assert!(place.path(file).is_file(), "{file}");
    }
    let report = place.report("out/run");
    assert_eq!(report["capture"]["channel"], "g");
    let limits = ["luma", "chroma"].map(|stage| report[stage]["settings"]["memory_limit"].clone());
    assert_eq!(limits, [900 << 20; 2]);
    // The folder stands for its run, unless it has one for each shot.
    assert!(place.succeed(&["info", "out"]).contains("out/run"));
    place.succeed(&["export", "out", "-o", "copy.ply"]);
    for shot in ["001", "003"] {
        place.write(
            &format!("film/shots/{shot}/run/report.json"),
            report.to_string(),
        );
    }
    for command in [
        &["info", "film"][..],
        &["export", "film", "-o", "copy.ply"],
        &["fit", "film", "-o", "again"],
    ] {
        let several = place.run(command);
        assert_eq!(several.code, Some(1));
        let runs = ["001", "003"].map(|shot| format!("film/shots/{shot}/run"));
        assert!(
            several.stderr.contains(&runs.join(", ")),
            "{}",
            several.stderr
        );
    }
    let told = place.json(&[&first[..], &["--json"]].concat());
    for (key, value) in [
        ("colored", "out/colored"),
        ("scene", "out/scene.ply"),
        ("house", "scene"),
    ] {
        assert_eq!(told[key], value);
    }
    assert_eq!(done(&place, &first), [""; 0]);
    let unmeasured = place.json(&[&first[..], &["--no-eval", "--json"]].concat());
    assert!(unmeasured["page"].is_null() && told["page"].is_string());
    std::fs::remove_file(place.path("out/scene.ply")).expect("a file");
    assert_eq!(done(&place, &first), ["export"]);
    // Another teacher leaves the gray scene; nothing that it colored is left.
    let second = by(&onnx("siggraph17_tiny.onnx"));
    let second: Vec<&str> = second.iter().map(String::as_str).collect();
    let luma = place.read("out/run/luma.ply");
    assert_eq!(begun(&place, &second, 2), all[1..3]);
    assert!(place.read("out/run/luma.ply") == luma);
    // Nor does another option leave the gray scene.
    assert_eq!(
        begun(&place, &[&second[..], &["--seed", "1"]].concat(), 1),
        all[..1]
    );
    // A photo that has changed leaves nothing.
    super::scene::photo(2)
        .save(place.path("scene/images/03.png"))
        .expect("writable");
    assert_eq!(begun(&place, &second, 1), all[..1]);
}

#[test]
fn what_stops_it_is_one_line() {
    let place = place_with_scene();
    let done = place.run(&["auto", "nowhere", "-o", "out", "--teacher", "photos"]);
    assert_eq!(done.code, Some(1));
    let errors = done
        .stderr
        .lines()
        .filter(|line| line.starts_with("error: "));
    assert_eq!(errors.count(), 1, "{}", done.stderr);
    assert!(done.stderr.contains("nowhere"), "{}", done.stderr);
    // A teacher that is not there is told before anything is trained.
    let done = place.run(&["auto", "scene", "-o", "out", "--teacher", "nobody.onnx"]);
    assert_eq!(done.code, Some(1));
    assert!(done.stderr.contains("nobody.onnx"), "{}", done.stderr);
    assert!(!place.path("out/run/luma.ply").exists());
}
