//! What can be wrong with blocks.

use std::path::PathBuf;

use crate::capture::CaptureError;

/// Why a capture cannot be divided, or a job not be read.
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
        /// What is wrong with it and what to do.
        reason: String,
    },
    /// However small the blocks, they need more memory than that.
    #[error(
        "{limit} MiB are too little for any block: the smallest that {photos} photos can be divided into needs {needed} MiB"
    )]
    MemoryLimit {
        /// What was asked for, in MiB.
        limit: u64,
        /// What the smallest division needs, in MiB.
        needed: u64,
        /// Photos of the capture.
        photos: usize,
    },
}
