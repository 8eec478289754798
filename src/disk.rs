//! All that is written. Output files are whole or not there: they are written beside and
//! renamed. Every step can be made to fail, so that tests see what is left then.

pub(crate) mod trust;

use std::{
    collections::BTreeSet,
    env,
    fs::{self, File, OpenOptions},
    io::{self, Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    sync::{
        LazyLock, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

use tempfile::{Builder, NamedTempFile, TempDir};

/// Names the step that fails, counted from 1, for tests: `7` the seventh, `7-` the seventh and
/// all after it, as on a disk that is full.
pub(crate) const FAULT: &str = "GS_CHROMA_TEST_FAULT";

static ASKED: LazyLock<Option<Fault>> =
    LazyLock::new(|| Fault::parse(&env::var(FAULT).unwrap_or_default()));

/// Steps so far.
static STEPS: AtomicU64 = AtomicU64::new(0);

/// Steps that fail.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Fault {
    step: u64,
    lasts: bool,
}

impl Fault {
    fn parse(text: &str) -> Option<Self> {
        let (step, lasts) = match text.strip_suffix('-') {
            Some(step) => (step, true),
            None => (text, false),
        };
        let step = step.parse().ok()?;
        Some(Self { step, lasts })
    }

    fn strikes(self, step: u64) -> bool {
        step == self.step || (self.lasts && step > self.step)
    }
}

/// A file without a name, of which nothing is left however the program ends.
#[derive(Debug)]
pub struct Scratch(File);

impl Scratch {
    /// An empty one in `folder`.
    pub fn new(folder: &Path) -> io::Result<Self> {
        step()?;
        tempfile::tempfile_in(folder).map(Self)
    }

    /// Adds bytes at its end; where they begin.
    pub fn append(&mut self, bytes: &[u8]) -> io::Result<u64> {
        step()?;
        let place = self.0.seek(SeekFrom::End(0))?;
        self.0.write_all(bytes)?;
        Ok(place)
    }

    /// Fills `bytes` with those that begin at `place`.
    pub fn read_at(&mut self, place: u64, bytes: &mut [u8]) -> io::Result<()> {
        self.0.seek(SeekFrom::Start(place))?;
        self.0.read_exact(bytes)
    }
}

/// Whoever writes passes here first, here or in [`crate::download`].
///
/// # Errors
/// As a full disk, where a test asks for it.
pub(crate) fn step() -> io::Result<()> {
    let Some(fault) = *ASKED else { return Ok(()) };
    match fault.strikes(STEPS.fetch_add(1, Ordering::Relaxed) + 1) {
        true => Err(io::ErrorKind::StorageFull.into()),
        false => Ok(()),
    }
}

/// An error without the temporary file that it names.
fn plain(error: io::Error) -> io::Error {
    error.kind().into()
}

/// The folder of a file.
pub(crate) fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}

/// Files and folders that are not in their place yet.
static UNFINISHED: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Something that is not in its place yet, as long as this lives.
struct Unfinished(PathBuf);

impl Unfinished {
    /// Makes something, which is listed before anybody can [give up](give_up).
    fn made<T>(
        make: impl FnOnce() -> io::Result<T>,
        path: impl FnOnce(&T) -> &Path,
    ) -> io::Result<(T, Self)> {
        let mut all = unfinished();
        let made = make()?;
        let path = path(&made).to_owned();
        all.insert(path.clone());
        Ok((made, Self(path)))
    }
}

impl Drop for Unfinished {
    fn drop(&mut self) {
        unfinished().remove(&self.0);
    }
}

/// Whoever holds this may make or move something. A set is whole even where a thread has
/// panicked.
fn unfinished() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    UNFINISHED.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Removes what is not in its place yet: for a program that is told to end at once. Nothing can
/// be begun or finished as long as the set that is given back lives.
#[cfg(feature = "cli")]
pub(crate) fn give_up() -> impl Sized {
    let all = unfinished();
    for path in &*all {
        let _ = match path.is_dir() {
            true => fs::remove_dir_all(path),
            false => fs::remove_file(path),
        };
    }
    all
}

/// A file that is not in its place yet. Dropped, it leaves nothing behind.
pub(crate) struct Draft {
    file: NamedTempFile,
    _listed: Unfinished,
}

/// An empty file beside `path`, which [`Draft::persist`] puts there once it is complete.
///
/// # Errors
/// The system's, when the folder is missing or cannot be written to; where `path` is an
/// [original](trust::Originals).
pub(crate) fn create(path: &Path) -> io::Result<Draft> {
    trust::check_no_original(path)?;
    step()?;
    let suffix = draft_suffix(path);
    let mut builder = Builder::new();
    builder.prefix(DRAFT).suffix(&suffix);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // Temporary files are private by default; this one will be as public as the
        // user's other files, whose umask takes away from this.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    let make = || builder.tempfile_in(folder_of(path)).map_err(plain);
    let (file, _listed) = Unfinished::made(make, NamedTempFile::path)?;
    // So that others see that somebody is writing it; some file systems cannot lock. Where locks
    // bind, FFmpeg could not fill it.
    if cfg!(unix) {
        let _ = file.as_file().try_lock();
    }
    Ok(Draft { file, _listed })
}

/// Names of files that are not in their place yet begin so, go on with six letters and digits,
/// and end in their later names.
const DRAFT: &str = ".tmp";

/// Bytes of a later name that a draft's has: longer names are not allowed everywhere.
const LONGEST_SUFFIX: usize = 120;

fn draft_suffix(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let end = name.floor_char_boundary(LONGEST_SUFFIX);
    format!("-{}", &name[..end])
}

/// True if the name is that of a draft of `path`, or, without a path, of any file.
pub(crate) fn is_draft(name: &str, path: Option<&Path>) -> bool {
    let Some((random, suffix)) = name
        .strip_prefix(DRAFT)
        .and_then(|rest| rest.split_at_checked(6))
    else {
        return false;
    };
    let ends = match path {
        Some(path) => suffix == draft_suffix(path),
        None => suffix.is_empty() || suffix.starts_with('-'),
    };
    ends && random.chars().all(char::is_alphanumeric)
}

/// Removes what processes that were killed have left of a file to be, or without one of any file
/// in `folder`; what a process is writing stays.
pub(crate) fn remove_drafts(folder: &Path, path: Option<&Path>) {
    // Elsewhere nobody knows who is writing.
    let entries = cfg!(unix)
        .then(|| fs::read_dir(folder))
        .into_iter()
        .flatten();
    for entry in entries.flatten().flatten() {
        let name = entry.file_name();
        if is_draft(&name.to_string_lossy(), path)
            && trust::check_own(&entry.path()).is_ok()
            && File::open(entry.path()).is_ok_and(|file| file.try_lock().is_ok())
        {
            // It may have been renamed by now.
            let _ = fs::remove_file(entry.path());
        }
    }
}

impl Draft {
    /// Path of the file, for another program that fills it.
    pub fn path(&self) -> &Path {
        self.file.path()
    }

    /// Puts the file where it belongs, once all of it is on the disk.
    pub fn persist(self, path: &Path) -> io::Result<()> {
        step()?;
        self.file.as_file().sync_all()?;
        step()?;
        let moving = unfinished();
        self.file.persist(path).map_err(|failed| failed.error)?;
        drop(moving);
        Ok(())
    }
}

impl Write for Draft {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        step()?;
        self.file.as_file_mut().write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.as_file_mut().flush()
    }
}

