//! COLMAP as a module of Python, where the program is not installed.

use std::{
    ffi::OsString,
    path::{Path, PathBuf},
};

use super::PrepareError;
use crate::{
    chroma::teacher::cache_folder,
    disk,
    programs::{Program, ProgramError},
    store::files,
};

/// Python script that runs COLMAP's commands through `pycolmap`.
const SCRIPT: &str = include_str!("pycolmap.py");

/// Requirement that is installed where COLMAP is missing.
pub(crate) const PINNED: &str = "pycolmap==4.2.1";

/// The same and its dependencies, with the SHA-256 of each wheel.
const REQUIREMENTS: &str = include_str!("pycolmap.txt");

/// Reasons given if Python cannot make an environment, or if there is no wheel for it.
const NO_PIP: &str = "it has no venv module with pip; install it (Debian, Ubuntu: apt-get install python3-venv), or COLMAP";
const NO_WHEEL: &str = "pycolmap is pinned for Python 3.10 to 3.14 on Linux (x86-64), macOS 14 (Apple silicon) and Windows (x86-64), not for this one; install COLMAP";

/// Python code that prints the version; it fails before 3.13, whose functions have other names,
/// and if the camera model of this name is not known.
const VERSION: &str = "import pycolmap, sys
pycolmap.SequentialPairingOptions, pycolmap.CameraModelId.__members__[sys.argv[1]]
print('pycolmap', pycolmap.__version__)";

/// A Python that has `pycolmap`, which knows a camera model, and its version: the one on `PATH`,
/// else that of the cache, which `install` makes.
///
/// # Errors
/// [`PrepareError::NoColmap`] where there is none, and whatever keeps one from being made.
pub(super) fn find(
    lens: &str,
    install: bool,
    told: &mut dyn FnMut(String),
) -> Result<(OsString, String), PrepareError> {
    let own = environment().map(|environment| environment.join(interpreter()));
    let known = [Some("python3".into()), own.clone().map(OsString::from)];
    for python in known.into_iter().flatten() {
        if let Ok(version) = version(&python, lens) {
            return Ok((python, version));
        }
    }
    let (true, Some(folder), Some(own)) = (install, environment(), own) else {
        return Err(PrepareError::NoColmap);
    };
    told(format!("installing {PINNED} into {}", folder.display()));
    disk::make_folder(&folder).map_err(files::at(&folder))?;
    let requirements = folder.join("requirements.txt");
    files::write(&requirements, REQUIREMENTS.as_bytes())?;
    let make = python("python3").args(["-m", "venv", "."]);
    run(make, &folder, ("ensurepip", NO_PIP))?;
    let pip = [
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
    ];
    let pip = python(&own)
        .args(pip)
        .args(["--require-hashes", "--only-binary", ":all:", "-r"]);
    run(
        pip.arg(requirements),
        &folder,
        ("No matching distribution", NO_WHEEL),
    )?;
    Ok((own.clone().into(), version(own, lens)?))
}

/// Runs a Python in a folder; where it fails with some words, this is why.
fn run(python: Program, folder: &Path, (words, why): (&str, &str)) -> Result<(), ProgramError> {
    let mut heard = false;
    let ended = python.run(folder, &mut |line| heard |= line.contains(words));
    ended.map_err(|error| match heard {
        true => ProgramError::Failed {
            program: "python3".to_owned(),
            said: why.to_owned(),
        },
        false => error,
    })
}

/// Python on a command of COLMAP's; options follow as names and values.
pub(super) fn program(interpreter: &OsString, command: &str) -> Program {
    python(interpreter).args(["-c", SCRIPT, command])
}

/// A Python that heeds neither files of the current folder nor the environment.
fn python(interpreter: impl Into<OsString>) -> Program {
    Program::new(interpreter).arg("-I")
}

/// Its version of `pycolmap`.
fn version(interpreter: impl Into<OsString>, lens: &str) -> Result<String, ProgramError> {
    let said = python(interpreter).args(["-c", VERSION, lens]).ask()?;
    let mut lines = said.lines();
    let version = lines.find_map(|line| line.strip_prefix("pycolmap "));
    Ok(version.unwrap_or_default().trim().to_owned())
}

/// Folder of the virtual environment.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_wheel_is_known_by_its_digits() {
        let lines = REQUIREMENTS.lines().filter(|line| !line.starts_with('#'));
        for line in lines {
            let line = line.trim_end_matches('\\').trim_end();
            let hash = line.trim_start().strip_prefix("--hash=sha256:");
            let named = || {
                line.split_once("==")
                    .is_some_and(|(name, _)| !name.contains(' '))
            };
            assert!(hash.map_or_else(named, |hash| hash.len() == 64), "{line}");
        }
        assert!(REQUIREMENTS.lines().any(|line| line.starts_with(PINNED)));
    }
}
