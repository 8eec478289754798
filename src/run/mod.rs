//! Whole runs: what a command does from its options to its files.

mod answers;
mod checkpoints;
mod color_checkpoint;
mod color_files;
mod color_source;
mod colorize;
mod commit;
mod eval;
mod event;
mod export;
mod export_clean;
mod export_viewer;
pub(crate) mod files;
mod film;
mod fingerprint;
mod fit;
mod flight;
pub(crate) mod folder;
mod foreign;
mod frames;
mod info;
mod live;
mod lock;
mod log;
mod look;
mod loss;
mod merge;
pub(crate) mod originals;
mod partition;
mod picture_names;
mod plan;
mod preset;
mod render;
mod scene;
mod seams;
mod sound;
mod stages;
mod teach;

use std::path::PathBuf;

pub use answers::HINT_WEIGHT;
pub use checkpoints::{CheckpointOptions, EVERY, Interrupt};
pub use color_files::Output;
pub use colorize::{ColorizeOptions, colorize};
pub use eval::{EvalOptions, eval};
pub(crate) use event::keeping;
pub use event::{Event, Observer, Stage};
pub use export::{ExportOptions, Exported, export};
pub use export_clean::Cleaned;
pub use export_viewer::Shown;
pub use film::is_film;
pub use fit::{AheadOptions, BlockPlace, FitOptions, Init, Overlay, fit};
pub use folder::RunFolder;
pub use frames::{Frames, FramesOptions, frames};
pub use info::info;
pub use live::{Live, LiveScene, LiveState};
pub use look::{Look, SceneKind};
pub use loss::Loss;
pub use merge::{MergeOptions, merge};
pub use partition::{PartitionOptions, partition};
pub(crate) use picture_names::picture_names;
pub use plan::{PlanOptions, Planned, plan};
pub use render::{PathOptions, RenderOptions, Rendered, Views, Way, render, render_path};
pub use seams::{SeamViews, ViewMean};
pub use sound::Soundness;
pub use teach::{TeachOptions, teacher_or_photos};

pub use crate::luma::Preset;
use crate::{
    blocks::BlocksError,
    capture::CaptureError,
    chroma::{ChromaError, teacher::TeacherError},
    effects::Contradiction,
    eval::EvalError,
    gpu::GpuError,
    luma::LumaError,
    programs::ProgramError,
    splats::SplatError,
    trajectory::TrajectoryError,
};

/// What can stop a run.
#[derive(Debug, thiserror::Error)]
pub enum RunError {
    /// The photos or their poses.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// Photos, poses and points, which contradict each other.
    #[error(transparent)]
    Unsound(#[from] Contradiction),
    /// The device failed or is missing.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Stage 2.
    #[error(transparent)]
    Chroma(ChromaError),
    /// A splat file.
    #[error(transparent)]
    Splats(#[from] SplatError),
    /// A teacher cannot be used.
    #[error(transparent)]
    Teacher(#[from] TeacherError),
    /// The file system.
    #[error("{}: {reason}", path.display())]
    File {
        /// File at fault.
        path: PathBuf,
        /// What is wrong with it and what to do.
        reason: String,
    },
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
    /// There is no run to go on with.
    #[error("no run under runs/")]
    NoRun,
    /// A splat file without cameras.
    #[error("{}: a splat file has no cameras", .0.display())]
    NoCameras(PathBuf),
    /// A splat file without Gaussians.
    #[error("{}: holds no Gaussians", .0.display())]
    NoSplats(PathBuf),
    /// A run without colors.
    #[error("{}: the run is not colored yet: run `gs-chroma colorize` first", .0.display())]
    NoColors(PathBuf),
    /// A program of others, such as FFmpeg.
    #[error(transparent)]
    Program(#[from] ProgramError),
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
        /// How far floats are apart there, in world units.
        step: f64,
        /// The Gaussians' size in world units.
        size: f64,
    },
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
        /// Photos in all.
        photos: usize,
        /// One with a pose.
        example: String,
    },
    /// There are hints, but no paint.
    #[error("{}: nothing is painted on any photo: paint on one", .0.display())]
    NothingPainted(PathBuf),
    /// Photos that are to give the colors have none.
    #[error("{}: these photos are gray: name a teacher that colors them", .0.display())]
    GrayPhotos(PathBuf),
    /// The system does not let the program hear of signals.
    #[error("signals cannot be heeded: {0}")]
    Signals(String),
    /// Another process writes into the run, or reads it.
    #[error("{}: {holder}: wait for it, or choose another folder with -o", folder.display())]
    InUse {
        /// The run's folder.
        folder: PathBuf,
        /// Who it is, and what it does.
        holder: String,
    },
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
    /// Photos have other poses than when they were trained on.
    #[error(
        "{}: {moved} of {photos} photos have another pose or camera than when the scene was trained, such as {photo}", folder.display()
    )]
    OtherModel {
        /// The COLMAP folder.
        folder: PathBuf,
        /// One of these photos.
        photo: String,
        /// How many there are.
        moved: usize,
        /// Photos in all.
        photos: usize,
    },
    /// A run's file is not the one that its report describes.
    #[error("{}: is not the file that this run wrote", .0.display())]
    OtherFile(PathBuf),
    /// There is no training that was interrupted.
    #[error("{}: nothing to continue: the run is finished", .0.display())]
    NothingToResume(PathBuf),
    /// A checkpoint of another training.
    #[error("{}: belongs to another training: {differs}", path.display())]
    OtherCheckpoint {
        /// Checkpoint at fault.
        path: PathBuf,
        /// What was otherwise.
        differs: String,
    },
    /// A training was ended from outside, and can go on.
    #[error("interrupted after iteration {iteration}; {} continues from there", path.display())]
    Interrupted {
        /// Iterations done.
        iteration: usize,
        /// Checkpoint at fault.
        path: PathBuf,
    },
    /// Nothing is left for stage 2.
    #[error("stage 1 already took {luma} iterations: choose a larger number")]
    NothingUntil {
        /// What was asked.
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
    /// A PSNR that was not reached; the best that was is written.
    #[error("{reached:.2} dB is what could be reached, and is written")]
    TargetMissed {
        /// What was asked for, in dB.
        target: f64,
        /// What was reached, in dB.
        reached: f64,
    },
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
