//! Folders and programs of the tests.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

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
