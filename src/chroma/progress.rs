//! What a solver tells of itself.

use std::ops::ControlFlow;

/// How far a distillation is.
#[derive(Clone, Copy, Debug)]
pub struct ChromaProgress {
    /// Iterations of Adam, or rounds of reweighting, done.
    pub iteration: usize,
    /// Of them in all.
    pub total: usize,
    /// Mean loss of the finest scale in use, in CIELAB units: since the last report, or
    /// at the start of the round.
    pub loss: f64,
    /// Drawings of a view with their adjoints, those of coarser scales by their share of
    /// the pixels.
    pub passes: f64,
    /// Seconds since the distillation began.
    pub seconds: f64,
}

/// Who is told; a [`ControlFlow::Break`] ends it with [`ChromaError::Cancelled`].
pub type ChromaObserver<'a> = dyn FnMut(ChromaProgress) -> ControlFlow<()> + 'a;

/// What a pass over one scale is of a pass at full size.
pub(super) fn share(scale: usize) -> f64 {
    0.25_f64.powi(scale as i32)
}
