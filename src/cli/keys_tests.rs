//! The JSON Schema files in docs/schemas, made from the types that are written.

use std::{collections::BTreeSet, fs, path::Path};

use schemars::{JsonSchema, generate::SchemaSettings};
use serde_json::Value;

use crate::{
    auto::{Results, outcome::Reel},
    prepare::Prepared,
    report::{Evaluation, Report},
    run::{ChangeReport, Exported, Frames},
    tradeoff::Tradeoff,
};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/schemas");

#[test]
fn schemas_are_those_of_the_types() {
    let schemas = [
        ("report", of::<Report>()),
        ("eval", of::<Evaluation>()),
        ("frames", of::<Frames>()),
        ("changes", of::<ChangeReport>()),
        ("prepare", of::<Prepared>()),
        ("auto", of::<Results>()),
        ("reel", of::<Reel>()),
        ("export", of::<Exported>()),
        ("tradeoff", of::<Tradeoff>()),
    ];
    let folder = Path::new(FOLDER);
    let names = schemas.each_ref().map(|(name, _)| file_name(name));
    for (name, (_, schema)) in names.iter().zip(&schemas) {
        let (path, wanted) = (folder.join(name), format!("{schema:#}\n"));
        if std::env::var_os("WRITE_DOCS").is_some() {
            fs::write(&path, wanted).expect("docs are writable");
        } else {
            let written = fs::read_to_string(&path).unwrap_or_default();
            let command = "WRITE_DOCS=1 cargo test --lib keys_tests";
            assert!(written == wanted, "{name}: `{command}` writes it anew");
        }
    }
    let found: BTreeSet<String> = fs::read_dir(folder)
        .expect("the folder")
        .map(|entry| entry.expect("a file").file_name().to_string_lossy().into())
        .collect();
    assert_eq!(found, BTreeSet::from(names));
}

fn file_name(name: &str) -> String {
    format!("{name}.schema.json")
}

/// The schema of a type as it is written.
fn of<T: JsonSchema>() -> Value {
    let settings = SchemaSettings::draft2020_12().for_serialize();
    let schema = settings.into_generator().into_root_schema_for::<T>();
    let mut schema = schema.to_value();
    describe(&mut schema, "");
    schema
}

/// Makes descriptions of doc comments; each key must have one, here or at its type.
fn describe(schema: &mut Value, place: &str) {
    match schema {
        Value::Object(map) => {
            if let Some(Value::String(text)) = map.get_mut("description") {
                *text = plain(text);
            }
            for (name, value) in map {
                let place = format!("{place}/{name}");
                if place.rsplit('/').nth(1) == Some("properties") {
                    let known = ["description", "const"]
                        .iter()
                        .any(|key| value.get(key).is_some());
                    assert!(known, "{place}: no doc comment");
                }
                describe(value, &place);
            }
        }
        Value::Array(items) => items.iter_mut().for_each(|item| describe(item, place)),
        _ => {}
    }
}

/// A doc comment in one paragraph, without links into the source.
fn plain(text: &str) -> String {
    let paragraphs = text.split("\n\n").filter(|part| !part.contains("[`"));
    let text = paragraphs.collect::<Vec<_>>().join(" ");
    let mut pieces = text.split("](");
    let mut plain = pieces.next().unwrap_or_default().to_owned();
    for piece in pieces {
        let begin = plain.rfind('[').expect("a link");
        plain.remove(begin);
        plain += piece.split_once(')').expect("its end").1;
    }
    plain.replace('\n', " ").replace("`None`", "`null`")
}
