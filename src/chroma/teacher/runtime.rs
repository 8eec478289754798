//! Finding ONNX Runtime, which is loaded when a network is first needed and is
//! no part of the program.

use super::TeacherError;
use super::error::first_line;
use super::places::cache_folder;
use crate::invocation::Invocation;
use ort::environment::Environment;
use std::env;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

/// Environment variable that names the library.
const LIBRARY_VARIABLE: &str = "ORT_DYLIB_PATH";

/// Name of the library's cache folder.
const FOLDER: &str = "onnxruntime";

/// File name of the library; releases append their version.
const LIBRARY_STEM: &str = if cfg!(windows) {
    "onnxruntime"
} else {
    "libonnxruntime"
};

/// The one environment that a process can make, once it is made. Nothing may be
/// loaded without holding it.
static ENVIRONMENT: Mutex<Option<Environment>> = Mutex::new(None);

/// The environment of ONNX Runtime.
///
/// The library is looked for where `ORT_DYLIB_PATH` says (and then nowhere
/// else), beside the program or in Python's package, in the project's cache folder, and on the
/// system's library path.
pub(crate) fn environment() -> Result<Environment, TeacherError> {
    // A panic elsewhere leaves a whole environment or none.
    let mut environment = ENVIRONMENT.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(environment) = environment.as_ref() {
        return Ok(environment.clone());
    }
    let cached = cache_folder(FOLDER);
    // Where pip puts the Python package.
    let by_pip = cached
        .as_ref()
        .map(|folder| folder.join("onnxruntime/capi"));
    let folders = Invocation::present().libraries.iter().cloned();
    let folders = folders.chain(cached).chain(by_pip);
    let named = env::var_os(LIBRARY_VARIABLE).filter(|path| !path.is_empty());
    let built = match find(named.map(PathBuf::from), folders) {
        Some(path) => load(&path)?,
        None => system_names()
            .iter()
            .find_map(|name| load(Path::new(name)).ok())
            .ok_or_else(|| TeacherError::NoRuntime {
                cache: cache_folder(FOLDER),
            })?,
    };
    Ok(environment.insert(built).clone())
}

fn load(path: &Path) -> Result<Environment, TeacherError> {
    let bad = |reason: String| TeacherError::BadRuntime {
        path: path.to_path_buf(),
        reason,
    };
    let builder = ort::init_from(path).map_err(|error| match &error {
        // The system's own words are one level down.
        ort::LoadDynamicError::Dlopen { error: loader, .. } => bad(first_line(
            loader.source().map_or(error.to_string(), |s| s.to_string()),
        )),
        _ => bad(first_line(error)),
    })?;
    let environment = builder.with_name("gs-chroma").with_telemetry(false).build();
    environment.map_err(|error| bad(first_line(error)))
}

/// The library that is named, or the first one in the folders.
fn find(named: Option<PathBuf>, folders: impl Iterator<Item = PathBuf>) -> Option<PathBuf> {
    named.or_else(|| folders.filter_map(|folder| library_in(&folder)).next())
}

/// The library in a folder; of several versions the one that sorts last.
fn library_in(folder: &Path) -> Option<PathBuf> {
    let entries = std::fs::read_dir(folder).ok()?;
    let is_library = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let rest = name.strip_prefix(LIBRARY_STEM);
        // Such as .so, .so.1.31.1, .1.31.1.dylib, .dll; not _providers_shared.so.
        rest.is_some_and(|rest| rest.starts_with('.') && rest.contains(env::consts::DLL_SUFFIX))
            && path.is_file()
    };
    let paths = entries.filter_map(Result::ok).map(|entry| entry.path());
    paths.filter(is_library).max()
}

/// Library names to try with the system's loader.
fn system_names() -> Vec<String> {
    let plain = format!("{LIBRARY_STEM}{}", env::consts::DLL_SUFFIX);
    match env::consts::DLL_SUFFIX {
        // Distributions ship the plain name with the development files only.
        ".so" => vec![plain.clone(), plain + ".1"],
        _ => vec![plain],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn the_named_library_comes_first_then_the_folders_in_order() {
        let empty = tempfile::tempdir().unwrap();
        let full = tempfile::tempdir().unwrap();
        let suffix = env::consts::DLL_SUFFIX;
        let library = full.path().join(format!("{LIBRARY_STEM}{suffix}"));
        for name in [
            format!("{LIBRARY_STEM}{suffix}"),
            format!("{LIBRARY_STEM}_providers_shared{suffix}"),
            "readme.txt".into(),
        ] {
            fs::write(full.path().join(name), "").unwrap();
        }
        let folders = || [empty.path().to_path_buf(), full.path().to_path_buf()].into_iter();
        assert_eq!(find(None, folders()), Some(library));
        let named = PathBuf::from("/elsewhere/lib.so");
        assert_eq!(find(Some(named.clone()), folders()), Some(named));
        assert_eq!(find(None, [empty.path().to_path_buf()].into_iter()), None);
        assert_eq!(find(None, [empty.path().join("missing")].into_iter()), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_library_with_a_version_is_found() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("libonnxruntime.so.9")).unwrap();
        for name in ["libonnxruntime.so.1.30.0", "libonnxruntime.so.1.31.1"] {
            fs::write(folder.path().join(name), "").unwrap();
        }
        let expected = folder.path().join("libonnxruntime.so.1.31.1");
        assert_eq!(library_in(folder.path()), Some(expected));
    }

    #[test]
    fn a_file_that_is_no_library_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("broken.so");
        fs::write(&path, "no library").unwrap();
        let _alone = ENVIRONMENT.lock().unwrap_or_else(PoisonError::into_inner);
        let message = load(&path).unwrap_err().to_string();
        assert!(message.contains("broken.so"), "{message}");
        assert!(!message.contains('\n'), "{message}");
    }

    #[test]
    fn the_error_says_how_to_get_it() {
        for (cache, named) in [(Some("/cache/gs-chroma".into()), true), (None, false)] {
            let message = TeacherError::NoRuntime { cache }.to_string();
            assert_eq!(message.contains("/cache/gs-chroma"), named, "{message}");
            for part in ["ORT_DYLIB_PATH", "https://"] {
                assert!(message.contains(part), "{message}");
            }
        }
    }
}
