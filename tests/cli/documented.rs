//! docs/run-folder.md names everything that a run folder holds.

use std::collections::BTreeSet;

use serde_json::Value;

use super::shared::{onnx, place_with_run};

/// The page.
pub fn page() -> String {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/run-folder.md");
    std::fs::read_to_string(path).expect("the page")
}

/// Paths of all keys, such as `luma.seconds.train`; of a list, those of its items.
fn collect_keys(value: &Value, path: &str, keys: &mut BTreeSet<String>) {
    match value {
        Value::Object(map) => {
            for (name, value) in map {
                let path = if path.is_empty() {
                    name.clone()
                } else {
                    format!("{path}.{name}")
                };
                collect_keys(value, &path, keys);
                keys.insert(path);
            }
        }
        Value::Array(items) => items.iter().for_each(|item| collect_keys(item, path, keys)),
        _ => {}
    }
}

#[test]
fn every_key_of_a_report_and_no_other() {
    let report = place_with_run().report("runs/scene");
    are_documented(&report, "## report.json");
}

#[test]
fn every_key_of_an_evaluation_and_no_other() {
    let teacher = onnx("ddcolor_tiny.onnx");
    let eval = ["eval", "--frames", "2", "--json"];
    let teacher = ["--teacher", &teacher, "--baselines"];
    let evaluation = place_with_run().json(&[&eval[..], &teacher].concat());
    are_documented(&evaluation, "## eval.json");
}

/// Checks that the tables of a section of the page name the keys of a value and no other, but for
/// those of items of an empty list.
fn are_documented(value: &Value, section: &str) {
    let keys = keys(value);
    assert!(keys.len() > 50, "{keys:?}");
    let mut documented = documented(&page(), section);
    // No photo shows a frame of the path.
    documented.retain(|key| !key.starts_with("path.pictures.delta_e."));
    documented.retain(|key| {
        let list = key.rsplit_once('.').map_or("", |(list, _)| list);
        let list = value.pointer(&format!("/{}", list.replace('.', "/")));
        list.and_then(Value::as_array)
            .is_none_or(|list| !list.is_empty())
    });
    assert_eq!(documented, keys);
}

/// Paths of all keys of a value.
pub fn keys(value: &Value) -> BTreeSet<String> {
    let mut keys = BTreeSet::new();
    collect_keys(value, "", &mut keys);
    keys
}

/// Keys in the tables of a section of a page.
pub fn documented(page: &str, section: &str) -> BTreeSet<String> {
    // Rows of tables whose first cell is one or more paths.
    let (_, section) = page.split_once(section).expect("the section");
    let (section, _) = section.split_once("\n## ").unwrap_or((section, ""));
    section
        .lines()
        .filter_map(|line| line.strip_prefix("| `")?.split('|').next())
        .flat_map(|cell| cell.split('`').step_by(2))
        .filter(|path| !path.trim().is_empty())
        .map(str::to_owned)
        .collect()
}

#[test]
fn the_example_is_a_report() {
    let report = place_with_run().report("runs/scene");
    let page = page();
    let (_, example) = page.split_once("```json").expect("an example");
    let (example, _) = example.split_once("```").expect("its end");
    let example: Value = serde_json::from_str(example).expect("JSON");
    let (mut real, mut shown) = (BTreeSet::new(), BTreeSet::new());
    collect_keys(&report, "", &mut real);
    collect_keys(&example, "", &mut shown);
    assert!(shown.len() > 20 && shown.is_subset(&real), "{shown:?}");
    assert_eq!(example["version"], report["version"]);
}

#[test]
fn every_file_and_every_column() {
    let place = place_with_run();
    place.succeed(&["eval", "--frames", "2"]);
    let page = page();
    for name in place.files("runs/scene") {
        let name = name
            .split_once('/')
            .map_or(name.clone(), |(folder, _)| format!("{folder}/"));
        assert!(page.contains(&format!("`{name}`")), "{name}");
    }
    let log = String::from_utf8(place.read("runs/scene/log.csv")).expect("text");
    for column in log.lines().next().expect("a header").split(',') {
        assert!(page.contains(&format!("`{column}`")), "{column}");
    }
}
