//! Pages keep what they promise: links lead somewhere, commands and options exist, the words are
//! those of docs/style.md and not too many, and help fits a screen.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

use super::{
    literals::{literals, without_tests},
    program::Place,
};

/// All commands.
pub const COMMANDS: [&str; 19] = [
    "auto",
    "prepare",
    "plan",
    "partition",
    "fit",
    "merge",
    "colorize",
    "teacher",
    "studio",
    "view",
    "render",
    "frames",
    "eval",
    "export",
    "tradeoff",
    "info",
    "doctor",
    "completions",
    "man",
];

/// The checkout.
const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// Every page by its path in the checkout.
fn pages() -> BTreeMap<PathBuf, String> {
    let mut found = vec![];
    let root = Path::new(ROOT);
    look(&root.join("docs"), "md", &mut found);
    look(&root.join("tools"), "md", &mut found);
    look(&root.join("assets"), "md", &mut found);
    let names = [
        "README.md",
        "CHANGELOG.md",
        "CONTRIBUTING.md",
        "SECURITY.md",
    ];
    found.extend(names.map(|name| root.join(name)));
    let found = found.into_iter().map(|path| {
        let text = fs::read_to_string(&path).expect("a page");
        (path, text)
    });
    found.collect()
}

/// Files below a folder with an extension.
fn look(folder: &Path, extension: &str, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() && !path.ends_with("node_modules") {
            look(&path, extension, found);
        } else if path.extension().is_some_and(|found| found == extension) {
            found.push(path);
        }
    }
}

/// A page without its blocks of code.
fn prose(text: &str) -> String {
    text.split("```").step_by(2).collect()
}

/// Words that people read on the README and the pages of docs/, at most.
const WORDS: usize = 25_000;

#[test]
fn pages_are_short() {
    let root = Path::new(ROOT);
    let readme = root.join("README.md");
    let mut pages = pages();
    pages.retain(|path, _| *path == readme || path.starts_with(root.join("docs")));
    assert!(pages[&readme].lines().count() < 120, "README.md");
    // Those in tables count, signs between them do not.
    let word = |word: &&str| word.contains(|c: char| c.is_alphanumeric());
    let count = |text: &String| prose(text).split_whitespace().filter(word).count();
    let words: usize = pages.values().map(count).sum();
    assert!(words <= WORDS, "{words} words");
}

/// The anchor that a heading gets.
fn anchor(heading: &str) -> String {
    let words = heading.trim_start_matches('#').trim().to_lowercase();
    words
        .chars()
        .filter(|c| c.is_alphanumeric() || "-_ ".contains(*c))
        .map(|c| if c == ' ' { '-' } else { c })
        .collect()
}

/// Targets of the links of a page.
fn links(text: &str) -> Vec<String> {
    let prose = prose(text);
    // Not in code: `[1, 3, H, W](x)`.
    let words: String = prose.split('`').step_by(2).collect();
    let after = words.split("](").skip(1);
    let targets = after.filter_map(|rest| rest.split_once(')').map(|(target, _)| target));
    targets
        .filter(|target| !target.starts_with("http"))
        .map(str::to_owned)
        .collect()
}

#[test]
fn links_lead_somewhere() {
    let pages = pages();
    let mut count = 0;
    for (path, text) in &pages {
        for link in links(text) {
            let (file, place) = link.split_once('#').unwrap_or((&link, ""));
            let target = match file {
                "" => path.clone(),
                file => path.with_file_name(file),
            };
            let target = fs::canonicalize(&target);
            let target = target.unwrap_or_else(|_| panic!("{}: {link}", path.display()));
            if !place.is_empty() {
                let page = pages.get(&target).expect("a page");
                let prose = prose(page);
                let headings = prose.lines().filter(|line| line.starts_with('#'));
                let anchors: BTreeSet<String> = headings.map(anchor).collect();
                assert!(anchors.contains(place), "{}: {link}", path.display());
            }
            count += 1;
        }
    }
    assert!(count > 150, "{count}");
}

#[test]
fn the_source_names_pages_that_exist() {
    let mut files = vec![];
    for folder in ["src", "tests", "tools", "benches", "shaders", "examples"] {
        for extension in ["rs", "py", "sh", "wesl"] {
            look(&Path::new(ROOT).join(folder), extension, &mut files);
        }
    }
    let mut count = 0;
    for file in files {
        let text = fs::read_to_string(&file).expect("a source");
        for rest in text.split("docs/").skip(1) {
            let end = rest
                .find(|c: char| !c.is_ascii_alphanumeric() && !"_-./".contains(c))
                .unwrap_or(rest.len());
            let name = rest[..end].trim_end_matches(['.', '/']);
            if name.ends_with(".md") {
                let page = Path::new(ROOT).join("docs").join(name);
                assert!(page.is_file(), "{}: docs/{name}", file.display());
                count += 1;
            }
        }
    }
    assert!(count > 40, "{count}");
}

