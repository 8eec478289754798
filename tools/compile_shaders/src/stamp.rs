//! SHA-256 of what the compiled kernels come from: a stale one is noticed without a compiler.

use std::{fs, path::Path};

use sha2::{Digest, Sha256};

/// Name of the file that keeps it.
pub const FILE: &str = "sources.sha256";

/// Of the sources in `shaders/` and the list of variants, by names and bytes.
pub fn of(root: &Path) -> String {
    let mut files = vec![root.join("tools/compile_shaders/src/main.rs")];
    for folder in ["shaders", "shaders/common"] {
        let entries = fs::read_dir(root.join(folder)).expect("shaders/ can be read");
        let paths = entries.map(|entry| entry.expect("shaders/ can be read").path());
        files.extend(paths.filter(|path| path.extension().is_some_and(|it| it == "wgsl")));
    }
    files.sort();
    let mut hash = Sha256::new();
    for file in files {
        let name = file.file_name().unwrap_or_default().to_string_lossy();
        let bytes = fs::read(&file).expect("a source can be read");
        hash.update(format!("{name} {}\n", bytes.len()));
        hash.update(bytes);
    }
    let digest = hash.finalize();
    digest
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect::<String>()
        + "\n"
}
