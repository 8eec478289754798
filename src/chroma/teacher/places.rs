//! Cache folders of files that are not part of the program.

use std::env;
use std::path::PathBuf;

/// A folder of the project's cache: `onnxruntime`, `teachers`, `pycolmap`. It need not be there. None where
/// the system names no place for it: never one that depends on the current folder, since
/// libraries are loaded from it.
pub(crate) fn cache_folder(name: &str) -> Option<PathBuf> {
    let variable = |name| env::var_os(name).map(PathBuf::from);
    let candidates = [
        variable("XDG_CACHE_HOME"),
        env::home_dir().map(|home| home.join(".cache")),
        variable("LOCALAPPDATA"),
    ];
    let mut found = candidates.into_iter().flatten();
    let found = found.find(|path| path.is_absolute())?;
    Some(found.join("gs-chroma").join(name))
}
