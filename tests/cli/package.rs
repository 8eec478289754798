//! What `cargo package` puts into the crate.

use std::{collections::BTreeSet, fs, path::Path, process::Command};

/// Files that are needed beside `src/` and the compiled shaders.
const OTHERS: [&str; 7] = [
    "CHANGELOG.md",
    "Cargo.lock",
    "Cargo.toml",
    "LICENSE-APACHE",
    "LICENSE-MIT",
    "README.md",
    "assets/demo/images/garden_05.jpg",
];

/// Files that cargo adds.
const OF_CARGO: [&str; 2] = [".cargo_vcs_info.json", "Cargo.toml.orig"];

#[test]
fn the_crate_holds_what_it_is_built_from_and_no_more() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let listed = Command::new(env!("CARGO"))
        .args(["package", "--list", "--allow-dirty", "--offline"])
        .current_dir(root)
        .output()
        .expect("cargo starts");
    let said = String::from_utf8_lossy(&listed.stderr);
    assert!(listed.status.success(), "{said}");
    let listed = String::from_utf8_lossy(&listed.stdout).replace('\\', "/");
    let listed: BTreeSet<&str> = listed
        .lines()
        .filter(|file| !OF_CARGO.contains(file))
        .collect();
    let built = [
        "src/",
        "shaders/compiled/",
        "assets/viewer/",
        "assets/teachers.toml",
    ];
    for file in &listed {
        let is_built = built.iter().any(|place| file.starts_with(place));
        assert!(is_built || OTHERS.contains(file), "{file}");
    }
    let missing = OTHERS.iter().find(|file| !listed.contains(**file));
    assert_eq!(missing, None);
    // What sources include is there, too.
    let mut included = 0;
    for file in listed
        .iter()
        .filter(|file| file.ends_with(".rs") && !file.ends_with("tests.rs"))
    {
        let text = fs::read_to_string(root.join(file)).expect("a source");
        // Tests stand at the end.
        let text = text
            .split("#[cfg(test)]\nmod tests {")
            .next()
            .unwrap_or_default();
        for piece in text.split("include").skip(1) {
            let path = piece
                .split_once("!(\"")
                .filter(|(kind, _)| matches!(*kind, "" | "_str" | "_bytes"));
            let Some(path) = path.and_then(|(_, rest)| rest.split('"').next()) else {
                continue;
            };
            let mut parts: Vec<&str> = file.split('/').collect();
            parts.pop();
            for part in path.split('/') {
                match part {
                    ".." => drop(parts.pop()),
                    part => parts.push(part),
                }
            }
            assert!(listed.contains(&*parts.join("/")), "{file}: {path}");
            included += 1;
        }
    }
    assert!(included > 50, "{included}");
}
