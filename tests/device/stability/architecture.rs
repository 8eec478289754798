//! Imports go down only.

use std::{collections::BTreeSet, fs, path::Path};

use super::literals::{literals, without_tests};

/// The folders and files right below `src`, from top to bottom. What stands on one floor
/// does not know each other.
const FLOORS: [&[&str]; 15] = [
    &["cli"],
    &["auto", "paint", "studio"],
    &["tradeoff", "view"],
    &["run", "prepare"],
    &["subject"],
    &["store"],
    &["tell"],
    &["eval", "frames", "viewers", "blocks"],
    &["report", "doctor"],
    &["luma", "chroma"],
    &["effects", "measure", "trajectory"],
    &["raster"],
    &["capture", "splats"],
    &[
        "gpu", "color", "sections", "download", "npy", "programs", "archive", "oracle", "compare",
    ],
    &["disk", "hash", "input", "invocation"],
];

fn floor(name: &str) -> Option<usize> {
    FLOORS.iter().position(|floor| floor.contains(&name))
}

fn source(path: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
    fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Every Rust file at `path` or below.
fn rust_files(path: &Path, found: &mut Vec<String>) {
    if path.is_dir() {
        for entry in fs::read_dir(path).expect("a folder") {
            rust_files(&entry.expect("an entry").path(), found);
        }
    } else if path.extension().is_some_and(|extension| extension == "rs") {
        found.push(fs::read_to_string(path).expect("a source file"));
    }
}

fn word(text: &str) -> &str {
    let end = text.find(|c: char| !c.is_alphanumeric() && c != '_');
    &text[..end.unwrap_or(text.len())]
}

/// Names after `crate::` in code: one name, or the first names of a list in braces.
fn imports(text: &str) -> BTreeSet<String> {
    let lines = text
        .lines()
        .map(|line| line.split("//").next().unwrap_or(""));
    let code: String = lines.collect::<Vec<_>>().join("\n");
    let mut found = BTreeSet::new();
    for (start, _) in code.match_indices("crate::") {
        let rest = &code[start + "crate::".len()..];
        let Some(list) = rest.strip_prefix('{') else {
            found.insert(word(rest).to_owned());
            continue;
        };
        let mut depth = 0;
        let mut begins = true;
        for (place, c) in list.char_indices() {
            match c {
                '{' => depth += 1,
                '}' if depth == 0 => break,
                '}' => depth -= 1,
                ',' if depth == 0 => begins = true,
                _ if begins && !c.is_whitespace() => {
                    found.insert(word(&list[place..]).to_owned());
                    begins = false;
                }
                _ => {}
            }
        }
    }
    found
}

#[test]
fn imports_are_found() {
    let text = "use crate::{a::{b, c}, d}; // crate::no\nfn f(x: crate::e::F) {}\nuse crate::g::h;";
    let expected = ["a", "d", "e", "g"].map(str::to_owned);
    assert_eq!(imports(text), BTreeSet::from(expected));
}

#[test]
fn imports_go_down_only() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut wrong = Vec::new();
    for entry in fs::read_dir(&root).expect("src") {
        let path = entry.expect("an entry").path();
        let name = path
            .file_stem()
            .and_then(|name| name.to_str())
            .expect("a name");
        if ["lib", "main"].contains(&name) {
            continue;
        }
        let own = floor(name).unwrap_or_else(|| panic!("{name} stands on no floor"));
        let mut files = Vec::new();
        rust_files(&path, &mut files);
        for other in files.iter().flat_map(|text| imports(text)) {
            if other != name && floor(&other).is_some_and(|other| other <= own) {
                wrong.push(format!("{name} imports {other}"));
            }
        }
    }
    wrong.sort();
    wrong.dedup();
    assert!(wrong.is_empty(), "{wrong:?}");
}

