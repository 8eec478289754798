//! A request to sweep, its errors and the names of its files.

use std::path::PathBuf;

use crate::{run::RunError, store::StoreError};

/// A request to sweep.
pub struct TradeoffOptions {
    /// The COLMAP folder.
    pub colmap_dir: PathBuf,
    /// Folder for the points and the results; `runs/<folder name>-tradeoff` by default.
    pub output: Option<PathBuf>,
    /// Options of every `fit`, as words of a command line: they make the base.
    pub fit: Vec<String>,
    /// The teacher, for points in color.
    pub teacher: Option<PathBuf>,
    /// Wall seconds that all points may take together; four times what the bases take by default.
    pub budget: Option<f64>,
    /// Names of the knobs to turn; empty for all.
    pub knobs: Vec<String>,
}

/// Error of a sweep.
#[derive(Debug, thiserror::Error)]
pub enum TradeoffError {
    /// The photos, the device or the file system.
    #[error(transparent)]
    Run(#[from] RunError),
    /// A file or a folder.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Nothing is held out, and quality cannot be weighed against time.
    #[error("{}: no view is held out to measure on: leave --no-holdout out, or name a folder with more photos", .0.display())]
    NothingToMeasure(PathBuf),
    /// A base, which all other points are compared with, failed.
    #[error("{point}, which all other points are compared with, failed: {reason}")]
    Base {
        /// Name of the point, also of its folder.
        point: String,
        /// Message of the program.
        reason: String,
    },
}

/// Files of `tradeoff`, beside the points' folders.
pub const FILES: [&str; 2] = ["tradeoff.json", "tradeoff.html"];

/// The folder of the points' folders.
pub(super) const POINTS: &str = "points";
