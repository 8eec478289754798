//! Errors of `prepare`.

use std::path::{Path, PathBuf};

use crate::{capture::CaptureError, programs::ProgramError, store::StoreError};

/// Error of `prepare`; one line that names the file and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum PrepareError {
    /// The photos.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// The file system.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// A program of others, such as FFmpeg.
    #[error(transparent)]
    Program(#[from] ProgramError),
    /// There is neither COLMAP nor its Python module.
    #[error(
        "COLMAP is not installed: install it (Debian, Ubuntu: apt-get install colmap; macOS: brew install colmap; others: https://colmap.github.io/install.html)"
    )]
    NoColmap,
    /// COLMAP knows no such camera model.
    #[error("COLMAP {version} does not know the lens {lens}: install a newer one")]
    UnknownLens {
        /// COLMAP's name of the camera model.
        lens: String,
        /// COLMAP's version.
        version: String,
    },
    /// FFmpeg is too old.
    #[error("ffmpeg {found} is too old: install 5.1 or newer")]
    OldFfmpeg {
        /// Its version.
        found: String,
    },
    /// Not enough for a scene.
    #[error(
        "{}: holds {found} usable photos, and depth needs two at least; name a folder of JPEG, PNG or TIFF files, or a film", input.display()
    )]
    TooFew {
        /// Input that was given.
        input: PathBuf,
        /// Photos that can be used.
        found: usize,
    },
    /// The output folder holds what this program did not put there.
    #[error("{}: holds other things, such as {other}; name a new folder with -o", folder.display())]
    NotOurs {
        /// Folder at fault.
        folder: PathBuf,
        /// One of them.
        other: String,
    },
    /// The output folder belongs to another input.
    #[error(
        "{}: was prepared from {}; name another folder with -o", folder.display(), input.display()
    )]
    OtherInput {
        /// Folder at fault.
        folder: PathBuf,
        /// Input it was prepared from.
        input: PathBuf,
    },
    /// A result that would be replaced was changed since it was made.
    #[error(
        "{}: was changed since it was made, and would be replaced; move it elsewhere", path.display()
    )]
    Changed {
        /// The file or folder.
        path: PathBuf,
    },
    /// COLMAP placed nothing.
    #[error("no photo has a pose: {remedy}")]
    NoPoses {
        /// Suggested remedy.
        remedy: String,
    },
}

impl PrepareError {
    /// Names a file and what is wrong with it.
    pub(super) fn at(path: &Path, reason: impl Into<String>) -> Self {
        Self::Store(StoreError::file(path, reason))
    }
}
