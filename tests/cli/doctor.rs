//! `doctor` as a user meets it; that a broken device fails is in tests/stability.

use super::program::Place;

#[test]
fn doctor_says_what_the_device_is_and_that_every_case_holds() {
    let diagnosis = Place::new().json(&["doctor", "--json"]);
    assert!(!diagnosis["adapter"].as_str().unwrap().is_empty());
    assert!(diagnosis["max_binding_bytes"].as_u64().unwrap() >= 1 << 27);
    let kernels = diagnosis["kernels"].as_array().unwrap();
    for kernel in [
        "project",
        "sort",
        "blend",
        "luma_loss",
        "chroma_loss",
        "adam",
    ] {
        assert!(
            kernels.iter().any(|row| row["kernel"] == kernel),
            "{kernel}"
        );
    }
    for row in kernels {
        assert!(row["failures"].as_array().unwrap().is_empty(), "{row}");
    }
    let cases = diagnosis["cases"].as_array().unwrap();
    assert!(cases.len() >= 50);
    for case in cases {
        assert!(case["failure"].is_null(), "{case}");
        let [error, bound] = ["gradient_error", "gradient_bound"].map(|key| case[key].as_f64());
        assert!(error.unwrap() <= bound.unwrap(), "{case}");
    }
}

#[test]
fn doctor_in_words() {
    let words = Place::new().succeed(&["doctor"]);
    let first = words.lines().next().unwrap();
    assert!(first.starts_with("adapter: "), "{first}");
    assert!(
        words.contains("| needle | ") && words.contains("| sort | ") && words.contains(" holds |")
    );
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
