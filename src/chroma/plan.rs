//! Plan of the teacher effects that stage 2 models.

use serde::{Deserialize, Serialize};

use super::SolverKind;
use crate::effects::{Decider, Decision, Effect, TeacherSpread};

/// Degree of the chroma harmonics.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Degree {
    /// This one.
    Fixed(u32),
    /// As high as training views that are held back prove useful.
    Auto,
}

/// A higher degree must lower the loss on the views held back by this share: less is
/// within what the choice of these views amounts to.
pub const LEAST_GAIN: f64 = 0.03;

/// The degree that was chosen, and what each that was tried gave.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ChosenDegree {
    /// The lowest degree that no higher one beats by enough.
    pub degree: u32,
    /// Mean loss on the views held back, in CIELAB units, from degree 0 on.
    pub losses: Vec<f64>,
}

/// Views that differ by less, root mean square in CIELAB units, look alike.
const SPREAD: f64 = 1.0;

/// And they must differ by so many times what noise at the points makes of it.
const SPREAD_OVER_NOISE: f64 = 3.0;

/// Decision to align the views' teachers: on if they disagree about the same points in saturation
/// or tint, unless the user has a `wish`. Adam cannot.
pub(super) fn correction(
    found: Option<TeacherSpread>,
    solver: SolverKind,
    wish: Option<bool>,
) -> Decision {
    let noise = found.map_or(0.0, |found| SPREAD_OVER_NOISE * found.noise);
    let evidence = found.map(|found| found.spread);
    let decision = Decision::new(Effect::TeacherCorrection, evidence, SPREAD.max(noise));
    match (solver, wish) {
        (SolverKind::Adam, _) => Decision {
            on: false,
            decided_by: Decider::Preset,
            ..decision
        },
        (SolverKind::Irls, Some(on)) => Decision {
            on,
            decided_by: Decider::User,
            ..decision
        },
        // Where no point is seen twice, teachers are taken to disagree: most do.
        (SolverKind::Irls, None) if evidence.is_none() => Decision {
            on: true,
            decided_by: Decider::Preset,
            ..decision
        },
        (SolverKind::Irls, None) => decision,
    }
}

/// Decision that chroma depends on the view direction: by the gain on held-back views, in percent
/// of their loss, if it was measured.
pub(super) fn degree(asked: Degree, chosen: Option<&ChosenDegree>) -> Decision {
    let gain = chosen.and_then(|chosen| {
        let first = *chosen.losses.first()?;
        let best = chosen.losses.iter().copied().fold(first, f64::min);
        Some(100.0 * (1.0 - best / first))
    });
    let threshold = 100.0 * LEAST_GAIN;
    let decision = Decision::new(Effect::ChromaDegree, gain, threshold);
    match (asked, chosen) {
        (_, Some(chosen)) => Decision {
            on: chosen.degree > 0,
            ..decision
        },
        (Degree::Fixed(degree), None) => Decision {
            on: degree > 0,
            decided_by: if degree > 0 {
                Decider::User
            } else {
                Decider::Preset
            },
            ..decision
        },
        (Degree::Auto, None) => decision,
    }
}
