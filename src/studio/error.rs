//! Error of the studio.

use std::path::PathBuf;

use crate::store::StoreError;

/// Error of the studio.
#[derive(Debug, thiserror::Error)]
pub enum StudioError {
    /// The folder, or a file in it.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// There is no film and no folder of photos.
    #[error("{}: is not there", .0.display())]
    NoInput(PathBuf),
    /// A name that is no file name, a word that would be an option, or options that choose the
    /// folder of the results.
    #[error("{0:?} is refused here")]
    Refused(String),
    /// Another run has this name.
    #[error("{}: is there already", .0.display())]
    Taken(PathBuf),
    /// The page is of another time.
    #[error("it is gone")]
    Gone,
    /// Training and coloring share a device.
    #[error("another job goes on: wait for it, or stop it")]
    Busy,
}
