//! Whole runs: what a command does from its options to its files.

mod against;
mod answers;
mod colorize;
mod eval;
mod export;
mod export_clean;
mod export_viewer;
mod fit;
mod flight;
mod frames;
mod info;
mod loss;
mod merge;
mod partition;
mod plan;
mod preset;
mod render;
mod seams;
mod stages;
mod teach;
mod teacher_command;
mod viewed;

use std::path::PathBuf;

pub use colorize::{ColorizeRequest, colorize};
pub use eval::{EvalOptions, eval};
pub use export::{ExportOptions, Exported, export};
pub use export_clean::Cleaned;
pub use export_viewer::ViewerCameras;
pub use fit::{FitRequest, Init, fit};
#[cfg(test)]
pub(crate) use frames::ChangeReport;
pub use frames::{Frames, FramesOptions, frames};
pub(crate) use frames::{PlainFramesOptions, frames_without_scene};
pub use info::info;
pub use loss::Loss;
pub use merge::{MergeOptions, merge};
pub use partition::{PartitionOptions, partition};
pub use plan::{PlanOptions, PlanReport, plan};
pub use render::{PathOptions, PathShape, RenderOptions, Rendered, Views, render, render_path};
pub use seams::{SeamViews, ViewMean};
pub(crate) use teach::Teachers;
pub use teach::{TeachOptions, teacher_or_photos};
pub use teacher_command::TeacherCommand;
pub use viewed::ViewedScene;

pub use crate::luma::Preset;
use crate::{
    blocks::BlocksError,
    capture::CaptureError,
    chroma::{ChromaError, teacher::TeacherError},
    eval::EvalError,
    gpu::GpuError,
    luma::LumaError,
    programs::ProgramError,
    splats::SplatError,
    store::StoreError,
    subject::SubjectError,
    trajectory::TrajectoryError,
};

/// Error of a command.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// A file or a folder.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The scene, its photos or the device.
    #[error(transparent)]
    Subject(#[from] SubjectError),
    /// Stage 2.
    #[error(transparent)]
    Chroma(ChromaError),
    /// A teacher cannot be used.
    #[error(transparent)]
    Teacher(#[from] TeacherError),
    /// Blocks of a scene.
    #[error(transparent)]
    Blocks(BlocksError),
    /// Training failed.
    #[error(transparent)]
    Luma(LumaError),
    /// Measuring failed.
    #[error(transparent)]
    Eval(EvalError),
    /// A camera path.
    #[error(transparent)]
    Trajectory(#[from] TrajectoryError),
    /// A program of others, such as FFmpeg.
    #[error(transparent)]
    Program(#[from] ProgramError),
    /// A command line is none.
    #[error("{0}")]
    Command(String),
    /// The program that colors photos has written no such picture.
    #[error("{program}: {picture}: {reason}")]
    NoPicture {
        /// The program, as it was started.
        program: String,
        /// Name of the picture.
        picture: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Coordinates that are too large for a splat file.
    #[error(
        "{}: not written: near {coordinate} 32-bit floats are {step} apart, {:.2} times the size of the Gaussians (the median of their smallest scales is {size:.4})",
        path.display(), step / size
    )]
    Coarse {
        /// The file that was to be written.
        path: PathBuf,
        /// The largest of the coordinates.
        coordinate: f64,
        /// Spacing of floats there, in world units.
        step: f64,
        /// The Gaussians' size in world units.
        size: f64,
    },
    /// A folder that is to go on among its neighbors.
    #[error("{}: is no trained block of a job", .0.display())]
    NoTrainedBlock(PathBuf),
    /// All views were trained on.
    #[error("no view is held out")]
    NoHeldOut,
    /// The teacher has no picture for any view that counts.
    #[error("{}: no image of it has the name of a photo (such as {example}): name its images like the photos", teacher.display())]
    TeacherCoversNothing {
        /// The teacher's folder.
        teacher: PathBuf,
        /// A photo's name.
        example: String,
    },
    /// COLMAP gave no pose to any photo that is painted or colored.
    #[error("{}: its images belong to {named}, and COLMAP placed none of these; it placed {placed} of {photos} photos, such as {example}: paint on one of those", folder.display())]
    NotPlaced {
        /// The folder of images.
        folder: PathBuf,
        /// A photo without a pose that one of them belongs to, and how many more.
        named: String,
        /// Photos with a pose.
        placed: usize,
        photos: usize,
        /// One with a pose.
        example: String,
    },
    /// A name that something else has that is measured.
    #[error("{0}: names something else that is measured: choose another name")]
    NameTaken(String),
    /// There are hints, but no paint.
    #[error("{}: nothing is painted on any photo: paint on one", .0.display())]
    NothingPainted(PathBuf),
    /// Photos that are to give the colors have none.
    #[error("{}: these photos are gray: name a teacher that colors them", .0.display())]
    GrayPhotos(PathBuf),
    /// The system does not let the program hear of signals.
    #[error("signals cannot be heeded: {0}")]
    Signals(String),
    /// No interrupted training exists.
    #[error("{}: nothing to continue: the run is finished", .0.display())]
    NothingToResume(PathBuf),
    /// Nothing is left for stage 2.
    #[error("stage 1 already took {luma} iterations: choose a larger number")]
    NothingUntil {
        /// Requested last iteration.
        until: usize,
        /// Iterations of stage 1.
        luma: usize,
    },
    /// A time limit within which nothing can be trained.
    #[error(
        "reading, measuring and {} iterations take longer: give at least {:.2} minutes",
        iterations, needed / 60.0
    )]
    TimeTooShort {
        /// Seconds allowed.
        limit: f64,
        /// The fewest iterations that make sense.
        iterations: usize,
        /// Seconds that would do.
        needed: f64,
    },
    /// The PSNR target was not reached; the best scene is written.
    #[error("{reached:.2} dB is what could be reached, and is written")]
    TargetMissed {
        /// Target, in dB.
        target: f64,
        /// Reached PSNR, in dB.
        reached: f64,
    },
}

impl From<CaptureError> for RunError {
    fn from(error: CaptureError) -> Self {
        Self::Subject(error.into())
    }
}

impl From<GpuError> for RunError {
    fn from(error: GpuError) -> Self {
        Self::Subject(error.into())
    }
}

impl From<SplatError> for RunError {
    fn from(error: SplatError) -> Self {
        Self::Subject(error.into())
    }
}

impl From<ChromaError> for RunError {
    fn from(error: ChromaError) -> Self {
        match error {
            ChromaError::Gpu(error) => error.into(),
            ChromaError::Capture(error) => error.into(),
            ChromaError::Colorizer(error) => match error.downcast::<TeacherError>() {
                Ok(error) => Self::Teacher(*error),
                Err(error) => Self::Chroma(ChromaError::Colorizer(error)),
            },
            other => Self::Chroma(other),
        }
    }
}

impl From<EvalError> for RunError {
    fn from(error: EvalError) -> Self {
        match error {
            EvalError::Capture(error) => error.into(),
            EvalError::Gpu(error) => error.into(),
            EvalError::Chroma(error) => error.into(),
            EvalError::Teacher(error) => error.into(),
            other => Self::Eval(other),
        }
    }
}

impl From<LumaError> for RunError {
    fn from(error: LumaError) -> Self {
        match error {
            LumaError::Gpu(error) => error.into(),
            LumaError::Capture(error) => error.into(),
            other => Self::Luma(other),
        }
    }
}
