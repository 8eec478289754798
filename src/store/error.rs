//! Errors of files and folders.

use std::path::{Path, PathBuf};

use crate::{programs::ProgramError, splats::SplatError};

/// Error of a file or a folder.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file system, or what a file holds.
    #[error("{}: {reason}", path.display())]
    File {
        /// File at fault.
        path: PathBuf,
        /// The problem and the remedy.
        reason: String,
    },
    /// A splat file's name.
    #[error(transparent)]
    Splats(#[from] SplatError),
    /// A program of others, such as FFmpeg.
    #[error(transparent)]
    Program(#[from] ProgramError),
    /// Results of a film of several shots, each of which has a run of its own.
    #[error("{}: holds a run for each shot; name one: {}", folder.display(), listed(runs))]
    SeveralRuns {
        /// The folder of the results.
        folder: PathBuf,
        /// The shots' runs, in order.
        runs: Vec<PathBuf>,
    },
    /// There is no run to go on with.
    #[error("no run under runs/")]
    NoRun,
    /// Another process writes into the run, or reads it.
    #[error("{}: {holder}: wait for it, or choose another folder with -o", folder.display())]
    InUse {
        /// The run's folder.
        folder: PathBuf,
        /// The other process, and its use of the folder.
        holder: String,
    },
    /// Photos have other poses than when they were trained on.
    #[error(
        "{}: {moved} of {photos} photos have another pose or camera than when the scene was trained, such as {photo}", folder.display()
    )]
    OtherModel {
        /// The COLMAP folder.
        folder: PathBuf,
        photo: String,
        /// Number of photos that moved.
        moved: usize,
        photos: usize,
    },
    /// A run's file is not the one that its report describes.
    #[error("{}: is not the file that this run wrote", .0.display())]
    OtherFile(PathBuf),
    /// A checkpoint of another training.
    #[error("{}: belongs to another training: {differs}", path.display())]
    OtherCheckpoint {
        /// Checkpoint at fault.
        path: PathBuf,
        /// Differences, by name.
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
}

/// Paths in one line.
fn listed(paths: &[PathBuf]) -> String {
    let paths = paths.iter().map(|path| path.display().to_string());
    paths.collect::<Vec<_>>().join(", ")
}

impl StoreError {
    /// A file that is wrong for a reason.
    pub(crate) fn file(path: &Path, reason: impl Into<String>) -> Self {
        Self::File {
            path: path.to_owned(),
            reason: reason.into(),
        }
    }
}
