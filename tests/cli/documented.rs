//! docs/schemas and docs/run-folder.md describe everything that a run folder holds.

use std::{collections::BTreeSet, fs, path::Path};

use serde_json::{Value, json};

use super::shared::{onnx, place_with_run};

const DOCS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs");

/// The page.
fn page() -> String {
    fs::read_to_string(format!("{DOCS}/run-folder.md")).expect("the page")
}

/// Checks a value against docs/schemas/NAME.schema.json.
pub fn conforms(value: &Value, name: &str) {
    if let Err(fault) = fault(value, name) {
        panic!("{name}.schema.json: {fault}");
    }
}

/// What in a value contradicts a schema, or is not in it.
fn fault(value: &Value, name: &str) -> Result<(), String> {
    let path = format!("{DOCS}/schemas/{name}.schema.json");
    let text = fs::read_to_string(&path).expect("a schema");
    let root: Value = serde_json::from_str(&text).expect("JSON");
    check(value, &root, &root, "")
}

/// The part of JSON Schema that docs/schemas uses; keys that no schema has are faults, too.
fn check(value: &Value, schema: &Value, root: &Value, path: &str) -> Result<(), String> {
    if let Some(link) = schema["$ref"].as_str() {
        let place = link.trim_start_matches('#');
        let mut whole = root.pointer(place).expect("a definition").clone();
        // The tag of a variant is beside the reference to the rest of it.
        if let Some(own) = schema["properties"].as_object() {
            let all = whole["properties"].as_object_mut().expect("an object");
            all.extend(own.clone());
        }
        return check(value, &whole, root, path);
    }
    for key in ["anyOf", "oneOf"] {
        if let Some(all) = schema[key].as_array() {
            let mut faults = vec![];
            for one in all {
                match check(value, one, root, path) {
                    Ok(()) => return Ok(()),
                    Err(fault) => faults.push(fault),
                }
            }
            return Err(faults.join("; or "));
        }
    }
    let types: Vec<&str> = match &schema["type"] {
        Value::Array(all) => all.iter().filter_map(Value::as_str).collect(),
        one => one.as_str().into_iter().collect(),
    };
    let known = |kind: &&str| match *kind {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        other => panic!("{path}: type {other}"),
    };
    if !types.is_empty() && !types.iter().any(known) {
        return Err(format!("{path}: {value} is no {types:?}"));
    }
    let wrong = schema.get("const").is_some_and(|only| only != value)
        || schema["enum"]
            .as_array()
            .is_some_and(|all| !all.contains(value));
    if wrong {
        return Err(format!("{path}: {value}"));
    }
    match value {
        Value::Object(map) if schema["properties"].is_object() => {
            for key in schema["required"].as_array().into_iter().flatten() {
                let key = key.as_str().expect("a key");
                if !map.contains_key(key) {
                    return Err(format!("{path}/{key} is missing"));
                }
            }
            for (key, value) in map {
                let path = format!("{path}/{key}");
                let Some(schema) = schema["properties"].get(key) else {
                    return Err(format!("{path} is not described"));
                };
                check(value, schema, root, &path)?;
            }
        }
        Value::Array(items) => {
            for (index, item) in items.iter().enumerate() {
                let own = schema["prefixItems"].get(index);
                let schema = own.unwrap_or(&schema["items"]);
                check(item, schema, root, &format!("{path}/{index}"))?;
            }
        }
        _ => {}
    }
    Ok(())
}

#[test]
fn a_report_is_as_described() {
    let report = place_with_run().report("runs/scene");
    conforms(&report, "report");
    // And the check can fail.
    let mut faulty = report.clone();
    faulty["luma"]["held_out"]["other"] = json!(1);
    assert!(fault(&faulty, "report").is_err(), "an unknown key");
    faulty = report.clone();
    faulty["capture"]
        .as_object_mut()
        .expect("keys")
        .remove("views");
    assert!(fault(&faulty, "report").is_err(), "a missing key");
    faulty = report.clone();
    faulty["chroma"]["views"][0]["colorfulness"] = json!("much");
    assert!(fault(&faulty, "report").is_err(), "another type");
    faulty = report;
    faulty["preset"] = json!("quick");
    assert!(fault(&faulty, "report").is_err(), "another value");
}

#[test]
fn an_evaluation_is_as_described() {
    let teacher = onnx("ddcolor_tiny.onnx");
    let eval = ["eval", "--frames", "2", "--json"];
    let teacher = ["--teacher", &teacher, "--baselines"];
    let evaluation = place_with_run().json(&[&eval[..], &teacher].concat());
    conforms(&evaluation, "eval");
}

#[test]
fn the_example_is_a_report() {
    let report = place_with_run().report("runs/scene");
    let page = page();
    let (_, example) = page.split_once("```json").expect("an example");
    let (example, _) = example.split_once("```").expect("its end");
    let example: Value = serde_json::from_str(example).expect("JSON");
    assert!(holds(&report, &example), "{example}");
    assert_eq!(example["version"], report["version"]);
}

/// True if a value has all keys of another.
fn holds(value: &Value, shown: &Value) -> bool {
    match shown {
        Value::Object(map) => map
            .iter()
            .all(|(key, shown)| value.get(key).is_some_and(|value| holds(value, shown))),
        Value::Array(items) => items.iter().all(|shown| holds(&value[0], shown)),
        _ => !value.is_object(),
    }
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

#[test]
fn every_limit_names_tests_that_exist() {
    let page = fs::read_to_string(format!("{DOCS}/limits.md")).expect("the page");
    let mut tests = BTreeSet::new();
    for folder in ["src", "tests"] {
        list_tests(
            &Path::new(env!("CARGO_MANIFEST_DIR")).join(folder),
            &mut tests,
        );
    }
    let mut count = 0;
    for row in page.lines().filter(|line| line.starts_with("| ")) {
        let last = row.trim_end_matches(['|', ' ']).rsplit('|').next();
        let last = last.unwrap_or_default().trim();
        if last == "Test" {
            continue;
        }
        let names: Vec<&str> = last.split('`').skip(1).step_by(2).collect();
        assert!(!names.is_empty(), "no test: {row}");
        for name in names {
            assert!(tests.contains(name), "{name}: {row}");
            count += 1;
        }
    }
    assert!(count > 40, "{count}");
}

/// Adds the names of the tests in a folder.
fn list_tests(folder: &Path, tests: &mut BTreeSet<String>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() {
            list_tests(&path, tests);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            let text = fs::read_to_string(&path).expect("a source");
            let after = text.split("#[test]\n").skip(1);
            tests.extend(after.filter_map(|test| {
                let (name, _) = test.split_once("fn ")?.1.split_once('(')?;
                Some(name.to_owned())
            }));
        }
    }
}