/// A folder that is not in its place yet. Dropped, it leaves nothing behind.
pub(crate) struct DraftFolder {
    made: TempDir,
    _listed: Unfinished,
}

impl DraftFolder {
    /// Path of the folder.
    pub fn path(&self) -> &Path {
        self.made.path()
    }

    /// Puts the folder where it belongs.
    pub fn persist(self, path: &Path) -> io::Result<()> {
        rename(self.path(), path)?;
        // What it would remove is elsewhere now.
        let _ = self.made.keep();
        Ok(())
    }
}

/// An empty folder in another one, whose name begins with `prefix`.
pub(crate) fn create_folder(prefix: &str, folder: &Path) -> io::Result<DraftFolder> {
    step()?;
    let mut builder = Builder::new();
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // What lies in it may be moved elsewhere, and is to be as public as other folders.
        builder.permissions(fs::Permissions::from_mode(0o777));
    }
    builder.prefix(prefix);
    let make = || builder.tempdir_in(folder).map_err(plain);
    let (made, _listed) = Unfinished::made(make, TempDir::path)?;
    Ok(DraftFolder { made, _listed })
}

/// A file without a name, in the system's folder for these.
pub(crate) fn scratch() -> io::Result<File> {
    step()?;
    tempfile::tempfile().map_err(plain)
}

/// A file that is changed in place, made where it is missing. It is nobody else's: neither a
/// link nor one that has another name.
///
/// # Errors
/// The system's, and [`io::ErrorKind::InvalidInput`] for such a file.
pub(crate) fn open_in_place(path: &Path) -> io::Result<File> {
    trust::check_own(path)?;
    step()?;
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false);
    options.open(path)
}

