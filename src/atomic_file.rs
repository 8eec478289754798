//! Output files are whole or not there: they are written beside and renamed.

use std::{io, path::Path};

use tempfile::{Builder, NamedTempFile};

/// The folder of a file.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// An empty file beside `path`, which [`persist`] puts there once it is
/// complete. Dropped before that it leaves nothing behind.
///
/// # Errors
/// The system's, when the folder is missing or cannot be written to.
pub(crate) fn create(path: &Path) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Temporary files are private by default; this one will be as public as the
        // user's other files, whose umask takes away from this.
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder_of(path))
}

/// Puts a complete file where it belongs, once all of it is on the disk.
///
/// # Errors
/// The system's.
pub(crate) fn persist(file: NamedTempFile, path: &Path) -> io::Result<()> {
    file.as_file().sync_all()?;
    file.persist(path)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::{fs, io::Write};

    use super::*;

    #[test]
    fn a_file_appears_when_it_is_complete() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("out");
        let mut file = create(&path).unwrap();
        file.write_all(b"whole").unwrap();
        assert!(!path.exists());
        persist(file, &path).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        drop(create(&path).unwrap());
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 1);
        assert!(create(&place.path().join("no folder/out")).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn it_is_as_public_as_any_file() {
        use std::os::unix::fs::PermissionsExt;
        let place = tempfile::tempdir().unwrap();
        let [ours, plain] = ["ours", "plain"].map(|name| place.path().join(name));
        persist(create(&ours).unwrap(), &ours).unwrap();
        fs::write(&plain, []).unwrap();
        let [ours, plain] = [ours, plain].map(|path| fs::metadata(path).unwrap().permissions());
        assert_eq!(ours.mode(), plain.mode());
    }

    #[test]
    fn a_bare_name_lies_in_the_current_folder() {
        assert_eq!(folder_of(Path::new("scene.ply")), Path::new("."));
        assert_eq!(folder_of(Path::new("a/scene.ply")), Path::new("a"));
    }
}
