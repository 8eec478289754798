//! Report of the effects of image formation.

use serde::{Deserialize, Serialize};

use crate::effects::{Decider, Decision, Effect};

/// Decision about an effect, and its reasons.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct EffectReport {
    /// As for `--with` and `--without`.
    pub name: Effect,
    /// True if it was simulated.
    pub on: bool,
    /// Figure that decides, if the capture has one.
    pub evidence: Option<f64>,
    /// Evidence above which it is simulated.
    pub threshold: f64,
    /// Unit of evidence and threshold.
    pub unit: String,
    /// Source of the decision.
    pub decided_by: Decider,
    /// Gain of a short training on views held back, in dB.
    ///
    /// `None` without a trial.
    pub trial: Option<f64>,
    /// Cost of simulating it.
    pub cost: String,
}

impl EffectReport {
    /// Everything that was decided.
    pub fn of(decisions: &[Decision]) -> Vec<Self> {
        (decisions.iter())
            .map(|decision| Self {
                name: decision.effect,
                on: decision.on,
                evidence: decision.evidence,
                threshold: decision.threshold,
                unit: decision.effect.unit().to_owned(),
                decided_by: decision.decided_by,
                trial: decision.trial,
                cost: decision.effect.cost().to_owned(),
            })
            .collect()
    }
}