/// Output of `--help`, by command.
fn helps(place: &Place) -> BTreeMap<&'static str, String> {
    let help = |command| {
        let mut text = place.succeed(&[command, "--help"]);
        if command == "teacher" {
            for action in ["list", "fetch", "check"] {
                text += &place.succeed(&[command, action, "--help"]);
            }
        }
        (command, text)
    };
    COMMANDS.into_iter().map(help).collect()
}

/// The options in a piece of text.
fn options(text: &str) -> BTreeSet<&str> {
    let words = text.split([
        ' ', ',', '[', ']', '\n', '`', ';', ')', '(', '=', '|', '"', '\\', ':',
    ]);
    words
        .map(|word| word.trim_end_matches('.'))
        .filter(|word| word.len() > 2 && word.starts_with("--"))
        .collect()
}

#[test]
fn commands_and_options_of_all_pages_exist() {
    let place = Place::new();
    let helps = helps(&place);
    let known: BTreeMap<_, _> = helps.iter().map(|(c, help)| (*c, options(help))).collect();
    let all: BTreeSet<&str> = known.values().flatten().copied().collect();
    let mut count = 0;
    for (path, text) in pages() {
        let page = path.display();
        // Commands as they are typed, up to what the shell does with their output.
        let code = text.split("```").skip(1).step_by(2);
        for line in code.flat_map(str::lines) {
            let Some((_, words)) = line.split_once("gs-chroma ") else {
                continue;
            };
            if !line.trim_start().starts_with("gs-chroma ") {
                continue;
            }
            let words = words.split(['#', '|', '>']).next().unwrap_or_default();
            let command = words.split_whitespace().next().unwrap_or_default();
            if command == "COMMAND" {
                continue;
            }
            let Some(known) = known.get(command) else {
                panic!("{page}: {line}");
            };
            for option in options(words) {
                assert!(known.contains(option), "{page}: {option} of {command}");
                count += 1;
            }
        }
        // Options in the first cells of tables, and in sentences about a command of ours.
        let rows = text.lines().filter(|line| line.starts_with("| `--"));
        for row in rows {
            let cell = row.split(" | ").next().unwrap_or_default();
            for option in options(cell) {
                assert!(all.contains(option), "{page}: {option}");
                count += 1;
            }
        }
    }
    assert!(count > 80, "{count}");
}

/// Phrases that docs/style.md replaces.
fn unwanted() -> Vec<String> {
    let style = fs::read_to_string(format!("{ROOT}/docs/style.md")).expect("the page");
    let (_, table) = style.split_once("## Words").expect("the table");
    let rows = table.lines().filter(|line| line.starts_with("| "));
    let words = rows.skip(1).filter_map(|row| row.split('|').nth(1));
    words.map(|word| word.trim().to_lowercase()).collect()
}

/// String literals of `src/`, without the spellings that the program accepts, by file.
fn messages() -> BTreeMap<PathBuf, String> {
    let mut files = vec![];
    look(&Path::new(ROOT).join("src"), "rs", &mut files);
    let found = files.into_iter().map(|file| {
        let text = fs::read_to_string(&file).expect("a source");
        let words = literals(without_tests(&text)).into_iter();
        let words = words.filter(|words| !["colourize", "colourise"].contains(words));
        let words = words.collect::<Vec<_>>().join("\n");
        // A literal goes on in the next line.
        let lines = words.split("\\\n").map(str::trim_start);
        (file, lines.collect())
    });
    found.collect()
}

#[test]
fn words_are_those_of_the_style() {
    let unwanted = unwanted();
    assert!(unwanted.len() > 25, "{unwanted:?}");
    let mut texts = pages();
    texts.retain(|path, _| !path.ends_with("style.md") && !path.ends_with("CHANGELOG.md"));
    for (command, help) in helps(&Place::new()) {
        texts.insert(command.into(), help);
    }
    let messages = messages();
    assert!(
        messages
            .values()
            .any(|text| text.contains("no photo has a pose"))
    );
    texts.extend(messages);
    for (path, text) in texts {
        let words: Vec<&str> = text.split_whitespace().collect();
        let text = words.join(" ").to_lowercase();
        for word in &unwanted {
            assert!(!text.contains(word), "{}: {word}", path.display());
        }
    }
}

/// The source with its strings in one piece.
fn source() -> String {
    let mut files = vec![];
    look(&Path::new(ROOT).join("src"), "rs", &mut files);
    let texts = files
        .iter()
        .map(|file| fs::read_to_string(file).expect("a source"));
    let text = texts.collect::<Vec<_>>().join("\n");
    let lines = text.split("\\\n").map(str::trim_start);
    lines.collect()
}

