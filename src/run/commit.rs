//! Files of a run that belong together appear together: they are written into a folder beside,
//! which is renamed once it is complete and then emptied into the run. Whoever dies in between
//! leaves either the old files or a folder that the next command empties.

use std::{
    ffi::OsStr,
    fs, io,
    path::{Path, PathBuf},
};

use super::{RunError, files};
use crate::{
    disk::{self, DraftFolder},
    input,
};

/// What is complete, and is to be moved into its place.
const COMPLETE: &str = ".commit";

/// What is being written.
const BEGUN: &str = ".next-";

/// In [`COMPLETE`], the names of what has to go, a line each.
const REMOVED: &str = ".removed";

/// New files of a run, not in their place yet. Dropped, it leaves nothing behind.
pub(super) struct Commit {
    folder: PathBuf,
    made: DraftFolder,
    removed: Vec<String>,
}

impl Commit {
    /// An empty one for the run in `folder`.
    ///
    /// # Errors
    /// [`RunError::File`].
    pub fn new(folder: &Path) -> Result<Self, RunError> {
        let made = disk::create_folder(BEGUN, folder);
        Ok(Self {
            folder: folder.to_owned(),
            made: made.map_err(files::at(folder))?,
            removed: Vec::new(),
        })
    }

    /// Where to write what will be `path` in the run's folder.
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
    /// [`RunError::File`]; then either nothing has changed, or [`finish`] will do what is left.
    pub fn finish(self) -> Result<(), RunError> {
        let list = self.made.path().join(REMOVED);
        files::write(&list, self.removed.join("\n").as_bytes())?;
        let complete = self.folder.join(COMPLETE);
        self.made.persist(&complete).map_err(files::at(&complete))?;
        disk::sync(&self.folder);
        finish(&self.folder)
    }
}

/// Puts in its place what a process that ended too early has left complete.
///
/// # Errors
/// [`RunError::File`].
pub(super) fn finish(folder: &Path) -> Result<(), RunError> {
    let complete = folder.join(COMPLETE);
    let list = match input::read_to_string(&complete.join(REMOVED)) {
        Ok(list) => list,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(files::at(&complete)(error)),
    };
    for name in list.lines() {
        remove(&folder.join(name))?;
    }
    for entry in fs::read_dir(&complete).map_err(files::at(&complete))? {
        let made = entry.map_err(files::at(&complete))?.path();
        if made.file_name() == Some(OsStr::new(REMOVED)) {
            continue;
        }
        let place = folder.join(name(&made));
        if made.is_dir() {
            remove(&place)?;
        }
        disk::rename(&made, &place).map_err(files::at(&place))?;
    }
    disk::sync(folder);
    // The list goes last: as long as it is there, all of this can be done again.
    remove(&complete)
}

/// Whether there is something to finish.
pub(super) fn is_left(folder: &Path) -> bool {
    folder.join(COMPLETE).join(REMOVED).exists()
}

/// Removes what processes that ended too early have begun. Nobody may be writing.
pub(super) fn clean(folder: &Path) {
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        let emptied = name == COMPLETE && !is_left(folder);
        // `.tmp` and six letters is what a file is called before it has a name.
        let begun = [BEGUN, ".tmp"].iter().any(|prefix| {
            let rest = name.strip_prefix(prefix);
            rest.is_some_and(|rest| rest.len() == 6 && rest.chars().all(char::is_alphanumeric))
        });
        if emptied || begun {
            let _ = remove(&entry.path());
        }
    }
}

fn remove(path: &Path) -> Result<(), RunError> {
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
        for (name, text) in [("a", "old a"), ("b", "old b"), ("c", "old c")] {
            fs::write(run.path().join(name), text).unwrap();
        }
        fs::create_dir(run.path().join("page")).unwrap();
        fs::write(run.path().join("page/old"), "old").unwrap();
        run
    }

    fn filled(run: &Path) -> Commit {
        let mut commit = Commit::new(run).unwrap();
        fs::write(commit.place(&run.join("a")), "new a").unwrap();
        fs::write(commit.place(&run.join("d")), "new d").unwrap();
        fs::create_dir(commit.place(&run.join("page"))).unwrap();
        fs::write(commit.place(&run.join("page")).join("new"), "new").unwrap();
        commit.remove(&run.join("b"));
        commit.remove(&run.join("nowhere"));
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
        assert_eq!(names(run), ["a", "c", "d", "page"]);
        assert_eq!(fs::read_to_string(run.join("a")).unwrap(), "new a");
        assert_eq!(fs::read_to_string(run.join("c")).unwrap(), "old c");
        assert_eq!(names(&run.join("page")), ["new"]);
    }

    #[test]
    fn files_appear_together() {
        let run = run();
        let commit = filled(run.path());
        assert_eq!(fs::read_to_string(run.path().join("a")).unwrap(), "old a");
        commit.finish().unwrap();
        is_new(run.path());
    }

    #[test]
    fn what_is_dropped_changes_nothing() {
        let run = run();
        drop(filled(run.path()));
        assert_eq!(names(run.path()), ["a", "b", "c", "page"]);
        assert_eq!(names(&run.path().join("page")), ["old"]);
    }

    /// Whoever dies after so many of its steps.
    #[test]
    fn what_is_complete_is_finished_by_the_next() {
        let run_out_at = |steps: usize| {
            let run = run();
            let commit = filled(run.path());
            files::write(&commit.made.path().join(REMOVED), b"b\nnowhere").unwrap();
            let complete = run.path().join(COMPLETE);
            commit.made.persist(&complete).unwrap();
            let done: [&dyn Fn(); 3] = [
                &|| fs::remove_file(run.path().join("b")).unwrap(),
                &|| fs::rename(complete.join("a"), run.path().join("a")).unwrap(),
                &|| fs::remove_dir_all(run.path().join("page")).unwrap(),
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
        assert_eq!(names(run.path()), [".tmp-notes", "a", "b", "c", "page"]);
    }
}
