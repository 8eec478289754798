//! The tables of JSON keys in docs/run-folder.md, made from the types that are written.
//!
//! A field's row is the first paragraph of its doc comment: `Meaning, in unit; remark.` An enum's
//! values follow its meaning, and `None` becomes `null`.

use std::{collections::HashSet, fs};

use schemars::{JsonSchema, generate::SchemaSettings};
use serde_json::{Map, Value};

use crate::{
    auto::outcome::Reel,
    prepare::Prepared,
    report::{Evaluation, KernelReport, Report},
    run::Frames,
};

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/run-folder.md");

#[test]
fn tables_are_those_of_the_types() {
    let report = Rows::of::<Report>();
    let tables = [
        (
            "report",
            report.table(|root| !["luma", "chroma"].contains(&root)),
        ),
        ("report.luma", report.table(|root| root == "luma")),
        ("report.chroma", report.table(|root| root == "chroma")),
        ("timings", Rows::of::<KernelReport>().table(|_| true)),
        ("eval", Rows::of::<Evaluation>().table(|_| true)),
        ("frames", Rows::of::<Frames>().table(|_| true)),
        ("prepare", Rows::of::<Prepared>().table(|_| true)),
        ("reel", Rows::of::<Reel>().table(|_| true)),
    ];
    let page = fs::read_to_string(PAGE).expect("the page");
    let wanted = tables.iter().fold(page.clone(), |page, (name, table)| {
        let [begin, end] = ["begin", "end"].map(|place| format!("<!-- {name}: {place} -->"));
        let (before, rest) = page.split_once(&begin).expect("where the table begins");
        let (_, after) = rest.split_once(&end).expect("where it ends");
        [before, &begin, table, &end, after].concat()
    });
    if std::env::var_os("WRITE_DOCS").is_some() {
        fs::write(PAGE, wanted).expect("docs are writable");
    } else {
        let command = "WRITE_DOCS=1 cargo test --lib keys_tests";
        assert!(page == wanted, "{PAGE}: `{command}` writes it anew");
    }
}

/// The rows of a type's fields, and of the fields' own.
#[derive(Default)]
struct Rows {
    rows: Vec<Row>,
    /// The structs that were listed: where, and the schemas of their fields.
    structs: Vec<(String, Map<String, Value>)>,
    /// The enums that were listed: what they can be.
    enums: HashSet<Vec<String>>,
}

struct Row {
    /// Paths such as `luma.seconds.train`.
    keys: Vec<String>,
    unit: String,
    meaning: String,
}

impl Rows {
    fn of<T: JsonSchema>() -> Self {
        let mut settings = SchemaSettings::default().for_serialize();
        settings.inline_subschemas = true;
        let schema = settings.into_generator().into_root_schema_for::<T>();
        let mut rows = Self::default();
        rows.list("", schema.as_value());
        rows
    }

    /// Lists what is below a path. Fields that a struct before has as well share one row.
    fn list(&mut self, path: &str, schema: &Value) {
        let fields = match &objects(schema)[..] {
            [] => return,
            [object] => fields(object),
            variants => return self.rows.push(kinds(path, variants)),
        };
        let shared = |listed: &Map<String, Value>| -> Vec<_> {
            let is_same = |(name, field): &(&String, &Value)| listed.get(*name) == Some(*field);
            fields.iter().copied().filter(is_same).collect()
        };
        // The first of those that share most.
        let (place, shared) = (self.structs.iter().rev())
            .map(|(place, listed)| (place.clone(), shared(listed)))
            .max_by_key(|(_, shared)| shared.len())
            .filter(|(_, shared)| shared.len() > 1)
            .unwrap_or_default();
        if !path.is_empty() {
            let own = fields
                .iter()
                .map(|&(name, field)| (name.clone(), field.clone()));
            self.structs.push((path.to_owned(), own.collect()));
        }
        for &(name, field) in fields.iter().filter(|field| !shared.contains(field)) {
            let path = join(path, name);
            self.field(&path, field);
            self.list(&path, field);
        }
        if !shared.is_empty() {
            self.rows.push(Row {
                keys: keys(path, &shared),
                unit: String::new(),
                meaning: format!("As in `{place}`"),
            });
        }
    }

