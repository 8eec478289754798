//! COLMAP as a module of Python, where the program is not installed.

use std::{ffi::OsString, path::PathBuf};

use super::PrepareError;
use crate::{
    chroma::teacher::cache_folder,
    disk,
    programs::{Program, ProgramError},
    run::files,
};

/// What does with `pycolmap` what the program's commands do.
const SCRIPT: &str = include_str!("pycolmap.py");

/// What is installed where nothing is there.
pub(super) const PINNED: &str = "pycolmap==4.2.1";

/// The same, and all that it needs, with the SHA-256 of each wheel.
const REQUIREMENTS: &str = include_str!("pycolmap.txt");

/// What fails where the camera model of this name is not known.
const LENS: &str = "import pycolmap, sys; pycolmap.CameraModelId.__members__[sys.argv[1]]";

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
        if let Ok(Some(version)) = version(&python) {
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
    let mut without = false;
    let made = python("python3")
        .args(["-m", "venv", "."])
        .run(&folder, &mut |line| without |= line.contains("ensurepip"));
    made.map_err(|error| match without {
        true => PrepareError::NoVenv,
        false => error.into(),
    })?;
    let pip = [
        "-m",
        "pip",
        "install",
        "--quiet",
        "--disable-pip-version-check",
    ];
    let pinned = ["--require-hashes", "--only-binary", ":all:", "-r"];
    let mut unlisted = false;
    let installed = python(&own)
        .args(pip)
        .args(pinned)
        .arg(requirements)
        .run(&folder, &mut |line| {
            unlisted |= line.contains("No matching distribution")
        });
    installed.map_err(|error| match unlisted {
        true => PrepareError::NoWheel,
        false => error.into(),
    })?;
    Ok((
        own.clone().into(),
        version(own)?.ok_or(PrepareError::NoColmap)?,
    ))
}

/// Python on a command of COLMAP's; options follow as names and values.
pub(super) fn program(interpreter: &OsString, command: &str) -> Program {
    python(interpreter).args(["-c", SCRIPT, command])
}

/// A Python that heeds neither files of the current folder nor the environment.
fn python(interpreter: impl Into<OsString>) -> Program {
    Program::new(interpreter).arg("-I")
}

/// Its version of `pycolmap`; `None` where that is too old.
fn version(interpreter: impl Into<OsString>) -> Result<Option<String>, ProgramError> {
    let said = python(interpreter).args(["-c", VERSION]).ask()?;
    let version = said.lines().find_map(|line| line.strip_prefix("pycolmap "));
    Ok(version.map(|version| version.trim().to_owned()))
}

/// Whether it knows a camera model of this name.
pub(super) fn knows(interpreter: &OsString, lens: &str) -> bool {
    let asked = python(interpreter).args(["-c", LENS, lens]);
    asked.ask().is_ok()
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
