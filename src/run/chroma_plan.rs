//! Which effects of teachers stage 2 reckons with.

use super::{
    chroma_options::{ChromaOptions, Degree},
    scene::Scene,
    teach::Taught,
};
use crate::{
    capture::Camera,
    chroma::{ChosenDegree, SolverKind},
    effects::{Decider, Decision, Effect, teacher_spread},
};

/// Views that differ by less, root mean square in CIELAB units, look alike.
const SPREAD: f64 = 1.0;

/// And they must differ by so many times what noise at the points makes of it.
const SPREAD_OVER_NOISE: f64 = 3.0;

/// Whether the views' teachers are brought into line: where they disagree about the same
/// points in saturation or tint, unless the options say. Adam cannot.
pub(super) fn correction(
    scene: &Scene,
    taught: &[Option<Taught>],
    options: &ChromaOptions,
) -> Decision {
    let cameras: Vec<&Camera> = scene.photos.iter().map(|(_, camera)| camera).collect();
    let answers: Vec<Option<&[[f32; 2]]>> = (taught.iter().enumerate())
        .map(|(view, taught)| {
            let trained = scene.split.train.contains(&view);
            let taught = taught.as_ref().filter(|_| trained)?;
            Some(&taught.answer.ab[..])
        })
        .collect();
    let found = teacher_spread(&scene.capture, &cameras, &answers);
    let noise = found.map_or(0.0, |found| SPREAD_OVER_NOISE * found.noise);
    let evidence = found.map(|found| found.spread);
    let decision = Decision::new(Effect::TeacherCorrection, evidence, SPREAD.max(noise));
    match (options.solver, options.correct_views) {
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

/// Whether chroma depends on the direction of view: as the views that were held back
/// say, in percent of their loss, where they were asked.
pub(super) fn degree(options: &ChromaOptions, chosen: Option<&ChosenDegree>) -> Decision {
    let gain = chosen.and_then(|chosen| {
        let first = *chosen.losses.first()?;
        let best = chosen.losses.iter().copied().fold(first, f64::min);
        Some(100.0 * (1.0 - best / first))
    });
    let threshold = 100.0 * crate::chroma::LEAST_GAIN;
    let decision = Decision::new(Effect::ChromaDegree, gain, threshold);
    match (options.sh_degree, chosen) {
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
