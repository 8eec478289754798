//! What is reported about the effects of image formation.

use serde::{Deserialize, Serialize};

use crate::effects::{Decider, Decision, Effect};

/// What was decided about an effect, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EffectReport {
    /// Its name on the command line.
    pub name: Effect,
    /// Whether it is simulated.
    pub on: bool,
    /// The number that speaks for it, where the capture has one.
    pub evidence: Option<f64>,
    /// From this on it is called for.
    pub threshold: f64,
    /// What both count.
    pub unit: String,
    /// Who decided.
    pub decided_by: Decider,
    /// Per cent by which a short training fitted the photos better with it than without, where
    /// that was tried.
    pub trial: Option<f64>,
    /// What it costs while it is on.
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
