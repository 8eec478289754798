//! One process at a time writes into a run.

use std::{
    fs::{File, TryLockError},
    io::{self, Write},
    path::Path,
};

use super::{StoreError, commit, entries::check_links, files};
use crate::{disk, input};

/// The file that is locked; it says who holds it.
pub(crate) const LOCK: &str = ".lock";

/// The right to write into a run's folder. The system takes it back when the process ends,
/// however it does.
#[derive(Debug)]
pub(crate) struct RunLock {
    _file: File,
}

impl RunLock {
    /// Lets nobody write into a run's folder as long as it is read. Others may read it as well;
    /// none where the file system cannot lock or write.
    pub fn shared(folder: &Path) -> Result<Option<Self>, StoreError> {
        let path = folder.join(LOCK);
        match disk::open_in_place(&path) {
            Ok(file) => match file.try_lock_shared() {
                Err(TryLockError::WouldBlock) => Err(StoreError::InUse {
                    folder: folder.to_owned(),
                    holder: format!("{} is writing into it", holder(&path)),
                }),
                Ok(()) | Err(TryLockError::Error(_)) => Ok(Some(Self { _file: file })),
            },
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => {
                Err(files::at(&path)(error))
            }
            Err(_) => Ok(None),
        }
    }

    /// Takes it, finishes what a process that held it has left complete, and removes what it
    /// had only begun.
    pub fn take(folder: &Path) -> Result<Self, StoreError> {
        check_links(folder)?;
        let path = folder.join(LOCK);
        let mut file = disk::open_in_place(&path).map_err(files::at(&path))?;
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                // Only who writes says who it is.
                let holder = match file.try_lock_shared() {
                    Ok(()) => "another process is reading it".to_owned(),
                    Err(_) => format!("{} is writing into it", holder(&path)),
                };
                return Err(StoreError::InUse {
                    folder: folder.to_owned(),
                    holder,
                });
            }
            // Some file systems cannot lock. Nobody knows then who else is there: what is
            // complete is finished, what was begun may still be going on.
            Err(TryLockError::Error(_)) => {
                commit::finish(folder)?;
                return Ok(Self { _file: file });
            }
        }
        let mut told = || {
            disk::step()?;
            file.set_len(0)?;
            writeln!(file, "{}", std::process::id())
        };
        told().map_err(files::at(&path))?;
        commit::finish(folder)?;
        commit::clean(folder);
        Ok(Self { _file: file })
    }
}

/// Holder of a lock, in words.
fn holder(path: &Path) -> String {
    let told = input::read_to_string(path).unwrap_or_default();
    match told.trim().parse::<u32>() {
        Ok(process) => format!("process {process}"),
        // Windows lets nobody read it.
        Err(_) => "another process".to_owned(),
    }
}

/// Finishes what a process has left complete, unless somebody is about to.
///
/// # Errors
/// [`StoreError::File`] where no process of this program has left it.
pub(crate) fn finish_what_is_left(folder: &Path) -> Result<(), StoreError> {
    if commit::left(folder)?.is_some() {
        // Whoever holds the lock does it.
        let _: Result<RunLock, StoreError> = RunLock::take(folder);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_at_a_time() {
        let run = tempfile::tempdir().unwrap();
        let lock = RunLock::take(run.path()).unwrap();
        let error = RunLock::take(run.path()).unwrap_err().to_string();
        let here = std::process::id().to_string();
        if cfg!(unix) {
            assert!(error.contains(&here), "{error}");
        }
        drop(lock);
        RunLock::take(run.path()).unwrap();
    }

    #[test]
    fn those_who_read_keep_those_who_write_away() {
        let run = tempfile::tempdir().unwrap();
        let path = run.path().join(LOCK);
        let reads = || {
            let file = disk::open_in_place(&path).unwrap();
            file.try_lock_shared().unwrap();
            file
        };
        let readers = [reads(), reads()];
        let error = RunLock::take(run.path()).unwrap_err().to_string();
        assert!(error.contains("another process is reading it"), "{error}");
        drop(readers);
        RunLock::take(run.path()).unwrap();
    }
}