/// The oracle judges production code, which must not depend on it.
#[test]
fn only_the_doctor_asks_the_oracle() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    for entry in fs::read_dir(&root).expect("src") {
        let path = entry.expect("an entry").path();
        let name = path.file_stem().expect("a name").to_string_lossy();
        // The crate's root hands it to tests.
        if ["oracle", "doctor", "compare", "lib"].contains(&&*name) {
            continue;
        }
        let mut files = Vec::new();
        rust_files(&path, &mut files);
        for text in files {
            let code = without_tests(&text);
            assert!(!imports(code).contains("oracle"), "{name}: {text}");
        }
    }
}

/// Functions that read or write files, by any name.
const ACCESS: [&str; 11] = [
    "File::open",
    "File::create",
    "OpenOptions",
    "fs::read(",
    "fs::read_to_string",
    "fs::write",
    "fs::rename",
    "fs::remove",
    "fs::create_dir",
    "tempfile::",
    "image::open",
];

/// So that pipes are refused everywhere, and every write can be made to fail.
#[test]
fn files_are_read_and_written_in_one_place() {
    fn look(path: &Path, found: &mut Vec<String>) {
        let name = path.to_string_lossy();
        if path.is_dir() {
            for entry in fs::read_dir(path).expect("a folder") {
                look(&entry.expect("an entry").path(), found);
            }
            return;
        }
        let may = ["src/disk.rs", "src/input.rs", "tests.rs", "fixtures.rs"];
        if may.iter().any(|end| name.ends_with(end)) {
            return;
        }
        let text = fs::read_to_string(path).expect("a source file");
        let code = without_tests(&text).replace("use tempfile::", "use ");
        let used = ACCESS.iter().filter(|access| code.contains(**access));
        found.extend(used.map(|access| format!("{name}: {access}")));
    }
    let mut found = Vec::new();
    look(
        &Path::new(env!("CARGO_MANIFEST_DIR")).join("src"),
        &mut found,
    );
    assert!(found.is_empty(), "{found:?}");
}

#[test]
fn literals_are_found() {
    let text = r##"f("a\"b", 'c', '"', "//d"); // "e
        g(r#"h"i"#); #[cfg(test)]
mod j;
#[cfg(test)]
mod tests {
    k("l");
}"##;
    assert_eq!(literals(without_tests(text)), [r#"a\"b"#, "//d", r#"h"i"#]);
}

/// Returns true if words name an option of the program: those of COLMAP have underscores, and
/// a word alone is an argument of another program.
fn names_option(words: &str) -> bool {
    let options = words.match_indices("--").map(|(at, _)| {
        let end = words[at..].find(|c: char| !(c.is_alphanumeric() || "-_".contains(c)));
        &words[at + 2..end.map_or(words.len(), |end| at + end)]
    });
    let mut own = options.filter(|option| !option.contains('_'));
    words.contains(' ') && own.any(|option| option.starts_with(|c: char| c.is_ascii_lowercase()))
}

/// Remedies of the command line are its own: `cli/remedy.rs` adds them.
#[test]
fn words_below_the_command_line_name_no_options() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut wrong = Vec::new();
    for entry in fs::read_dir(&root).expect("src") {
        let path = entry.expect("an entry").path();
        let name = path.file_stem().expect("a name").to_string_lossy();
        if ["cli", "auto", "tradeoff"].contains(&&*name) {
            continue;
        }
        let mut files = Vec::new();
        rust_files(&path, &mut files);
        let words = files.iter().flat_map(|text| literals(without_tests(text)));
        wrong.extend(words.filter(|words| names_option(words)).map(str::to_owned));
    }
    assert!(wrong.is_empty(), "{wrong:?}");
}

#[test]
fn the_floors_are_drawn_as_they_are() {
    let floors = FLOORS.map(|floor| floor.join(", ")).join(" → ");
    for file in ["docs/architecture.md", "src/lib.rs"] {
        let text = source(file).replace("//!", "");
        let words: Vec<&str> = text.split_whitespace().collect();
        assert!(words.join(" ").contains(&floors), "{file}: not {floors}");
    }
}
