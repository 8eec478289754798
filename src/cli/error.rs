//! Errors of the command line.

use std::path::PathBuf;

use super::remedy;
use crate::{
    auto::AutoError, download::DownloadError, prepare::PrepareError, run::RunError,
    store::StoreError, studio::StudioError, tradeoff::TradeoffError, view::ViewerError,
};

/// Error of a command; one line that names the file and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// A run.
    #[error("{}", remedy::of_run(.0))]
    Run(#[from] RunError),
    /// A file or a folder.
    #[error("{}", remedy::of_store(.0))]
    Store(#[from] StoreError),
    /// A sweep.
    #[error("{}", remedy::of_sweep(.0))]
    Tradeoff(#[from] TradeoffError),
    /// A scene cannot be shown.
    #[error("{}", remedy::of_viewer(.0))]
    Viewer(#[from] ViewerError),
    /// The studio's folder.
    #[error(transparent)]
    Studio(#[from] StudioError),
    /// A film or photos could not be prepared.
    #[error("{}", remedy::of_preparing(.0))]
    Prepare(#[from] PrepareError),
    /// A step of the whole failed.
    #[error("{}", remedy::of_auto(.0))]
    Auto(#[from] AutoError),
    /// A network was not fetched.
    #[error("{}", remedy::of_download(error, by_hand.as_ref()))]
    Fetch {
        /// Error of the download.
        error: DownloadError,
        /// The URL to fetch by hand, and where to put the file.
        by_hand: Option<(String, PathBuf)>,
    },
    /// A network needs consent to its license, and standard input is no terminal.
    #[error("{name} is given away under {license}: give --yes to fetch it without a terminal")]
    NobodyToAsk {
        /// The network.
        name: String,
        /// Its license.
        license: String,
    },
    /// The device computes something else than the reference.
    #[error(
        "{failed} of {checks} checks fail on {adapter}: update its driver, or choose another adapter with WGPU_ADAPTER_NAME, and please report the output of `gs-chroma doctor --json`"
    )]
    Unsound {
        /// Checks that failed.
        failed: usize,
        /// Checks in all.
        checks: usize,
        /// The adapter's name.
        adapter: String,
    },
}
