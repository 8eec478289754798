//! Errors of dividing a capture into blocks and of reading a job.

use std::path::PathBuf;

use crate::capture::CaptureError;

/// A capture cannot be divided, or a job cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum BlocksError {
    /// The photos or their poses.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// A file of a job.
    #[error("{}: {reason}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The error and its remedy.
        reason: String,
    },
    /// However small the blocks, they need more memory than that.
    #[error(
        "{limit} MiB are too little for any block: the smallest that {photos} photos can be divided into needs {needed} MiB"
    )]
    MemoryLimit {
        /// The requested limit, in MiB.
        limit: u64,
        /// Demand of the smallest division, in MiB.
        needed: u64,
        /// Photos of the capture.
        photos: usize,
    },
}
