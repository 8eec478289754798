//! Files that are read. They are regular ones: a pipe may never end, and a device never does.

use std::{
    borrow::Cow,
    fs::{self, File},
    io::{self, Read},
    path::Path,
};

/// Opens a file for reading.
///
/// # Errors
/// The system's, or what the path names instead of a file.
pub(crate) fn open(path: &Path) -> io::Result<File> {
    // Asked before, since opening a pipe waits for whoever writes into it.
    let kind = fs::metadata(path)?.file_type();
    match (kind.is_file(), kind.is_dir()) {
        (true, _) => File::open(path),
        (_, true) => Err(io::Error::new(
            io::ErrorKind::IsADirectory,
            "is a folder; name a file",
        )),
        _ => Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            "is a pipe or a device; name a file",
        )),
    }
}

/// All bytes of a file.
pub(crate) fn read(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    open(path)?.read_to_end(&mut bytes)?;
    Ok(bytes)
}

/// All of a file that is text in UTF-8.
///
/// # Errors
/// As [`open`], and if it is no such text.
pub(crate) fn read_to_string(path: &Path) -> io::Result<String> {
    let mut text = String::new();
    open(path)?.read_to_string(&mut text)?;
    Ok(text)
}

/// A figure in KiB of a file that the system keeps, by its key; `None` where there is none.
pub(crate) fn kib(path: &Path, key: &str) -> Option<u64> {
    let text = read_to_string(path).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    line.split_whitespace().next()?.parse().ok()
}

/// Text of a file as a message quotes it: its beginning where it is long.
pub(crate) fn excerpt(text: &str) -> Cow<'_, str> {
    /// Characters.
    const LONGEST: usize = 120;
    match text.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}…", &text[..end]).into(),
        None => text.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_text_is_cut_between_characters() {
        assert_eq!(excerpt("short"), "short");
        let cut = excerpt(&"ü".repeat(75_000)).into_owned();
        assert_eq!(cut.chars().count(), 121);
        assert!(cut.ends_with("ü…"));
    }

    #[test]
    fn files_are_read_and_nothing_else() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("text");
        fs::write(&path, "text").unwrap();
        assert_eq!(read(&path).unwrap(), b"text");
        assert_eq!(read_to_string(&path).unwrap(), "text");
        fs::write(&path, b"\xff").unwrap();
        assert!(read_to_string(&path).is_err());
        let refused = |path: &Path| open(path).unwrap_err().to_string();
        assert_eq!(refused(place.path()), "is a folder; name a file");
        let missing = open(&place.path().join("missing")).unwrap_err();
        assert_eq!(missing.kind(), io::ErrorKind::NotFound);
        if cfg!(unix) {
            let device = refused(Path::new("/dev/zero"));
            assert_eq!(device, "is a pipe or a device; name a file");
        }
    }
}
