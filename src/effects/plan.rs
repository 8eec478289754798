//! Decision on each effect from its evidence.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{direction, evidence::Evidence, tracks};
use crate::capture::{Choice, Exposure, IMPERCEPTIBLE};

/// Exposures that move what the views show by less, root mean square in gray levels, are
/// invisible beside what any scene is missed by.
const EXPOSURE_LEVELS: f64 = 2.0;

/// And they must exceed what noise alone would make of them by this factor.
const EXPOSURE_OVER_NOISE: f64 = 3.0;

/// dB that an effect must gain on views held back from a trial: less is within what another seed
/// changes, and an effect that gains nothing does harm elsewhere.
const TRIAL_GAIN: f64 = 0.1;

/// The same of exposures: in the smallest trial those that `banana-object`'s points pretend gain
/// 0.17 dB, where a whole draft loses 0.3 by them.
const TRIAL_GAIN_OF_EXPOSURES: f64 = 0.3;

/// Share of places at which one view disagrees with all others from which on photos are
/// taken to have defects: clean photos stay below 0.13 %, 1.5 % of dust gives 0.24 to 3 %
/// (docs/decisions/effects.md).
const OUTLIER_SHARE: f64 = 0.002;

/// In a shorter run most of what is far off is only not learned yet, and leaving it out
/// costs more than the defects do (docs/decisions/effects.md).
pub(super) const ROBUST_ITERATIONS: usize = 1_200;

/// Ratio of the sampling rates of near and far views from which on a blur of one size
/// makes far views too thick or near ones too faint: an octave. Below 1.5 it gains nothing at
/// full size, at 4.9 it does (docs/experiments.md).
const SAMPLING_SPREAD: f64 = 2.0;

/// Share of the photos' area from which on something behind the scene may be worth Gaussians;
/// with 0.26 % `caliterra-drone` gains 0.5 dB, with 0.14 % the bundled scene loses 0.1.
const BACKGROUND_SHARE: f64 = 0.002;

/// Luma that the view direction must explain in a short run, root mean square in gray levels: matt
/// scenes show 2 to 4, for perspective slightly changes what a pixel covers.
const DIRECTION_LEVELS: f64 = 5.0;

/// And in a run of as many iterations, which learns from less: on eight of nine scenes with more
/// than this, matt ones too, it gained 0.02 to 0.22 dB, on one it lost 0.01.
const LONG_RUN: usize = 2_400;
const DIRECTION_LEVELS_LONG: f64 = 2.0;

/// A higher degree must explain so much more, in gray levels, to be worth its memory.
const DEGREE_LEVELS: f64 = 1.0;

/// Gain of each effect in trials, in dB of corrected PSNR on held-out views.
pub type Trials = BTreeMap<Effect, f64>;

/// An effect of image formation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Effect {
    /// The lens bends straight lines.
    Lens,
    /// Some pixels of the photos do not count.
    Masks,
    /// Photos differ in exposure, or flicker.
    Exposure,
    /// Photos show dust, scratches or passers-by.
    Robust,
    /// Views show the same places from near and from far.
    Antialias,
    /// Photos show what no point explains, such as the sky.
    Background,
    /// Luma depends on the direction of view.
    LumaDegree,
    /// The teacher's views differ in saturation and tint.
    TeacherCorrection,
    /// Chroma depends on the direction of view.
    ChromaDegree,
}

serde_plain::derive_display_from_serialize!(Effect);

impl Effect {
    /// Those of stage 1, in the order of the table.
    pub const ALL: [Self; 7] = [
        Self::Lens,
        Self::Masks,
        Self::Exposure,
        Self::Robust,
        Self::Antialias,
        Self::Background,
        Self::LumaDegree,
    ];

    /// Unit of the evidence.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Lens => "pixels of lens distortion",
            Self::Masks => "% of pixels masked",
            Self::Exposure => "gray levels between views",
            Self::Robust => "% of places that differ",
            Self::Antialias => "times finer from near than from far",
            Self::Background => "% of the photos far behind all points",
            Self::LumaDegree => "gray levels by direction",
            Self::TeacherCorrection => "CIELAB units between views",
            Self::ChromaDegree => "% of the loss on views held back",
        }
    }

    /// dB that it must gain in a trial.
    pub fn trial_gain(self) -> f64 {
        match self {
            Self::Exposure => TRIAL_GAIN_OF_EXPOSURES,
            _ => TRIAL_GAIN,
        }
    }

    /// From which evidence on it is called for, whatever a trial would say. Below, points may
    /// mislead: most of them may lie on something that shines otherwise from every side, or the
    /// little that is far behind may cost more Gaussians than it is worth. `None`: its evidence
    /// is always believed, for a mistake costs next to nothing, or a trial could not tell.
    fn sure_from(self) -> Option<f64> {
        match self {
            Self::Exposure => Some(8.0),
            Self::Background => Some(10.0),
            // It has to pay in viewers that do not antialias, which is never sure.
            Self::Antialias => Some(f64::INFINITY),
            // Harmonics: only long runs learn them:
            // trials said -0.06 to 0.04 dB of what gained up to 0.14. Outliers: what is far off is
            // told from what is not learned yet in long runs only, and a wrong decision costs
            // 0.05 dB (docs/experiments.md).
            _ => None,
        }
    }

    /// Cost while it is on (docs/effects.md).
    pub fn cost(self) -> &'static str {
        match self {
            Self::Lens => "nothing once photos are read",
            Self::Masks => "one byte a pixel",
            Self::Exposure => "16 bytes",
            Self::Robust => "one byte a pixel, and twice three drawings of each photo",
            Self::Antialias => "needs a viewer with Mip-Splatting support",
            Self::Background => "at most a quarter of the Gaussians",
            Self::TeacherCorrection => "a sum over each view a round",
            Self::ChromaDegree => "72, 192 or 360 bytes a Gaussian for degree 1, 2 or 3",
            Self::LumaDegree => "36, 96 or 180 bytes a Gaussian for degree 1, 2 or 3",
        }
    }
}

