//! Errors of stage 2.

use std::error::Error;

use crate::{capture::CaptureError, gpu::GpuError};

/// An error of a colorizer.
pub type ColorizerError = Box<dyn Error + Send + Sync>;

/// Stage 2 cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum ChromaError {
    /// The device failed or is missing.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The temporary file that wanted colors wait in.
    #[error(
        "wanted colors do not fit into a temporary file ({0}): make room, or set TMPDIR to a folder with more"
    )]
    Spill(#[from] std::io::Error),
    /// A photo.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// Whoever colors the photos.
    #[error(transparent)]
    Colorizer(ColorizerError),
    /// Whoever was told of the progress wanted it to end.
    #[error("cancelled")]
    Cancelled,
    /// There is nothing to distill.
    #[error("no view has a color: a teacher must color at least one training view")]
    NoViews,
    /// A picture has not its camera's size.
    #[error("a wanted picture of {found:?} pixels for a camera of {expected:?}")]
    WrongSize {
        /// Width and height of the picture.
        found: [u32; 2],
        /// Size of the camera.
        expected: [u32; 2],
    },
    /// A checkpoint is one of another distillation.
    #[error("the checkpoint is one of another distillation")]
    OtherCheckpoint,
    /// The memory limit does not hold what one view needs.
    #[error(
        "{splats} Gaussians and one view at a time need {} MiB of the device but the memory limit is {}",
        needed >> 20, limit >> 20
    )]
    OverLimit {
        /// Number of Gaussians.
        splats: usize,
        /// Bytes needed.
        needed: u64,
        /// Bytes allowed.
        limit: u64,
    },
}
