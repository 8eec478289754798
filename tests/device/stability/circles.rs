//! No circles inside a folder: of two files at most one needs the other, directly or through more.
//! What counts is the file that defines a name, not the `mod.rs` that passes it on.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::Path,
};

use super::literals::without_tests;

/// `clap` tells how a command is used from the description of the whole program, which holds all
/// commands; these refuse options that do not go together, or take options of those that do.
const CIRCLES: [&str; 9] = [
    "cli",
    "cli/auto",
    "cli/colorize",
    "cli/effects",
    "cli/fit",
    "cli/plan",
    "cli/prepare",
    "cli/render",
    "cli/usage",
];

/// Names from the crate's root on.
type Names = Vec<String>;

#[derive(Default)]
struct Module {
    /// Imports, by their local name; glob imports of a module by `*` and a number.
    imports: BTreeMap<String, Names>,
    defined: BTreeSet<String>,
    /// Paths in its code as they stand there.
    paths: BTreeSet<Names>,
}

/// Words, `::` and all other signs, without comments and tests.
fn tokens(text: &str) -> Vec<&str> {
    let code = without_tests(text);
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    let mut tokens = Vec::new();
    for line in code.lines() {
        let mut rest = line.split("//").next().unwrap_or_default().trim_start();
        while let Some(first) = rest.chars().next() {
            let length = match rest.find(|c| !is_word(c)).unwrap_or(rest.len()) {
                0 if rest.starts_with("::") => 2,
                0 => first.len_utf8(),
                word => word,
            };
            tokens.push(&rest[..length]);
            rest = rest[length..].trim_start();
        }
    }
    tokens
}

/// The paths of a tree of imports, by name; gives how many tokens it has.
fn imported(tokens: &[&str], before: &[&str], found: &mut Vec<(String, Vec<String>)>) -> usize {
    let mut path = before.to_vec();
    let mut at = 0;
    loop {
        match tokens[at] {
            "{" => {
                while tokens[at] != "}" {
                    at += 1;
                    if tokens[at] != "}" {
                        at += imported(&tokens[at..], &path, found);
                    }
                }
                return at + 1;
            }
            "," | "}" | ";" => break,
            "as" => {
                let owned = path.iter().map(|name| (*name).to_owned()).collect();
                found.push((tokens[at + 1].to_owned(), owned));
                return at + 2;
            }
            "::" => {}
            "self" if !path.is_empty() => {}
            name => path.push(name),
        }
        at += 1;
    }
    let name = match path.last() {
        Some(&"*") => format!("*{}", found.len()),
        name => name.copied().unwrap_or_default().to_owned(),
    };
    let owned = path.iter().map(|name| (*name).to_owned()).collect();
    found.push((name, owned));
    at
}

fn module(text: &str) -> Module {
    const DEFINING: [&str; 8] = [
        "fn", "struct", "enum", "trait", "type", "const", "static", "union",
    ];
    let tokens = tokens(text);
    let mut module = Module::default();
    let mut found = Vec::new();
    let (mut at, mut depth) = (0, 0);
    while at < tokens.len() {
        let before = if at > 0 { tokens[at - 1] } else { "" };
        match tokens[at] {
            "{" => depth += 1,
            "}" => depth -= 1,
            "use" => at += imported(&tokens[at + 1..], &[], &mut found),
            name if DEFINING.contains(&before) => {
                let outside = depth == 0;
                module.defined.extend(outside.then(|| name.to_owned()));
            }
            name if name.starts_with(char::is_alphabetic) => {
                let mut path = vec![name.to_owned()];
                while tokens.get(at + 1) == Some(&"::") && at + 2 < tokens.len() {
                    path.push(tokens[at + 2].to_owned());
                    at += 2;
                }
                if !["mod", ".", "in"].contains(&before) {
                    module.paths.insert(path);
                }
            }
            _ => {}
        }
        at += 1;
    }
    module.imports = found.into_iter().collect();
    module
}

/// Every module of the crate by its names.
struct Modules(BTreeMap<Names, Module>);

impl Modules {
    fn read() -> Self {
        fn look(folder: &Path, names: &[String], found: &mut BTreeMap<Names, Module>) {
            for entry in fs::read_dir(folder).expect("a folder") {
                let path = entry.expect("an entry").path();
                let stem = path.file_stem().expect("a name").to_string_lossy();
                let mut names = names.to_vec();
                if path.is_dir() {
                    names.push(stem.into_owned());
                    look(&path, &names, found);
                } else if !stem.ends_with("tests") && !["main", "fixtures"].contains(&&*stem) {
                    if !["mod", "lib"].contains(&&*stem) {
                        names.push(stem.into_owned());
                    }
                    let text = fs::read_to_string(&path).expect("a source file");
                    found.insert(names, module(&text));
                }
            }
        }
        let mut found = BTreeMap::new();
        look(
            &Path::new(env!("CARGO_MANIFEST_DIR")).join("src"),
            &[],
            &mut found,
        );
        Self(found)
    }

