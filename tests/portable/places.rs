//! What this machine has.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::Command,
};

/// A program on the PATH.
pub fn on_path(name: &str) -> Option<PathBuf> {
    let path = env::var_os("PATH")?;
    env::split_paths(&path)
        .map(|folder| folder.join(name))
        .find(|program| program.is_file())
}

/// A program on the PATH, or a word about what is skipped without it.
pub fn program(name: &str, package: &str, what: &str) -> Option<PathBuf> {
    let found = on_path(name);
    if found.is_none() {
        crate::say(&format!("{what}: skipped, {name} is not there ({package})"));
    }
    found
}

/// An empty folder below the target folder.
pub fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    // It may not be there.
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).expect("the target folder is writable");
    folder
}

/// Runs a program; what it said if it failed.
pub fn complaint(command: &mut Command) -> Option<String> {
    let done = command.output().expect("the program starts");
    let said = [&done.stdout[..], &done.stderr[..]].concat();
    (!done.status.success()).then(|| String::from_utf8_lossy(&said).into_owned())
}
