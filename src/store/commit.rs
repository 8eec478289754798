//! Files of a run that belong together appear together: they are written into a folder beside,
//! which is renamed once it is complete and then emptied into the run. Whoever dies in between
//! leaves either the old files or a folder that the next command empties.

use std::{
    ffi::OsStr,
    fs, io,
    path::{Path, PathBuf},
};

use super::{entries::ENTRIES, files};
use crate::{
    disk::{self, DraftFolder},
    input,
    store::StoreError,
};

/// Name of a complete folder, to be moved into place.
const COMPLETE: &str = ".commit";

/// Prefix of an incomplete folder.
const BEGUN: &str = ".next-";

/// In [`COMPLETE`], the names of what has to go, a line each.
const REMOVED: &str = ".removed";

/// New files of a run, not in their place yet. Dropped, it leaves nothing behind.
pub(crate) struct Commit {
    folder: PathBuf,
    made: DraftFolder,
    removed: Vec<String>,
}

impl Commit {
    /// An empty one for the run in `folder`.
    pub fn new(folder: &Path) -> Result<Self, StoreError> {
        let made = disk::create_folder(BEGUN, folder);
        Ok(Self {
            folder: folder.to_owned(),
            made: made.map_err(files::at(folder))?,
            removed: Vec::new(),
        })
    }

    /// Temporary path of a file that will be `path` in the run's folder.
    pub fn place(&self, path: &Path) -> PathBuf {
        self.made.path().join(name(path))
    }

    /// Lets a file or a page of the run go.
    pub fn remove(&mut self, path: &Path) {
        self.removed.push(name(path).to_string_lossy().into_owned());
    }

    /// Lets a page of the run go, where it is one.
    pub fn remove_page(&mut self, path: &Path) {
        if path.join(files::PAGE).is_file() {
            self.remove(path);
        }
    }

    /// Puts all in its place.
    ///
    /// # Errors
    /// [`StoreError::File`]; then either nothing has changed, or [`finish`] will do what is left.
    pub fn finish(self) -> Result<(), StoreError> {
        let list = self.made.path().join(REMOVED);
        files::write(&list, self.removed.join("\n").as_bytes())?;
        let complete = self.folder.join(COMPLETE);
        self.made.persist(&complete).map_err(files::at(&complete))?;
        disk::sync(&self.folder);
        finish(&self.folder)
    }
}

/// Puts in its place what a process that ended too early has left complete.
pub(crate) fn finish(folder: &Path) -> Result<(), StoreError> {
    let Some(PendingCommit {
        complete,
        removed,
        made,
    }) = left(folder)?
    else {
        return Ok(());
    };
    for name in removed {
        remove(&folder.join(name))?;
    }
    for name in made {
        let (made, place) = (complete.join(name), folder.join(name));
        if made.is_dir() {
            remove(&place)?;
        }
        disk::rename(&made, &place).map_err(files::at(&place))?;
    }
    disk::sync(folder);
    // The list goes last: as long as it is there, all of this can be done again.
    remove(&complete)
}

/// A complete commit that is not in its place yet.
pub(crate) struct PendingCommit {
    complete: PathBuf,
    /// Names of entries of the run that have to go.
    removed: Vec<&'static str>,
    /// Names of entries that take their place in the run.
    made: Vec<&'static str>,
}

/// A commit that a process has left complete, if any. Nobody is trusted to have written it: it
/// may only name what commits of this program hold.
///
/// # Errors
/// [`StoreError::File`] where it names or holds anything else.
pub(crate) fn left(folder: &Path) -> Result<Option<PendingCommit>, StoreError> {
    let complete = folder.join(COMPLETE);
    let there = match complete.symlink_metadata() {
        // Of a run that is no folder the report says it.
        Err(error)
            if matches!(
                error.kind(),
                io::ErrorKind::NotFound | io::ErrorKind::NotADirectory
            ) =>
        {
            return Ok(None);
        }
        there => there.map_err(files::at(&complete))?,
    };
    let refused = |what: &str| {
        StoreError::file(
            &complete,
            format!("was not left by this program: it {what}; look at it and remove it"),
        )
    };
    if !there.is_dir() {
        return Err(refused("is no folder"));
    }
    let list = match input::read_to_string(&complete.join(REMOVED)) {
        Ok(list) => list,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        Err(error) => return Err(files::at(&complete)(error)),
    };
    let known = |name: &str| {
        let mut all = ENTRIES.into_iter();
        all.find(|known| *known == name)
            .ok_or_else(|| refused(&format!("names {name:?}, which is no file of a run")))
    };
    let removed = list.lines().map(known).collect::<Result<_, _>>()?;
    let mut made = Vec::new();
    for entry in fs::read_dir(&complete).map_err(files::at(&complete))? {
        let entry = entry.map_err(files::at(&complete))?;
        let name = entry.file_name();
        if name == REMOVED {
            continue;
        }
        let name = known(&name.to_string_lossy())?;
        let kind = entry.file_type().map_err(files::at(&complete))?;
        if !(kind.is_file() || kind.is_dir()) {
            return Err(refused(&format!("holds {name}, a link or a device")));
        }
        made.push(name);
    }
    Ok(Some(PendingCommit {
        complete,
        removed,
        made,
    }))
}

/// Removes what processes that ended too early have begun. Nobody may be writing.
pub(crate) fn clean(folder: &Path) {
    disk::remove_drafts(folder, None);
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let emptied = name == COMPLETE && left(folder).is_ok_and(|left| left.is_none());
        let begun = name
            .strip_prefix(BEGUN)
            .is_some_and(|rest| rest.len() == 6 && rest.chars().all(char::is_alphanumeric));
        if emptied || begun {
            let _ = remove(&entry.path());
        }
    }
}