/// Makes a folder and those above it, where they are missing.
pub(crate) fn make_folder(path: &Path) -> io::Result<()> {
    if path.is_dir() {
        return Ok(());
    }
    step()?;
    let _making = unfinished();
    fs::create_dir_all(path)
}

/// Tries whether a folder can be written to.
pub(crate) fn try_folder(path: &Path) -> io::Result<()> {
    step()?;
    tempfile::tempfile_in(path).map(drop).map_err(plain)
}

/// Renames a file or a folder.
pub(crate) fn rename(from: &Path, to: &Path) -> io::Result<()> {
    step()?;
    let _moving = unfinished();
    fs::rename(from, to)
}

/// Brings renames in a folder to the disk, where the system has a way to.
pub(crate) fn sync(folder: &Path) {
    // Some file systems cannot; the files themselves are there.
    let _ = File::open(folder).and_then(|folder| folder.sync_all());
}

/// Removes a file or a folder with all that is in it. Nothing there is no error.
pub(crate) fn remove(path: &Path) -> io::Result<()> {
    let removed = path.symlink_metadata().and_then(|metadata| {
        step()?;
        match metadata.is_dir() {
            true => fs::remove_dir_all(path),
            false => fs::remove_file(path),
        }
    });
    match removed {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// A file of its own with the same content.
#[cfg(feature = "cli")]
pub(crate) fn copy(from: &Path, to: &Path) -> io::Result<()> {
    step()?;
    fs::copy(from, to).map(drop)
}

/// The same file in two places, copied where the file system cannot do that.
#[cfg(feature = "cli")]
pub(crate) fn link(from: &Path, to: &Path) -> io::Result<()> {
    step()?;
    fs::hard_link(from, to).or_else(|_| fs::copy(from, to).map(drop))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_appears_when_it_is_complete() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("out");
        let mut file = create(&path).unwrap();
        file.write_all(b"whole").unwrap();
        assert!(!path.exists());
        file.persist(&path).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"whole");
        drop(create(&path).unwrap());
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), 1);
        // As killed processes leave them, and one that writes.
        let writing = create(&path).unwrap();
        for name in [
            ".tmpAb12Cd-out",
            ".tmpAb12Cd-other",
            ".tmp-out",
            ".tmpAb12Cd",
        ] {
            fs::write(place.path().join(name), "half").unwrap();
        }
        let left = fs::read_dir(place.path()).unwrap().count();
        remove_drafts(place.path(), Some(&path));
        let removed = usize::from(cfg!(unix));
        assert_eq!(fs::read_dir(place.path()).unwrap().count(), left - removed);
        remove_drafts(place.path(), None);
        assert_eq!(
            fs::read_dir(place.path()).unwrap().count(),
            left - 3 * removed
        );
        drop(writing);
        assert!(create(&place.path().join("no folder/out")).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn it_is_as_public_as_any_file() {
        use std::os::unix::fs::PermissionsExt;
        let place = tempfile::tempdir().unwrap();
        let [ours, plain] = ["ours", "plain"].map(|name| place.path().join(name));
        create(&ours).unwrap().persist(&ours).unwrap();
        fs::write(&plain, []).unwrap();
        let [ours, plain] = [ours, plain].map(|path| fs::metadata(path).unwrap().permissions());
        assert_eq!(ours.mode(), plain.mode());
    }

    #[test]
    fn a_bare_name_lies_in_the_current_folder() {
        assert_eq!(folder_of(Path::new("scene.ply")), Path::new("."));
        assert_eq!(folder_of(Path::new("a/scene.ply")), Path::new("a"));
    }

    #[test]
    fn what_is_removed_is_gone() {
        let place = tempfile::tempdir().unwrap();
        let [folder, file] = ["folder", "file"].map(|name| place.path().join(name));
        make_folder(&folder.join("below")).unwrap();
        make_folder(&folder).unwrap();
        fs::write(&file, "text").unwrap();
        link(&file, &folder.join("file")).unwrap();
        for path in [&folder, &file, &file] {
            remove(path).unwrap();
            assert!(!path.exists());
        }
    }

    #[test]
    fn the_step_that_fails() {
        assert_eq!(Fault::parse(""), None);
        assert_eq!(Fault::parse("x"), None);
        let struck = |text: &str| {
            let fault = Fault::parse(text).unwrap();
            (1..5)
                .filter(|&step| fault.strikes(step))
                .collect::<Vec<_>>()
        };
        assert_eq!(struck("2"), [2]);
        assert_eq!(struck("2-"), [2, 3, 4]);
    }
}
