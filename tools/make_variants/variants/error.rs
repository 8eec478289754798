//! Errors of making a variant.

use std::path::PathBuf;

use gs_chroma::capture::CaptureError;

/// Error of making a variant.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The source is no usable COLMAP folder.
    #[error(transparent)]
    Source(#[from] CaptureError),
    /// A photo of the source cannot be decoded.
    #[error("{}: {reason}", path.display())]
    Photo { path: PathBuf, reason: String },
    /// The folder to write is there already.
    #[error("{}: exists already; name another folder", path.display())]
    Exists { path: PathBuf },
    /// A file or folder cannot be written.
    #[error("{}: cannot be written ({reason})", path.display())]
    Write { path: PathBuf, reason: String },
}