fn remove(path: &Path) -> Result<(), StoreError> {
    disk::remove(path).map_err(files::at(path))
}

fn name(path: &Path) -> &OsStr {
    path.file_name().unwrap_or(path.as_os_str())
}

#[cfg(test)]
mod tests {
    use tempfile::TempDir;

    use super::*;

    fn run() -> TempDir {
        let run = tempfile::tempdir().unwrap();
        for (name, text) in [
            ("luma.ply", "old a"),
            ("color.ply", "old b"),
            ("log.csv", "old c"),
        ] {
            fs::write(run.path().join(name), text).unwrap();
        }
        fs::create_dir(run.path().join("eval")).unwrap();
        fs::write(run.path().join("eval/old"), "old").unwrap();
        run
    }

    fn filled(run: &Path) -> Commit {
        let mut commit = Commit::new(run).unwrap();
        fs::write(commit.place(&run.join("luma.ply")), "new a").unwrap();
        fs::write(commit.place(&run.join("chroma.npy")), "new d").unwrap();
        fs::create_dir(commit.place(&run.join("eval"))).unwrap();
        fs::write(commit.place(&run.join("eval")).join("new"), "new").unwrap();
        commit.remove(&run.join("color.ply"));
        commit.remove(&run.join("eval.json"));
        commit
    }

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        let mut names: Vec<String> = entries
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    }

    fn is_new(run: &Path) {
        assert_eq!(names(run), ["chroma.npy", "eval", "log.csv", "luma.ply"]);
        assert_eq!(fs::read_to_string(run.join("luma.ply")).unwrap(), "new a");
        assert_eq!(fs::read_to_string(run.join("log.csv")).unwrap(), "old c");
        assert_eq!(names(&run.join("eval")), ["new"]);
    }

    #[test]
    fn files_appear_together() {
        let run = run();
        let commit = filled(run.path());
        assert_eq!(
            fs::read_to_string(run.path().join("luma.ply")).unwrap(),
            "old a"
        );
        commit.finish().unwrap();
        is_new(run.path());
    }

    #[test]
    fn what_is_dropped_changes_nothing() {
        let run = run();
        drop(filled(run.path()));
        assert_eq!(
            names(run.path()),
            ["color.ply", "eval", "log.csv", "luma.ply"]
        );
        assert_eq!(names(&run.path().join("eval")), ["old"]);
    }

    /// Whoever dies after so many of its steps.
    #[test]
    fn what_is_complete_is_finished_by_the_next() {
        let run_out_at = |steps: usize| {
            let run = run();
            let commit = filled(run.path());
            files::write(&commit.made.path().join(REMOVED), b"color.ply\neval.json").unwrap();
            let complete = run.path().join(COMPLETE);
            commit.made.persist(&complete).unwrap();
            let done: [&dyn Fn(); 3] = [
                &|| fs::remove_file(run.path().join("color.ply")).unwrap(),
                &|| fs::rename(complete.join("luma.ply"), run.path().join("luma.ply")).unwrap(),
                &|| fs::remove_dir_all(run.path().join("eval")).unwrap(),
            ];
            done[..steps].iter().for_each(|step| step());
            finish(run.path()).unwrap();
            is_new(run.path());
            // There is nothing left to do.
            finish(run.path()).unwrap();
            is_new(run.path());
        };
        (0..=3).for_each(run_out_at);
    }

    #[test]
    fn what_was_only_begun_is_removed() {
        let run = run();
        // As if the process had ended.
        std::mem::forget(filled(run.path()));
        fs::write(run.path().join(".tmpAb12Cd"), "half").unwrap();
        fs::write(run.path().join(".tmp-notes"), "somebody's").unwrap();
        fs::create_dir(run.path().join(COMPLETE)).unwrap();
        finish(run.path()).unwrap();
        clean(run.path());
        assert_eq!(
            names(run.path()),
            [".tmp-notes", "color.ply", "eval", "log.csv", "luma.ply"]
        );
    }

    #[test]
    fn a_commit_of_somebody_else_moves_and_removes_nothing() {
        let place = tempfile::tempdir().unwrap();
        fs::write(place.path().join("victim"), "precious").unwrap();
        let above = place.path().to_str().unwrap().to_owned();
        for name in [
            "../victim",
            "..",
            "",
            ".",
            "notes.txt",
            &above,
            "eval/../..",
        ] {
            let run = run();
            fs::create_dir(run.path().join(COMPLETE)).unwrap();
            fs::write(run.path().join(COMPLETE).join(REMOVED), format!("{name}\n")).unwrap();
            let error = finish(run.path()).unwrap_err().to_string();
            assert!(error.contains("no file of a run"), "{name}: {error}");
            clean(run.path());
            assert!(run.path().join(COMPLETE).exists());
        }
        assert!(place.path().join("victim").exists());
        let run = run();
        fs::create_dir(run.path().join(COMPLETE)).unwrap();
        fs::write(run.path().join(COMPLETE).join(REMOVED), "").unwrap();
        fs::write(run.path().join(COMPLETE).join("notes.txt"), "").unwrap();
        assert!(finish(run.path()).is_err());
        #[cfg(unix)]
        {
            let run = self::run();
            fs::write(place.path().join(REMOVED), "").unwrap();
            std::os::unix::fs::symlink(place.path(), run.path().join(COMPLETE)).unwrap();
            let error = finish(run.path()).err().unwrap().to_string();
            assert!(error.contains("no folder"), "{error}");
            assert!(place.path().join("victim").exists());
        }
    }
}