/// Source of a decision.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
pub enum Decider {
    /// The evidence against its threshold.
    Evidence,
    /// Short trainings with it and without, for the evidence leaves it open.
    Trial,
    /// `--with` or `--without`, or an option that says the same.
    User,
    /// The preset, which has no room for it.
    Preset,
}

/// Decision on an effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Decision {
    /// The effect.
    pub effect: Effect,
    /// True if it is simulated.
    pub on: bool,
    /// Evidence for it; `None` if the capture has none.
    pub evidence: Option<f64>,
    /// Threshold above which it is on.
    pub threshold: f64,
    /// Source of the decision.
    pub decided_by: Decider,
    /// dB that a short training gained with it on views held back, where that was tried.
    pub trial: Option<f64>,
}

impl Decision {
    /// Decision from the evidence alone.
    pub fn new(effect: Effect, evidence: Option<f64>, threshold: f64) -> Self {
        Self {
            effect,
            on: evidence.is_some_and(|evidence| evidence > threshold),
            evidence,
            threshold,
            decided_by: Decider::Evidence,
            trial: None,
        }
    }

    /// Decision after a trial, which runs only if the evidence is above its threshold.
    fn after(self, trials: &Trials) -> Self {
        match trials.get(&self.effect).copied() {
            Some(gain) => {
                let on = gain >= self.effect.trial_gain();
                Self {
                    trial: Some(gain),
                    ..self.by(Decider::Trial, on)
                }
            }
            None => self,
        }
    }

    /// The same after someone else decided.
    fn by(self, decided_by: Decider, on: bool) -> Self {
        Self {
            on,
            decided_by,
            ..self
        }
    }

    /// The same after the user has had a say.
    fn overruled(self, overrules: &Overrules) -> Self {
        match overrules.choice(self.effect) {
            Choice::Auto => self,
            choice => self.by(Decider::User, choice == Choice::On),
        }
    }
}

/// Budget of a training.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TrainingBudget {
    /// The highest degree of the luma harmonics.
    pub sh_degree: u32,
    /// Iterations.
    pub iterations: usize,
}

/// User overrides, regardless of the evidence.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Overrules {
    /// On.
    pub with: Vec<Effect>,
    /// Off.
    pub without: Vec<Effect>,
    /// Degree of the luma harmonics.
    pub sh_degree: Option<u32>,
}

impl Overrules {
    /// Override of an effect that is decided when photos are loaded.
    pub fn choice(&self, effect: Effect) -> Choice {
        if self.with.contains(&effect) {
            Choice::On
        } else if self.without.contains(&effect) {
            Choice::Off
        } else {
            Choice::Auto
        }
    }
}

/// Effects to simulate, and their parameters.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// About each effect, in the order of [`Effect::ALL`].
    pub decisions: Vec<Decision>,
    /// Exposure of each view of the capture; empty while the effect is off.
    pub exposures: Vec<Exposure>,
    /// Degree of the luma harmonics.
    pub sh_degree: u32,
}

impl Plan {
    /// The effects that are on by evidence that is not overwhelming.
    fn in_doubt(&self) -> Vec<Effect> {
        let doubtful = |decision: &&Decision| {
            let sure = decision.effect.sure_from().unwrap_or(f64::NEG_INFINITY);
            decision.on
                && decision.decided_by == Decider::Evidence
                && decision.evidence.is_some_and(|evidence| evidence < sure)
        };
        let doubtful = self.decisions.iter().filter(doubtful);
        doubtful.map(|decision| decision.effect).collect()
    }

    /// The same without an effect.
    pub fn without(mut self, effect: Effect) -> Self {
        let named = self.decisions.iter_mut().filter(|d| d.effect == effect);
        named.for_each(|decision| decision.on = false);
        match effect {
            Effect::Exposure => self.exposures.fill(Exposure::NONE),
            Effect::LumaDegree => self.sh_degree = 0,
            _ => {}
        }
        self
    }

