//! Folders that somebody else may have filled: names that lead nowhere else, files that are
//! nobody else's, and the identity of a file whatever it is called.

use std::{
    collections::HashMap,
    fs::{self, File, Metadata},
    io,
    path::{Component, Path},
    sync::{Mutex, MutexGuard, PoisonError},
};

/// True if a name read from a file is that of a folder entry: no path, no parent, no drive.
pub(crate) fn is_entry(name: &str) -> bool {
    let mut parts = Path::new(name).components();
    let normal = matches!(parts.next(), Some(Component::Normal(part)) if part == name);
    normal && parts.next().is_none() && !name.contains(['/', '\\', ':', '\0'])
}

fn refused(reason: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidInput, reason)
}

/// Refuses what is there and is no file of its own: whoever changes it in place would change
/// another one, or wait for ever.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] with a reason that follows a path.
pub(super) fn check_own(path: &Path) -> io::Result<()> {
    let Ok(there) = fs::symlink_metadata(path) else {
        return Ok(());
    };
    if there.is_symlink() {
        return Err(refused("is a link; remove it"));
    }
    if !there.is_file() {
        return Err(refused("is no regular file; move it elsewhere"));
    }
    match links(&there) {
        1 => Ok(()),
        _ => Err(refused("has a second name (a hard link); remove this one")),
    }
}

/// Refuses a folder or file in `folder` that is a link to somewhere outside of it.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] with a reason that follows a path.
pub(crate) fn check_inside(folder: &Path, path: &Path) -> io::Result<()> {
    match fs::symlink_metadata(path) {
        Ok(there) if there.is_symlink() => {}
        _ => return Ok(()),
    }
    let inside = |to: &Path| Ok::<_, io::Error>(to.starts_with(fs::canonicalize(folder)?));
    match fs::canonicalize(path).and_then(|to| inside(&to)) {
        Ok(true) => Ok(()),
        _ => Err(refused(
            "is a link that leads out of its folder; put what it leads to in its place",
        )),
    }
}

/// Identity of a file regardless of its path: device and inode numbers, or, where the system has
/// none, its resolved path.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct FileId(#[cfg(unix)] [u64; 2], #[cfg(not(unix))] std::path::PathBuf);

impl FileId {
    /// Identity of a file, links followed; `None` if it does not exist.
    pub fn of(path: &Path) -> Option<Self> {
        #[cfg(unix)]
        {
            use std::os::unix::fs::MetadataExt;
            let there = fs::metadata(path).ok()?;
            Some(Self([there.dev(), there.ino()]))
        }
        #[cfg(not(unix))]
        fs::canonicalize(path).ok().map(Self)
    }
}

/// Files that nothing may be written over, each with its kind, such as `a photo`, as often as it
/// was named.
static ORIGINALS: Mutex<Vec<(u64, HashMap<FileId, &'static str>)>> = Mutex::new(Vec::new());

fn originals() -> MutexGuard<'static, Vec<(u64, HashMap<FileId, &'static str>)>> {
    ORIGINALS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Keeps files from being written over, by whatever path, as long as it lives.
#[derive(Debug)]
pub(crate) struct Originals(u64);

impl Originals {
    pub fn keep(files: HashMap<FileId, &'static str>) -> Self {
        let mut all = originals();
        let number = all.last().map_or(0, |(last, _)| last + 1);
        all.push((number, files));
        Self(number)
    }
}

impl Drop for Originals {
    fn drop(&mut self) {
        originals().retain(|(number, _)| *number != self.0);
    }
}

/// Refuses to write over an original.
///
/// # Errors
/// [`io::ErrorKind::InvalidInput`] with a reason that follows a path.
pub(crate) fn check_no_original(path: &Path) -> io::Result<()> {
    let all = originals();
    if all.is_empty() {
        return Ok(());
    }
    let id = FileId::of(path);
    let kind = id.and_then(|id| all.iter().find_map(|(_, files)| files.get(&id)));
    match kind {
        Some(kind) => Err(refused(&format!(
            "is {kind} and is never written over; choose another output"
        ))),
        None => Ok(()),
    }
}

#[cfg(unix)]
fn links(there: &Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::nlink(there)
}

/// Other systems do not tell.
#[cfg(not(unix))]
fn links(_: &Metadata) -> u64 {
    1
}

/// Size, time of change and number of an open file: as long as they are the same, so are the
/// bytes.
pub(crate) fn stamp(file: &File) -> io::Result<String> {
    let there = file.metadata()?;
    #[cfg(unix)]
    let number = std::os::unix::fs::MetadataExt::ino(&there);
    #[cfg(not(unix))]
    let number = 0;
    let since = there.modified()?.duration_since(std::time::UNIX_EPOCH);
    let nanoseconds = since.map_or(0, |since| since.as_nanos());
    Ok(format!("{:x}-{nanoseconds:x}-{number:x}", there.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lead_nowhere_else() {
        for name in ["color.ply", "a b", ".removed", "Größe"] {
            assert!(is_entry(name), "{name}");
        }
        for name in [
            "", ".", "..", "../a", "/a", "a/b", "a/", "a\\b", "C:", "C:a",
        ] {
            assert!(!is_entry(name), "{name}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn links_are_no_files_of_their_own() {
        use std::os::unix::fs::symlink;
        let place = tempfile::tempdir().unwrap();
        let path = |name: &str| place.path().join(name);
        fs::create_dir(path("run")).unwrap();
        fs::write(path("run/own"), "").unwrap();
        fs::write(path("precious"), "precious").unwrap();
        symlink("../precious", path("run/link")).unwrap();
        symlink("../nothing", path("run/dangling")).unwrap();
        symlink("own", path("run/within")).unwrap();
        fs::hard_link(path("precious"), path("run/hard")).unwrap();
        assert!(check_own(&path("run/own")).is_ok());
        assert!(check_own(&path("run/new")).is_ok());
        for (name, word) in [
            ("link", "a link"),
            ("dangling", "a link"),
            ("within", "a link"),
            ("hard", "second name"),
            (".", "no regular file"),
        ] {
            let error = check_own(&path("run").join(name)).unwrap_err().to_string();
            assert!(error.contains(word), "{name}: {error}");
        }
        let inside = |name: &str| check_inside(&path("run"), &path("run").join(name)).is_ok();
        let found = ["own", "within", "new", "hard", "link", "dangling"].map(inside);
        assert_eq!(found, [true, true, true, true, false, false]);
        assert_eq!(FileId::of(&path("run/hard")), FileId::of(&path("precious")));
        assert_ne!(FileId::of(&path("run/own")), FileId::of(&path("precious")));
        assert_eq!(FileId::of(&path("nothing")), None);
    }

    #[test]
    fn originals_are_not_written_over() {
        let place = tempfile::tempdir().unwrap();
        let path = |name: &str| place.path().join(name);
        fs::write(path("photo"), "").unwrap();
        fs::write(path("other"), "").unwrap();
        fs::hard_link(path("photo"), path("copy")).unwrap();
        let id = FileId::of(&path("photo")).unwrap();
        let kept = Originals::keep(HashMap::from([(id, "a photo")]));
        let second = Originals::keep(HashMap::new());
        let error = check_no_original(&path("photo")).unwrap_err().to_string();
        assert!(error.starts_with("is a photo"), "{error}");
        assert_eq!(check_no_original(&path("copy")).is_err(), cfg!(unix));
        check_no_original(&path("other")).unwrap();
        check_no_original(&path("new")).unwrap();
        drop(kept);
        check_no_original(&path("photo")).unwrap();
        drop(second);
    }
}