    /// A path in a module from the crate's root on, if it leads into the crate.
    fn absolute(&self, own: &Names, path: &[String]) -> Option<Names> {
        let ups = path.iter().take_while(|name| *name == "super").count();
        let child = [own, &path[..1]].concat();
        match path[0].as_str() {
            "crate" => Some(path[1..].to_vec()),
            "super" => Some([&own[..own.len().checked_sub(ups)?], &path[ups..]].concat()),
            "self" => Some([own, &path[1..]].concat()),
            _ if self.0.contains_key(&child) => Some([own, path].concat()),
            name => {
                let import = self.0[own].imports.get(name)?;
                let import = match import[0] == *name {
                    true => self
                        .0
                        .contains_key(&child)
                        .then(|| [own, &import[..]].concat())?,
                    false => self.absolute(own, import)?,
                };
                Some([&import, &path[1..]].concat())
            }
        }
    }

    /// The module that defines what a path from the root leads to.
    fn defining(&self, path: &[String], steps: usize) -> Option<Names> {
        let known = (0..=path.len())
            .rev()
            .find(|&n| self.0.contains_key(&path[..n]))?;
        let (own, rest) = (path[..known].to_vec(), &path[known..]);
        let module = &self.0[&own];
        let Some(name) = rest.first() else {
            return Some(own);
        };
        if module.defined.contains(name) || steps == 0 {
            return Some(own);
        }
        if module.imports.contains_key(name) {
            let path = self.absolute(&own, rest)?;
            return self.defining(&path, steps - 1);
        }
        let globs = module
            .imports
            .iter()
            .filter(|(name, _)| name.starts_with('*'));
        let mut through = globs.filter_map(|(_, path)| {
            let from = self.absolute(&own, &path[..path.len() - 1])?;
            let module = self.defining(&[&from, rest].concat(), steps - 1)?;
            self.0[&module].defined.contains(name).then_some(module)
        });
        through.next().or(Some(own))
    }

    /// The modules of its folder that a module needs.
    fn needed(&self, own: &Names) -> BTreeSet<Names> {
        let paths = self.0[own].paths.iter();
        let found = paths.filter_map(|path| {
            let absolute = self.absolute(own, path)?;
            // A variable may be named like a module.
            let variable = path.len() == 1 && self.0.contains_key(&absolute);
            (!variable).then(|| self.defining(&absolute, 8)).flatten()
        });
        found
            .filter(|other| other != own && other.first() == own.first())
            .collect()
    }
}

#[test]
fn imports_make_no_circles() {
    let modules = Modules::read();
    let needed: BTreeMap<&Names, BTreeSet<Names>> = (modules.0.keys())
        .map(|own| (own, modules.needed(own)))
        .collect();
    let reached = |from: &Names| {
        let mut reached = BTreeSet::new();
        let mut next: Vec<&Names> = needed[from].iter().collect();
        while let Some(name) = next.pop() {
            if reached.insert(name) {
                next.extend(&needed[name]);
            }
        }
        reached
    };
    let circles = modules.0.keys().filter(|own| reached(own).contains(own));
    let circles: Vec<String> = circles.map(|names| names.join("/")).collect();
    assert_eq!(circles, CIRCLES, "files in circles");
}

#[test]
fn circles_are_seen() {
    let of = |files: &[(&str, &str)]| {
        let named = |(name, text): &(&str, &str)| {
            let names = name.split('/').filter(|name| !name.is_empty());
            (names.map(str::to_owned).collect(), module(text))
        };
        Modules(files.iter().map(named).collect())
    };
    let modules = of(&[
        (
            "a",
            "mod b;\n#[cfg(test)]\nmod tests;\nmod c;\npub use b::{B, inner as other};\npub struct A;",
        ),
        (
            "a/b",
            "use super::{A, c::{C as D, Unused}};\npub struct B(A, D);\npub fn inner() {}",
        ),
        (
            "a/c",
            "//! super::no\npub struct C;\nfn f() { crate::a::other() }\n#[cfg(test)]\nmod tests {\nuse super::A;\n}",
        ),
    ]);
    let needed = |name: &str| {
        let own = name.split('/').map(str::to_owned).collect();
        let needed = modules.needed(&own).into_iter();
        needed.map(|names| names.join("/")).collect::<Vec<_>>()
    };
    assert_eq!(needed("a"), [""; 0]);
    assert_eq!(needed("a/b"), ["a", "a/c"]);
    assert_eq!(needed("a/c"), ["a/b"]);
}