#[test]
fn messages_of_the_trouble_page_exist() {
    let source = source();
    let page = fs::read_to_string(format!("{ROOT}/docs/troubleshooting.md")).expect("the page");
    let (_, tables) = page.split_once("## Messages").expect("tables");
    let mut count = 0;
    for row in tables.lines().filter(|line| line.starts_with("| `")) {
        let cell = row.split(" | ").next().unwrap_or_default();
        for message in cell.split('`').skip(1).step_by(2) {
            // What stands between the numbers and names of a case.
            let message = message.trim_start_matches("warning: ");
            let pieces = message.split(|c: char| c.is_ascii_digit() || "…×.%:,".contains(c));
            let longest = pieces.map(str::trim).max_by_key(|piece| piece.len());
            let longest = longest.unwrap_or_default();
            assert!(source.contains(longest), "{message}: {longest}");
            count += 1;
        }
    }
    assert!(count > 50, "{count}");
}

#[test]
fn every_page_is_in_an_index() {
    let pages = pages();
    let linked: BTreeSet<PathBuf> = pages
        .iter()
        .filter(|(path, _)| path.ends_with("README.md"))
        .flat_map(|(path, text)| {
            let targets = links(text).into_iter();
            targets.filter_map(|link| {
                let file = link.split('#').next()?.to_owned();
                fs::canonicalize(path.with_file_name(file)).ok()
            })
        })
        .collect();
    for path in pages.keys().filter(|path| !path.ends_with("README.md")) {
        let listed = linked.contains(path) || path.ends_with("CHANGELOG.md");
        assert!(listed, "{}", path.display());
    }
}

#[test]
fn short_help_fits_a_screen() {
    let place = Place::new();
    // As it is shown, in lines of 80 columns.
    for command in COMMANDS {
        let help = place.succeed(&[command, "-h"]);
        let lines = help.lines().count();
        assert!(lines <= 40, "{command}: {lines}\n{help}");
    }
}

#[test]
fn help_is_no_wider_than_a_terminal() {
    let place = Place::new();
    let actions = ["list", "fetch", "check"].map(|action| vec!["teacher", action]);
    let commands = COMMANDS.into_iter().map(|command| vec![command]);
    for words in commands.chain(actions).chain([vec![]]) {
        for how in ["-h", "--help"] {
            let help = place.succeed(&[&words[..], &[how]].concat());
            let widest = help.lines().map(|line| line.chars().count()).max();
            assert!(widest <= Some(80), "{words:?} {how}: {widest:?}\n{help}");
            // A command that is broken is no command.
            let examples = help.split_once("\nExample:\n").unwrap_or_default().1;
            let mut indented = examples.lines().filter(|line| line.starts_with(' '));
            let broken = indented.find(|line| !line.contains("gs-chroma "));
            assert_eq!(broken, None, "{help}");
        }
    }
}

#[test]
fn long_help_ends_with_an_example() {
    for (command, help) in helps(&Place::new()) {
        assert!(help.contains("\nExample:\n  gs-chroma "), "{command}");
        assert!(help.contains("Usage: gs-chroma"), "{command}");
    }
}

#[test]
fn wrong_arguments_are_told_with_the_commands_usage() {
    let place = Place::new();
    for (arguments, usage) in [
        (
            &["colorize", "--teacher", "t", "--weights", "1,2"][..],
            "Usage: gs-chroma colorize",
        ),
        (
            &["fit", "scene", "--with", "lens", "--without", "lens"],
            "Usage: gs-chroma fit",
        ),
        (
            &["prepare", "f.mp4", "-o", "o", "--start", "9", "--end", "5"],
            "Usage: gs-chroma prepare",
        ),
        (&["auto", "film.mp4", "-o", "o"], "gs-chroma teacher list"),
    ] {
        let done = place.run(arguments);
        assert_eq!(done.code, Some(2));
        assert!(done.stderr.contains(usage), "{}", done.stderr);
    }
}

#[test]
fn a_typo_suggests_the_command_and_british_spelling_runs() {
    let place = Place::new();
    let done = place.run(&["colorizze"]);
    assert_eq!(done.code, Some(2));
    assert!(done.stderr.contains("'colorize'"), "{}", done.stderr);
    for spelling in ["colorise", "colourize", "colourise"] {
        let help = place.succeed(&[spelling, "--help"]);
        assert!(help.contains("Usage: gs-chroma colorize"), "{help}");
    }
}

#[test]
fn shells_and_man_pages() {
    let place = Place::new();
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = place.succeed(&["completions", shell]);
        assert!(script.contains("time-limit"), "{shell}");
    }
    place.succeed(&["man", "pages/man1"]);
    let pages = place.files("pages/man1");
    for command in COMMANDS {
        let name = format!("gs-chroma-{command}.1");
        assert!(pages.contains(&name), "{pages:?}");
    }
    let fit = String::from_utf8(place.read("pages/man1/gs-chroma-fit.1")).expect("text");
    assert!(
        fit.contains("time\\-limit") && fit.contains("Example"),
        "{fit}"
    );
}
