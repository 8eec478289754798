//! One process at a time writes into a run.

use std::{
    fs::{File, TryLockError},
    io::{self, Write},
    path::Path,
};

use super::{RunFolder, commit, files};
use crate::{disk, input, report::Report, store::StoreError};

/// The file that is locked; it says who holds it.
pub(crate) const LOCK: &str = ".lock";

/// The right to write into a run's folder. The system takes it back when the process ends,
/// however it does.
#[derive(Debug)]
pub(crate) struct RunLock {
    _file: File,
}

impl RunLock {
    /// Takes that of a run that is there, and reads its report.
    pub fn of_run(folder: &RunFolder) -> Result<(Self, Report), StoreError> {
        // Only what is a run is locked; what its report says is read once nobody writes it.
        folder.read_report()?;
        let lock = Self::take(folder.path())?;
        Ok((lock, folder.read_report()?))
    }

    /// Lets nobody write into a run that is there as long as it is read, and reads its report.
    /// Others may read it as well.
    pub fn to_read(folder: &RunFolder) -> Result<(Option<Self>, Report), StoreError> {
        folder.read_report()?;
        let path = folder.path().join(LOCK);
        let lock = match disk::open_in_place(&path) {
            Ok(file) => match file.try_lock_shared() {
                Err(TryLockError::WouldBlock) => {
                    return Err(StoreError::InUse {
                        folder: folder.path().to_owned(),
                        holder: format!("{} is writing into it", holder(&path)),
                    });
                }
                // Some file systems cannot lock.
                Ok(()) | Err(TryLockError::Error(_)) => Some(Self { _file: file }),
            },
            Err(error) if error.kind() == io::ErrorKind::InvalidInput => {
                return Err(files::at(&path)(error));
            }
            // Where nobody can write there is nothing to keep anybody from.
            Err(_) => None,
        };
        Ok((lock, folder.read_report()?))
    }

    /// Takes it, finishes what a process that held it has left complete, and removes what it
    /// had only begun.
    pub fn take(folder: &Path) -> Result<Self, StoreError> {
        RunFolder::at(folder).check_links()?;
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

/// Who holds a lock, in words.
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