    /// Lists a field itself.
    fn field(&mut self, path: &str, schema: &Value) {
        let text = schema["description"].as_str().expect("a doc comment");
        let text = text.split("\n\n").next().unwrap_or(text);
        let leads_nowhere = text.contains("[`") || text.contains("](");
        assert!(
            !leads_nowhere,
            "{path}: links belong into a later paragraph"
        );
        let text = text.replace('\n', " ").replace("`None`", "`null`");
        let text = text.trim_end_matches('.');
        let (text, rest) = text.split_at(text.find(';').unwrap_or(text.len()));
        let (meaning, unit) = text.rsplit_once(", in ").unwrap_or((text, ""));
        let values = values(schema);
        let values = match !values.is_empty() && self.enums.insert(values.clone()) {
            true => format!(": {}", either(&values)),
            false => String::new(),
        };
        self.rows.push(Row {
            keys: vec![path.to_owned()],
            unit: unit.to_owned(),
            meaning: [meaning, &values, rest].concat(),
        });
    }

    /// As Markdown, the rows of which the first key of the path belongs there.
    fn table(&self, belongs: impl Fn(&str) -> bool) -> String {
        let root = |row: &&Row| belongs(row.keys[0].split('.').next().unwrap_or_default());
        let rows = self.rows.iter().filter(root).map(|row| {
            let keys: Vec<_> = row.keys.iter().map(|key| format!("`{key}`")).collect();
            format!("| {} | {} | {} |\n", keys.join(" "), row.unit, row.meaning)
        });
        let rows: String = rows.collect();
        let table = format!("\n| Key | Unit | Meaning |\n|---|---|---|\n{rows}");
        table.replace("|  |", "| |")
    }
}

fn join(path: &str, name: &str) -> String {
    format!("{path}.{name}").trim_start_matches('.').to_owned()
}

/// Alternatives of a value, or of an item of a list.
fn alternatives(schema: &Value) -> Vec<&Value> {
    let below = ["anyOf", "oneOf"].map(|key| schema[key].as_array());
    match (below, schema.get("items")) {
        ([Some(all), _] | [_, Some(all)], _) => all.iter().flat_map(alternatives).collect(),
        (_, Some(items)) => alternatives(items),
        _ => vec![schema],
    }
}

/// A struct, or the variants of an enum with data.
fn objects(schema: &Value) -> Vec<&Value> {
    let all = alternatives(schema).into_iter();
    all.filter(|one| one["properties"].is_object()).collect()
}

/// The fields of a struct in their order, which `required` has and `properties` has not; those
/// that are not always written come last.
fn fields(object: &Value) -> Vec<(&String, &Value)> {
    let required: Vec<_> = strings(&object["required"]).collect();
    let mut fields: Vec<_> = object["properties"]
        .as_object()
        .into_iter()
        .flatten()
        .collect();
    let place = |name: &str| required.iter().position(|&required| required == name);
    fields.sort_by_key(|(name, _)| place(name).unwrap_or(required.len()));
    fields
}

fn strings(list: &Value) -> impl Iterator<Item = &str> {
    list.as_array()
        .into_iter()
        .flatten()
        .filter_map(Value::as_str)
}

/// Paths of some fields, and of what is below them.
fn keys(path: &str, some: &[(&String, &Value)]) -> Vec<String> {
    let mut all = vec![];
    for (name, field) in some {
        let path = join(path, name);
        let below = objects(field).into_iter();
        let below: Vec<_> = below
            .flat_map(|object| keys(&path, &fields(object)))
            .collect();
        all.push(path);
        all.extend(below);
    }
    all
}

/// The values of an enum without data.
fn values(schema: &Value) -> Vec<String> {
    let values = alternatives(schema).into_iter().flat_map(|one| {
        one["const"]
            .as_str()
            .into_iter()
            .chain(strings(&one["enum"]))
    });
    values.map(|value| format!("`{value}`")).collect()
}

/// The row of an enum's tag, which is written first: the variants, each with its other keys.
fn kinds(path: &str, variants: &[&Value]) -> Row {
    let of = |variant: &&Value| {
        let fields = fields(variant);
        let kind = fields[0].1["const"].as_str().expect("a tag");
        let others: Vec<_> = (fields[1..].iter())
            .map(|(name, _)| format!("`{name}`"))
            .collect();
        match others.is_empty() {
            true => format!("`{kind}`"),
            false => format!("`{kind}` (with {})", others.join(", ")),
        }
    };
    let kinds: Vec<_> = variants.iter().map(of).collect();
    Row {
        keys: vec![join(path, fields(variants[0])[0].0)],
        unit: String::new(),
        meaning: either(&kinds),
    }
}

/// Several words as a choice.
fn either(words: &[String]) -> String {
    match words {
        [first @ .., last] if !first.is_empty() => format!("{} or {last}", first.join(", ")),
        _ => words.concat(),
    }
}