    /// The same without antialiasing that no trial has confirmed: viewers may show it worse.
    pub fn confirmed(mut self) -> Self {
        for decision in &mut self.decisions {
            if decision.effect == Effect::Antialias && decision.decided_by == Decider::Evidence {
                decision.decided_by = match decision.on {
                    true => Decider::Preset,
                    false => Decider::Evidence,
                };
                decision.on = false;
            }
        }
        self
    }

    /// Returns true if an effect is simulated.
    pub fn has(&self, effect: Effect) -> bool {
        (self.decisions.iter()).any(|decision| decision.effect == effect && decision.on)
    }
}

impl Evidence {
    /// The effects of a plan of which short trainings should tell what the photos alone do not.
    /// Exposures that differ from photo to photo are none: what points pretend changes with the
    /// place from which they are seen.
    pub fn open(&self, plan: &Plan) -> Vec<Effect> {
        let mut open = plan.in_doubt();
        open.retain(|&effect| effect != Effect::Exposure || self.exposures.drifts);
        open
    }

    /// The plan that follows. `trials` are what trainings [that were asked for](Self::open) said.
    pub fn decide(&self, room: TrainingBudget, overrules: &Overrules, trials: &Trials) -> Plan {
        let mut found = self.exposures.clone();
        let exposure = {
            let evidence = (!self.samples.is_empty()).then_some(255.0 * found.spread);
            let noise = EXPOSURE_OVER_NOISE * 255.0 * found.noise;
            let decision = Decision::new(Effect::Exposure, evidence, EXPOSURE_LEVELS.max(noise));
            decision.after(trials).overruled(overrules)
        };
        if exposure.decided_by == Decider::Trial && !exposure.on {
            // What points show differently then has another reason.
            found.views.fill(Exposure::NONE);
        }
        let robust = {
            let evidence = self.midpoints.outlier_share(&found.views);
            let percent = evidence.map(|share| 100.0 * share);
            let decision = Decision::new(Effect::Robust, percent, 100.0 * OUTLIER_SHARE);
            match decision.on && room.iterations < ROBUST_ITERATIONS {
                true => decision.by(Decider::Preset, false),
                false => decision,
            }
        };
        let antialias = Decision::new(Effect::Antialias, self.sampling_spread, SAMPLING_SPREAD);
        let behind = 100.0 * self.behind;
        let background = Decision::new(Effect::Background, Some(behind), 100.0 * BACKGROUND_SHARE);
        let (degree, sh_degree) = degree(&self.samples, &found.views, room, overrules);
        let lens = Decision::new(Effect::Lens, Some(self.distortion), IMPERCEPTIBLE);
        let masks = Decision::new(Effect::Masks, self.masked, 0.0);
        Plan {
            exposures: match exposure.on {
                true => found.local,
                false => vec![Exposure::NONE; self.exposures.views.len()],
            },
            decisions: vec![
                lens.overruled(overrules),
                masks.overruled(overrules),
                exposure,
                robust.overruled(overrules),
                antialias.after(trials).overruled(overrules),
                background.after(trials).overruled(overrules),
                degree,
            ],
            sh_degree,
        }
    }
}

/// Decision on view-dependent luma, and the degree of its harmonics: at most that of the budget
/// unless the user overrides it.
fn degree(
    samples: &[Vec<tracks::Sample>],
    exposures: &[Exposure],
    room: TrainingBudget,
    overrules: &Overrules,
) -> (Decision, u32) {
    let explained = direction::left_out_errors(samples, exposures).map(|errors| {
        let [constant, ..] = errors;
        errors.map(|error| 255.0 * (constant * constant - error * error).max(0.0).sqrt())
    });
    let evidence = explained.map(|levels| levels.into_iter().fold(0.0, f64::max));
    let threshold = match room.iterations < LONG_RUN {
        true => DIRECTION_LEVELS,
        false => DIRECTION_LEVELS_LONG,
    };
    let room = room.sh_degree;
    let decision = Decision::new(Effect::LumaDegree, evidence, threshold);
    let wanted = explained.zip(evidence).map(|(levels, best)| {
        let nearly = |level: &f64| best - level <= DEGREE_LEVELS;
        match decision.on {
            true => levels.iter().position(nearly).unwrap_or(0) as u32,
            false => 0,
        }
    });
    let choice = overrules.choice(Effect::LumaDegree);
    let (degree, decided_by) = match (overrules.sh_degree, choice, wanted) {
        (Some(degree), ..) => (degree, Decider::User),
        (_, Choice::On, _) => (room.max(1), Decider::User),
        (_, Choice::Off, _) => (0, Decider::User),
        (_, Choice::Auto, Some(wanted)) if wanted <= room => (wanted, decision.decided_by),
        _ => (room, Decider::Preset),
    };
    (decision.by(decided_by, degree > 0), degree)
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
