//! Networks that `fit` asks while it trains.

use super::program::{Done, Place};
use super::shared::{QUICK_FIT, onnx, place_with_scene};

/// Enough iterations for a small network to be done before.
const ITERATIONS: [&str; 2] = ["--iterations", "60"];

fn fitted(place: &Place, run: &str, more: &[&str]) -> Done {
    let draft = &QUICK_FIT[..4];
    place.run(
        &[
            draft,
            &ITERATIONS,
            &["--without", "background", "-o", run],
            more,
        ]
        .concat(),
    )
}

/// The answers that a run has of its teachers.
fn answers(place: &Place, run: &str) -> Vec<String> {
    let files = place.files(run).into_iter();
    files.filter(|name| name.starts_with("teacher/")).collect()
}

/// How many answers `fit` says it has.
fn told(done: &Done) -> Option<usize> {
    let (_, rest) = done.stderr.split_once("asked ahead: ")?;
    rest.split(' ').next()?.parse().ok()
}

#[test]
fn what_was_asked_ahead_changes_nothing_but_the_wait() {
    let place = place_with_scene();
    let network = onnx("ddcolor_tiny.onnx");
    let ahead = fitted(&place, "ahead", &["--teacher", &network]);
    assert_eq!(ahead.code, Some(0), "{}", ahead.stderr);
    let kept = answers(&place, "ahead");
    assert_eq!(told(&ahead), Some(kept.len()), "{}", ahead.stderr);
    assert!(!kept.is_empty(), "{}", ahead.stderr);

    let alone = fitted(&place, "alone", &[]);
    assert!(told(&alone).is_none() && answers(&place, "alone").is_empty());
    let colorize = ["--rounds", "2", "--teacher", &network];
    for run in ["ahead", "alone"] {
        place.succeed(&[&["colorize", run], &colorize[..]].concat());
    }
    // The same photos were asked about in the same way.
    assert_eq!(answers(&place, "ahead"), answers(&place, "alone"));
    assert!(
        kept.iter()
            .all(|name| answers(&place, "alone").contains(name))
    );
    for file in ["luma.ply", "color.ply"] {
        let of = |run| place.read(&format!("{run}/{file}"));
        assert!(of("ahead") == of("alone"), "{file}");
    }
}

#[test]
fn a_teacher_that_is_none_is_told_before_training() {
    let place = place_with_scene();
    let network = onnx("ddcolor_tiny.onnx");
    for (options, part) in [
        (&["--teacher", "missing.onnx"][..], "missing.onnx"),
        (&["--teacher", "scene/sparse/0/cameras.bin"], "cameras.bin"),
        (
            &["--teacher", &network, "--teacher-profile", "siggraph17"],
            "no known colorization network",
        ),
    ] {
        let done = fitted(&place, "none", options);
        assert_eq!(done.code, Some(1), "{options:?}: {}", done.stderr);
        assert!(done.stderr.contains(part), "{options:?}: {}", done.stderr);
        assert!(!place.path("none/luma.ply").exists(), "{options:?}");
    }
    let done = fitted(&place, "none", &["--teacher-size", "64"]);
    assert_eq!(done.code, Some(2), "{}", done.stderr);
}

#[test]
fn a_network_that_fails_does_not_stop_the_training() {
    let place = place_with_scene();
    let network = onnx("ddcolor_tiny.onnx");
    fitted(&place, "good", &["--teacher", &network]);
    // Where an answer belongs is something else already.
    for name in answers(&place, "good") {
        let blocked = place.path("bad").join(name);
        std::fs::create_dir_all(blocked).expect("writable");
    }
    let done = fitted(&place, "bad", &["--teacher", &network]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(told(&done).is_none(), "{}", done.stderr);
    assert!(
        done.stderr.contains("asked ahead: ") && done.stderr.contains(".npy"),
        "{}",
        done.stderr
    );
    assert!(place.path("bad/luma.ply").exists());

    // Nothing is asked of a folder.
    let done = fitted(&place, "folder", &["--teacher", "scene/images"]);
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(!done.stderr.contains("asked ahead"), "{}", done.stderr);
}
