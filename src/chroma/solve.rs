//! Stage 2 as a whole: one of the solvers, and color for what no view shows.

use std::ops::ControlFlow;

use serde::{Deserialize, Serialize};

use super::{
    AdamSolver, ChromaError, ChromaSettings, FrozenViews, IrlsSolver, Targets, Task, fill_unseen,
};
use crate::{
    raster::Load,
    splats::{ShField, Splats},
};

/// How chroma is solved for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SolverKind {
    /// Reweighted least squares over all views, sped up by L-BFGS.
    Irls,
    /// The paper's: stochastic steps of Adam, coarse to fine.
    Adam,
}

impl SolverKind {
    /// Its name in reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Irls => "irls",
            Self::Adam => "adam",
        }
    }
}

/// How far a distillation is.
#[derive(Clone, Copy, Debug)]
pub struct ChromaProgress {
    /// Iterations of Adam, or rounds of reweighting, done.
    pub iteration: usize,
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

/// What a distillation found.
pub struct Solved {
    /// The chroma of each Gaussian.
    pub chroma: ShField,
    /// What a dispatch worked on, the mean over the passes.
    pub load: Load,
}

/// Distills the wanted a/b of `tasks` into chroma harmonics of the frozen geometry, that of
/// `luma`.
///
/// # Errors
/// [`ChromaError::NoViews`] without tasks, [`ChromaError::WrongSize`] when a target has
/// not its camera's size, [`ChromaError::Gpu`], [`ChromaError::Spill`].
pub fn solve(
    frozen: &FrozenViews,
    settings: &ChromaSettings,
    targets: &Targets,
    tasks: Vec<Task>,
    luma: &Splats,
    observe: &mut ChromaObserver<'_>,
) -> Result<Solved, ChromaError> {
    match settings.solver {
        SolverKind::Adam => {
            let mut adam = AdamSolver::new(frozen, settings.clone(), targets, tasks)?;
            adam.run(observe)?;
            Ok(Solved {
                chroma: adam.chroma()?,
                load: adam.load(),
            })
        }
        SolverKind::Irls => {
            let mut solver = IrlsSolver::new(frozen, settings, targets, tasks)?;
            solver.run(observe)?;
            let mut chroma = solver.chroma()?;
            if settings.fill {
                fill_unseen(luma, &mut chroma, &solver.seen()?);
            }
            Ok(Solved {
                chroma,
                load: solver.load(),
            })
        }
    }
}
