//! What can be wrong with a splat file of any format.

use std::{
    io,
    path::{Path, PathBuf},
};

use super::{Format, PlyError};

/// Why a splat file could not be read or written.
#[derive(Debug, thiserror::Error)]
pub enum SplatError {
    /// A `.ply`, or Gaussians that no file has a place for.
    #[error(transparent)]
    Ply(#[from] PlyError),
    /// The file system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// File at fault.
        path: PathBuf,
        /// The system's reason.
        source: io::Error,
    },
    /// The name to write to is that of no format.
    #[error(
        "{}: no format of splat files has this extension; those known are {}", path.display(), Format::list(|_| true)
    )]
    UnknownFormat {
        /// File at fault.
        path: PathBuf,
    },
    /// The file's name is that of a format that is not read.
    #[error(
        "{}: {format} files are not read; {remedy} (those read are {})", path.display(), Format::list(Format::is_read)
    )]
    OtherFormat {
        /// File at fault.
        path: PathBuf,
        /// Extension of the file.
        format: String,
        /// A way to one that is read.
        remedy: &'static str,
    },
    /// A file is not what its format says.
    #[error("{}: {field}: {reason}", path.display())]
    Damaged {
        /// File at fault.
        path: PathBuf,
        /// The part of the file.
        field: &'static str,
        /// What is wrong with it.
        reason: String,
    },
    /// The format's numbers are too coarse for the scene.
    #[error(
        "{}: not written: this format would move {moved} of {count} Gaussians by up to half their size or more; write a .ply or a .compressed.ply", path.display()
    )]
    Coarse {
        /// The file that was to be written.
        path: PathBuf,
        /// Gaussians that are smaller than a step of the format's numbers.
        moved: usize,
        /// All Gaussians.
        count: usize,
    },
    /// The format has no place for so many.
    #[error("{}: not written: {reason}", path.display())]
    TooMany {
        /// The file that was to be written.
        path: PathBuf,
        /// How many there are and may be.
        reason: String,
    },
}

impl SplatError {
    /// Names the file of an I/O error.
    pub(super) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Io { path, source }
    }

    /// Names the file and the part that is damaged.
    pub(super) fn damaged(path: &Path, field: &'static str, reason: impl Into<String>) -> Self {
        Self::Damaged {
            path: path.to_path_buf(),
            field,
            reason: reason.into(),
        }
    }
}
