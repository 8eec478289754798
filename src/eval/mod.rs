//! Quality of a scene: its pictures against photos, and against each other.

mod agreement;
mod colored;
mod detections;
mod detector;
mod lpips;
mod luma;
mod network;
mod painter;
mod path_frames;
mod peers;
mod picture;
mod progress;
mod reference;
mod scene;
mod score;
mod teacher;

use std::path::PathBuf;

pub use agreement::{along_path, between_views, path_of};
pub use colored::{COLUMNS, Measured};
pub use detector::{Detected, Detector};
pub use lpips::Lpips;
pub use luma::{GRAY_COLUMNS, gray_rows, mean_quality, measure_luma};
pub use painter::{Drawing, Layer, MethodAb, Painter, Source};
pub use path_frames::frames_in;
pub use peers::Peer;
pub use progress::{Observer, Progress, Task};
pub use reference::{Reference, exposures};
pub use scene::ColoredScene;
pub use score::{Scored, Shot, mean_bake, mean_luma, mean_pictures, strengths};
pub use teacher::MeasuredTeacher;

use crate::{
    capture::CaptureError,
    chroma::{ChromaError, teacher::TeacherError},
    gpu::GpuError,
};

/// Error of an evaluation.
#[derive(Debug, thiserror::Error)]
pub enum EvalError {
    /// The photos or their poses.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// RGB splats to compare with, or answers that were kept.
    #[error(transparent)]
    Chroma(#[from] ChromaError),
    #[error(transparent)]
    Teacher(#[from] TeacherError),
    /// The teacher has no colors for any of the views.
    #[error("the teacher has no colors for these views")]
    NothingTaught,
    /// Pictures of another program are not those of the path's frames.
    #[error("{}: {reason}", path.display())]
    OtherFrames {
        /// The folder or the file.
        path: PathBuf,
        /// Number or size of the pictures, and that of the path.
        reason: String,
    },
    /// A frame of the path cannot be read.
    #[error("{}: {reason}", path.display())]
    Frame {
        /// The file.
        path: PathBuf,
        /// Defect, and remedy.
        reason: String,
    },
    /// A network that measures cannot be used.
    #[error("{}: {reason}", path.display())]
    Network {
        /// The model.
        path: PathBuf,
        /// Defect, and remedy.
        reason: String,
    },
    /// A file of optical flow cannot be read.
    #[error("{}: {error}", path.display())]
    NoFlow {
        /// The file.
        path: PathBuf,
        /// The system's error.
        error: std::io::Error,
    },
    /// A file of optical flow is damaged or does not fit.
    #[error("{}: {reason}", path.display())]
    Flow {
        /// The file.
        path: PathBuf,
        /// Defect of the file.
        reason: String,
    },
}
