//! Where this project keeps what is not part of the program.

use std::env;
use std::path::PathBuf;

/// A folder of the project's cache: `onnxruntime`, `teachers`. It need not be there.
pub(super) fn cache_folder(name: &str) -> PathBuf {
    let variable = |name| {
        env::var_os(name)
            .filter(|path| !path.is_empty())
            .map(PathBuf::from)
    };
    variable("XDG_CACHE_HOME")
        .or_else(|| variable("HOME").map(|home| home.join(".cache")))
        .or_else(|| variable("LOCALAPPDATA"))
        .unwrap_or_default()
        .join("gs-chroma")
        .join(name)
}
