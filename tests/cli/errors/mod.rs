//! Whatever is wrong: one line that says what and what to do, the right exit
//! code, no panic and no file half-written.

mod captures;
mod files;
mod teachers;
mod usage;

use super::program::{Place, files_below};
use super::shared::{onnx, place_with_run};

/// One way to go wrong.
struct Case {
    /// Description of the error, for the test's own messages.
    name: &'static str,
    /// Breaks something in a folder with `scene/`, `runs/scene` and `onnx/`.
    arrange: fn(&Place),
    /// Arguments, separated by blanks.
    command: &'static str,
    /// Environment of the program.
    environment: &'static [(&'static str, &'static str)],
    code: i32,
    /// Words that the line must contain: the file, the field, the remedy.
    words: &'static [&'static str],
}

/// A case that fails with exit code 1 in the usual environment.
const fn case(
    name: &'static str,
    arrange: fn(&Place),
    command: &'static str,
    words: &'static [&'static str],
) -> Case {
    Case {
        name,
        arrange,
        command,
        environment: &[],
        code: 1,
        words,
    }
}

/// Leaves everything as it is.
fn nothing(_: &Place) {}

const FIT: &str = "fit scene --preset draft --iterations 3 -o out";
const COLORIZE: &str = "colorize --teacher onnx/ddcolor_tiny.onnx --solver adam --until 62";

fn check(case: &Case) {
    let place = place_with_run();
    for name in [
        "ddcolor_tiny",
        "deoldify_tiny",
        "truncated",
        "two_inputs",
        "wrong_channels",
        "wrong_rank",
    ] {
        let file = format!("{name}.onnx");
        place.write(
            &format!("onnx/{file}"),
            std::fs::read(onnx(&file)).expect("a fixture"),
        );
    }
    (case.arrange)(&place);
    let before = files_below(&place.path(""));

    let arguments: Vec<&str> = case.command.split(' ').collect();
    let mut command = place.command(&arguments);
    command.envs(case.environment.iter().copied());
    let done = super::program::Done::of(command.output());

    let name = case.name;
    assert_eq!(done.code, Some(case.code), "{name}: {done:?}");
    assert!(!done.stderr.contains("panicked"), "{name}: {done:?}");
    assert_eq!(done.stdout, "", "{name}");
    let mut errors = done
        .stderr
        .lines()
        .filter(|line| line.starts_with("error: "));
    let line = errors
        .next()
        .unwrap_or_else(|| panic!("{name}: no error: {done:?}"));
    assert_eq!(errors.next(), None, "{name}: {done:?}");
    // clap adds a usage; everything else is one line, and the last one.
    if case.code == 1 {
        assert_eq!(done.stderr.lines().last(), Some(line), "{name}: {done:?}");
    }
    let said = if case.code == 1 { line } else { &done.stderr };
    for word in case.words {
        assert!(said.contains(word), "{name}: no {word:?} in: {said}");
    }
    assert!(line.len() < 600 && !line.contains(".tmp"), "{name}: {line}");

    // A teacher's whole answers may stay for the next time.
    let mut after = files_below(&place.path(""));
    after.retain(|file| before.contains(file) || !file.0.ends_with(".npy"));
    let names = |files: &[(String, Vec<u8>)]| -> Vec<String> {
        files.iter().map(|file| file.0.clone()).collect()
    };
    assert_eq!(names(&before), names(&after), "{name}");
    assert!(before == after, "{name}: a file has changed");
}

fn check_all(cases: &[Case]) {
    // All, so that one failure does not hide the others.
    let failures = cases
        .iter()
        .filter(|case| std::panic::catch_unwind(|| check(case)).is_err())
        .map(|case| case.name);
    let failures: Vec<_> = failures.collect();
    assert!(failures.is_empty(), "{failures:?}");
}

#[test]
fn captures_that_cannot_be_trained_on() {
    check_all(captures::CASES);
}

#[test]
fn teachers_that_cannot_teach() {
    check_all(teachers::CASES);
}

#[test]
fn runs_and_files_that_cannot_be_used() {
    check_all(files::CASES);
}

#[test]
fn wrong_usage() {
    check_all(usage::CASES);
}

#[cfg(target_os = "linux")]
#[test]
fn machines_without_a_device() {
    check_all(teachers::DEVICES);
}

#[cfg(target_os = "linux")]
#[test]
fn places_that_cannot_be_written_to() {
    check_all(files::UNWRITABLE);
}
