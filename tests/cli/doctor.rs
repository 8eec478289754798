//! `doctor` as a user meets it; that a broken device fails is in tests/device/stability.

use super::{hard_cases, program::Place};

#[test]
fn doctor_says_what_the_device_is_and_that_every_case_holds() {
    let words = Place::new().succeed(&["doctor"]);
    let first = words.lines().next().unwrap();
    assert!(first.starts_with("adapter: "), "{first}");
    // Two tables: kernels, then hard cases.
    let tables: Vec<Vec<&str>> = words
        .split("\n\n")
        .map(|part| part.lines().filter(|line| line.starts_with("| ")).collect())
        .filter(|rows: &Vec<&str>| !rows.is_empty())
        .collect();
    let [kernels, cases] = &tables[..] else {
        panic!("{words}");
    };
    for kernel in [
        "project",
        "sort",
        "blend",
        "luma_loss",
        "chroma_loss",
        "adam",
    ] {
        let row = format!("| {kernel} | ");
        assert!(
            kernels.iter().any(|line| line.starts_with(&row)),
            "{kernel}"
        );
    }
    assert!(kernels.len() > 28 && cases.len() > 50);
    for row in kernels[1..].iter().chain(&cases[1..]) {
        assert!(row.ends_with(" holds |"), "{row}");
    }
    if std::env::var_os("WRITE_DOCS").is_some() {
        hard_cases::write();
    }
}

#[test]
fn without_an_adapter_doctor_says_so() {
    let place = Place::new();
    let mut command = place.command(&["doctor"]);
    command.env("WGPU_ADAPTER_NAME", "no such adapter");
    let done = command.output().unwrap();
    assert_eq!(done.status.code(), Some(1));
    let error = String::from_utf8(done.stderr).unwrap();
    assert_eq!(error.lines().count(), 1, "{error}");
    assert!(
        error.contains("no such adapter") && error.contains("choose one"),
        "{error}"
    );
}
