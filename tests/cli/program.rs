//! Running the program.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

#[cfg(unix)]
pub use nix::sys::signal::Signal;
#[cfg(unix)]
use nix::{sys::signal::kill, unistd::Pid};
use serde_json::Value;
use tempfile::TempDir;

/// An empty folder to run the program in.
pub struct Place(TempDir);

/// Exit code and output of a run of the program.
#[derive(Debug)]
pub struct Done {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

impl Place {
    pub fn new() -> Self {
        let below = Path::new(env!("CARGO_TARGET_TMPDIR"));
        let made = tempfile::Builder::new().prefix("cli-").tempdir_in(below);
        Self(made.expect("the target folder is writable"))
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// The program in this folder, not yet started.
    pub fn command<S: AsRef<OsStr>>(&self, arguments: &[S]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gs-chroma"));
        command
            .args(arguments)
            .current_dir(&self.0)
            // Where it is not set, Mesa complains on standard error.
            .env("XDG_RUNTIME_DIR", self.0.path())
            .env_remove("RUST_BACKTRACE");
        command
    }

    /// Runs the program whatever comes of it.
    pub fn run<S: AsRef<OsStr>>(&self, arguments: &[S]) -> Done {
        Done::of(self.command(arguments).stdin(Stdio::null()).output())
    }

    /// Runs the program and gives its standard output; it has to succeed.
    pub fn succeed(&self, arguments: &[&str]) -> String {
        let done = self.run(arguments);
        assert_eq!(done.code, Some(0), "{arguments:?}: {}", done.stderr);
        done.stdout
    }

    /// The same for an output that is JSON.
    pub fn json(&self, arguments: &[&str]) -> Value {
        let stdout = self.succeed(arguments);
        serde_json::from_str(&stdout).unwrap_or_else(|e| panic!("{arguments:?}: {e}: {stdout}"))
    }

    /// The report of a run in this folder.
    pub fn report(&self, run: &str) -> Value {
        let bytes = fs::read(self.path(run).join("report.json")).expect("a report");
        serde_json::from_slice(&bytes).expect("a report in JSON")
    }

    /// Lets the report of a run describe no files, as those of former versions: tests may then
    /// change them.
    pub fn forget_files(&self, run: &str) {
        let mut report = self.report(run);
        report.as_object_mut().expect("a report").remove("files");
        self.write(&format!("{run}/report.json"), report.to_string());
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().expect("a parent")).expect("writable");
        fs::write(path, bytes).expect("writable");
    }

    /// Every file below a folder by its path below it, sorted.
    pub fn files(&self, folder: &str) -> Vec<String> {
        files_below(&self.path(folder))
            .into_iter()
            .map(|(name, _)| name)
            .collect()
    }
}

impl Done {
    pub fn of(output: std::io::Result<Output>) -> Self {
        let output = output.expect("the program starts");
        Self {
            code: output.status.code(),
            stdout: String::from_utf8_lossy(&output.stdout).into_owned(),
            stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        }
    }
}

/// Sends a signal to a process, which has to be there.
#[cfg(unix)]
pub fn send(signal: Signal, process: u32) {
    kill(Pid::from_raw(process as i32), signal).expect("a process");
}

/// Returns true if a process exists.
#[cfg(unix)]
pub fn is_running(process: u32) -> bool {
    kill(Pid::from_raw(process as i32), None).is_ok()
}

/// Every file below a folder with its bytes, sorted by path; `/` between parts.
pub fn files_below(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(current) = folders.pop() {
        for entry in fs::read_dir(&current).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let below = path.strip_prefix(folder).expect("below");
                let name = below.to_string_lossy().replace('\\', "/");
                // It says who wrote last, and stays.
                if name.ends_with(".lock") {
                    continue;
                }
                found.push((name, fs::read(&path).unwrap_or_default()));
            }
        }
    }
    found.sort();
    found
}
