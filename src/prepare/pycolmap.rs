//! COLMAP as a module of Python, where the program is not installed.

use std::{ffi::OsString, path::PathBuf};

use super::PrepareError;
use crate::{chroma::teacher::cache_folder, disk, programs::Program, run::files};

/// What does with `pycolmap` what the program's commands do.
const SCRIPT: &str = include_str!("pycolmap.py");

/// What is installed where nothing is there.
pub(super) const PINNED: &str = "pycolmap==4.2.1";

/// What says which version there is; of those before 3.13, whose functions are called
/// otherwise, nothing.
const VERSION: &str =
    "import pycolmap; pycolmap.SequentialPairingOptions; print('pycolmap', pycolmap.__version__)";

/// A Python that has `pycolmap`, and its version: the one on `PATH`, else that of the cache,
/// which `install` makes.
///
/// # Errors
/// [`PrepareError::NoColmap`] where there is none, and whatever keeps one from being made.
pub(super) fn find(
    install: bool,
    told: &mut dyn FnMut(String),
) -> Result<(OsString, String), PrepareError> {
    let own = environment().map(|environment| environment.join(interpreter()));
    let known = [Some("python3".into()), own.clone().map(OsString::from)];
    for python in known.into_iter().flatten() {
        if let Some(version) = version(&python) {
            return Ok((python, version));
        }
    }
    let (true, Some(folder), Some(own)) = (install, environment(), own) else {
        return Err(PrepareError::NoColmap);
    };
    told(format!("installing {PINNED} into {}", folder.display()));
    disk::make_folder(disk::folder_of(&folder)).map_err(files::at(&folder))?;
    Program::new("python3")
        .args(["-m", "venv"])
        .arg(&folder)
        .ask()?;
    let pip = [
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
        PINNED,
    ];
    Program::new(&own).args(pip).ask()?;
    let version = version(own.as_os_str()).ok_or(PrepareError::NoColmap)?;
    Ok((own.into(), version))
}

/// Python on a command of COLMAP's; options follow as names and values.
pub(super) fn program(python: &OsString, command: &str) -> Program {
    Program::new(python).args(["-c", SCRIPT, command])
}

fn version(python: impl Into<OsString>) -> Option<String> {
    let said = Program::new(python).args(["-c", VERSION]).ask().ok()?;
    let version = said
        .lines()
        .find_map(|line| line.strip_prefix("pycolmap "))?;
    Some(version.trim().to_owned())
}

/// Where it is installed.
fn environment() -> Option<PathBuf> {
    cache_folder("pycolmap")
}

fn interpreter() -> &'static str {
    if cfg!(windows) {
        "Scripts/python.exe"
    } else {
        "bin/python3"
    }
}
