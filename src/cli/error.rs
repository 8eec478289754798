//! What can stop the program.

use super::remedy;
use crate::{run::RunError, tradeoff::TradeoffError};

/// What stopped a command; one line that names the file and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum CliError {
    /// A run.
    #[error("{}", remedy::of_run(.0))]
    Run(#[from] RunError),
    /// A sweep.
    #[error("{}", remedy::of_sweep(.0))]
    Tradeoff(#[from] TradeoffError),
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
