//! Errors of a scene and its photos.

use std::path::PathBuf;

use crate::{
    capture::CaptureError, effects::Contradiction, gpu::GpuError, splats::SplatError,
    store::StoreError,
};

/// Error of a scene or its photos.
#[derive(Debug, thiserror::Error)]
pub enum SubjectError {
    /// A file or a folder.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The photos or their poses.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// Photos, poses and points, which contradict each other.
    #[error(transparent)]
    Unsound(#[from] Contradiction),
    /// The device failed or is missing.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// A splat file.
    #[error(transparent)]
    Splats(#[from] SplatError),
    /// A splat file without cameras.
    #[error("{}: a splat file has no cameras", .0.display())]
    NoCameras(PathBuf),
    /// A splat file without Gaussians.
    #[error("{}: holds no Gaussians", .0.display())]
    NoSplats(PathBuf),
    /// A run without colors.
    #[error("{}: the run is not colored yet: run `gs-chroma colorize` first", .0.display())]
    NoColors(PathBuf),
    /// Photos have changed their names since they were trained on.
    #[error(
        "{}: photo {photo} is what {other} was when it was trained on", folder.display()
    )]
    Exchanged {
        /// The COLMAP folder.
        folder: PathBuf,
        /// Its name now.
        photo: String,
        /// Its name then.
        other: String,
    },
}
