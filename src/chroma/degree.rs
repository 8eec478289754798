//! Choice of the chroma harmonics' degree by held-back views.

use std::ops::ControlFlow;

use super::{
    ChosenDegree, ChromaError, ChromaProgress, ChromaSettings, FrozenField, IrlsSolver, LEAST_GAIN,
    Targets, Task, solve,
};
use crate::splats::sh;

/// Every so many views are held back to judge by.
const HELD_BACK: usize = 5;

/// Distills most of `tasks` at degree 0, 1 and so on, as long as those held back gain.
/// Fewer than two tasks prove nothing: degree 0. `observe` is told of the degree as well.
///
/// # Errors
/// As [`solve`].
pub fn choose_degree(
    frozen: &dyn FrozenField,
    settings: &ChromaSettings,
    targets: &Targets,
    tasks: &[Task],
    observe: &mut dyn FnMut(u32, ChromaProgress) -> ControlFlow<()>,
) -> Result<ChosenDegree, ChromaError> {
    let (mut kept, mut held_back) = (Vec::new(), Vec::new());
    for (i, &task) in tasks.iter().enumerate() {
        let to = if i % HELD_BACK == HELD_BACK / 2 {
            &mut held_back
        } else {
            &mut kept
        };
        to.push(task);
    }
    let mut losses: Vec<f64> = Vec::new();
    if kept.is_empty() || held_back.is_empty() {
        return Ok(ChosenDegree { degree: 0, losses });
    }
    for degree in 0..=sh::MAX_DEGREE {
        let settings = ChromaSettings {
            sh_degree: degree,
            ..settings.clone()
        };
        let observe = &mut |progress| observe(degree, progress);
        let found = solve(frozen, &settings, targets, kept.clone(), observe)?;
        let mut judge = IrlsSolver::new(frozen, &settings, targets, held_back.clone())?;
        let loss = judge.objective(&found.chroma)?;
        let gains = (losses.last()).is_none_or(|before| loss < before * (1.0 - LEAST_GAIN));
        losses.push(loss);
        if !gains {
            return Ok(ChosenDegree {
                degree: degree - 1,
                losses,
            });
        }
    }
    Ok(ChosenDegree {
        degree: sh::MAX_DEGREE,
        losses,
    })
}
