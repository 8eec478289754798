//! Errors of luma training.

use thiserror::Error;

use crate::{capture::CaptureError, gpu::GpuError};

/// Error that ends luma training without a scene.
#[derive(Debug, Error)]
pub enum LumaError {
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A photo.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// Whoever was told of the progress wanted it to end.
    #[error("cancelled")]
    Cancelled,
    /// There is nothing to train on.
    #[error("no view to train on")]
    NoViews,
    /// A photo or its mask has not its camera's size.
    #[error("training view {view}: {pixels} pixels where its camera has {expected}")]
    Size {
        /// The view's number among those trained on.
        view: usize,
        /// Pixels of the photo or its mask.
        pixels: usize,
        /// Pixels of its camera.
        expected: usize,
    },
}
