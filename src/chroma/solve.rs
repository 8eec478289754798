//! Stage 2 as a whole: one of the solvers, and color for what no view shows.

use super::{
    AdamSolver, ChromaError, ChromaObserver, ChromaSettings, Correction, FrozenField, IrlsSolver,
    SolverKind, Targets, Task,
    checkpoint::{Interruptible, SolverState},
    fill_unseen,
};
use crate::{raster::Load, splats::ShField};

/// Result of a distillation.
pub struct Solved {
    /// The chroma of each Gaussian.
    pub chroma: ShField,
    /// Corrections that bring each view into line with the others, where they were asked for.
    pub corrections: Vec<(Task, Correction)>,
    /// Work of a dispatch, the mean over the passes.
    pub load: Load,
    /// In how many pixels of all views each Gaussian shows, `[N]`; `None` of Adam, which does not
    /// know.
    pub seen: Option<Vec<f32>>,
}

/// Gaussians that views show in fewer pixels than this are hardly seen.
pub(super) const SEEN: f32 = 0.5;

/// Share of the Gaussians that no view shows to speak of, whose colors come from their neighbors
/// if from anywhere; `seen` as in [`Solved`].
pub fn unseen_share(seen: &[f32]) -> f64 {
    let unseen = seen.iter().filter(|&&seen| seen < SEEN).count();
    unseen as f64 / seen.len().max(1) as f64
}

/// Distills the wanted a/b of `tasks` into chroma harmonics of the frozen geometry.
///
/// # Errors
/// [`ChromaError::NoViews`] without tasks, [`ChromaError::WrongSize`] when a target has
/// not its camera's size, [`ChromaError::Gpu`], [`ChromaError::Spill`].
pub fn solve(
    frozen: &dyn FrozenField,
    settings: &ChromaSettings,
    targets: &Targets,
    tasks: Vec<Task>,
    observe: &mut ChromaObserver<'_>,
) -> Result<Solved, ChromaError> {
    solve_from(
        (None, &mut |_| Ok(true)),
        frozen,
        settings,
        targets,
        tasks,
        observe,
    )
}

/// State to go on from, and the call after each round.
pub(super) type Between<'a> = (
    Option<&'a SolverState>,
    &'a mut dyn FnMut(&mut dyn Interruptible) -> Result<bool, ChromaError>,
);

/// [`solve`] that can be interrupted and go on.
pub(super) fn solve_from(
    between: Between<'_>,
    frozen: &dyn FrozenField,
    settings: &ChromaSettings,
    targets: &Targets,
    tasks: Vec<Task>,
    observe: &mut ChromaObserver<'_>,
) -> Result<Solved, ChromaError> {
    match settings.solver {
        SolverKind::Adam => {
            let mut adam = AdamSolver::new(frozen, settings.clone(), targets, tasks)?;
            run(&mut adam, between, observe)?;
            Ok(Solved {
                chroma: adam.harmonics()?,
                corrections: Vec::new(),
                load: adam.load(),
                seen: None,
            })
        }
        SolverKind::Irls => {
            let mut solver = IrlsSolver::new(frozen, settings, targets, tasks)?;
            run(&mut solver, between, observe)?;
            let mut chroma = solver.chroma()?;
            let seen = solver.seen()?;
            if settings.fill {
                fill_unseen(frozen.primitives(), &mut chroma, &seen);
            }
            Ok(Solved {
                chroma,
                corrections: match settings.correct_views {
                    true => solver.corrections()?,
                    false => Vec::new(),
                },
                load: solver.load(),
                seen: Some(seen),
            })
        }
    }
}

/// Runs a solver to its last round.
fn run(
    solver: &mut dyn Interruptible,
    (from, between): Between<'_>,
    observe: &mut ChromaObserver<'_>,
) -> Result<(), ChromaError> {
    if from.is_some_and(|state| !solver.go_on_from(state)) {
        return Err(ChromaError::OtherCheckpoint);
    }
    while solver.go_on(observe)? {
        if !between(solver)? {
            return Err(ChromaError::Cancelled);
        }
    }
    Ok(())
}
