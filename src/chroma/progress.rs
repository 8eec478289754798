//! Progress of a solver.

use serde::{Deserialize, Serialize};
use std::ops::ControlFlow;

/// Progress of a distillation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChromaProgress {
    /// Iterations of Adam, or rounds of reweighting, done.
    pub iteration: usize,
    /// Iterations or rounds in all.
    pub total: usize,
    /// Mean loss of a pixel in CIELAB units: of Adam at full size since the last report, of
    /// least squares the least so far.
    pub loss: f64,
    /// Mean change of the colors by the last step of least squares, in CIELAB units, weighted as in
    /// the loss. `None` if the step was undone, and with Adam.
    pub moved: Option<f64>,
    /// Drawings of a view with their adjoints, those of coarser scales by their share of
    /// the pixels.
    pub passes: f64,
    /// Seconds since the distillation began.
    pub seconds: f64,
}

/// Receiver of progress; a [`ControlFlow::Break`] ends the distillation with
/// [`ChromaError::Cancelled`](super::ChromaError::Cancelled).
pub type ChromaObserver<'a> = dyn FnMut(ChromaProgress) -> ControlFlow<()> + 'a;
