//! Files that are whole or not there.

use std::{fs, io::Write, path::Path};

use image::RgbImage;

use super::RunError;

/// Turns a system error into one that names the path.
pub(super) fn at(path: &Path) -> impl FnOnce(std::io::Error) -> RunError {
    let path = path.to_owned();
    move |error| RunError::File {
        path,
        reason: error.to_string(),
    }
}

/// Writes beside and renames.
pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<(), RunError> {
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(at(path))?;
    file.write_all(bytes).map_err(at(path))?;
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Temporary files are private; this one is to be shared like any other.
        let public = fs::Permissions::from_mode(0o644);
        file.as_file().set_permissions(public).map_err(at(path))?;
    }
    file.persist(path).map_err(|error| at(path)(error.error))?;
    Ok(())
}

/// Writes a PNG beside and renames.
pub(super) fn write_png(path: &Path, image: &RgbImage) -> Result<(), RunError> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image
        .write_to(&mut bytes, image::ImageFormat::Png)
        .map_err(|error| RunError::File {
            path: path.to_owned(),
            reason: error.to_string(),
        })?;
    write(path, bytes.get_ref())
}

/// Makes a folder and those above it.
pub(super) fn make_folder(path: &Path) -> Result<(), RunError> {
    fs::create_dir_all(path).map_err(at(path))
}

/// The largest resident memory of this process so far, in bytes.
pub(super) fn peak_host_memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|line| line.starts_with("VmHWM:"))?;
    let kib: u64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kib * 1024)
}
