//! A training on disk: all that decides how it goes on.

use std::{collections::BTreeMap, time::Duration};

use serde::{Deserialize, Serialize};

use super::{CurvePoint, Schedule, pace::Pace};
use crate::{
    effects::Plan,
    raster::{
        Load, Snapshot,
        constants::{STATISTICS_PLANES, STATUS_WORDS},
    },
    splats::Splats,
};

/// A training between two iterations. What goes on from it ends with the bytes of one that was
/// never interrupted.
#[derive(Clone, Debug, PartialEq)]
pub struct Checkpoint {
    pub(super) state: TrainingState,
    pub(super) model: Snapshot,
    /// Densification statistics since the set last changed.
    pub(super) statistics: Vec<f32>,
    /// The best set so far, while the training may go back to it.
    pub(super) best: Option<Snapshot>,
    /// Excluded pixels of some photos, one bit each.
    pub(super) left_out: Vec<(usize, Vec<u8>)>,
}

/// Scalar state of a training, stored as JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct TrainingState {
    /// Simulated effects; `None` without a plan.
    pub plan: Option<Plan>,
    /// Iterations done.
    pub iteration: usize,
    /// Seconds of training, those of watching included.
    pub seconds: f64,
    pub schedule: Schedule,
    pub longest: usize,
    pub pace: Pace,
    /// Iteration at which the device began to count steps, and what it has counted.
    pub base: usize,
    pub status: Vec<u32>,
    /// Entries of the tile lists.
    pub capacity: usize,
    pub next_look: usize,
    pub curve: Vec<CurvePoint>,
    pub watched_seconds: f64,
    /// [`Snapshot::held`] of the model and of the best set.
    #[serde(default)]
    pub held: [usize; 2],
    /// Iteration and PSNR of the best set.
    pub best: Option<(usize, f64)>,
    pub given_up: Option<usize>,
    pub seen: Load,
    pub reports: usize,
}

/// Receiver of checkpoints.
pub trait Checkpointing {
    /// Returns true if a checkpoint is due after this iteration.
    fn wants(&mut self, iteration: usize) -> bool;

    /// Takes one; `false` ends the training with [`LumaError::Cancelled`](super::LumaError).
    fn keep(&mut self, checkpoint: Checkpoint) -> bool;

    /// Returns true if a viewer is waiting for the Gaussians.
    fn looks_on(&mut self) -> bool {
        false
    }

    /// Takes them; reading them from the device took so long.
    fn show(&mut self, _splats: Splats, _took: Duration) {}
}

/// Keeps none.
pub struct NoCheckpoints;

impl Checkpointing for NoCheckpoints {
    fn wants(&mut self, _: usize) -> bool {
        false
    }

    fn keep(&mut self, _: Checkpoint) -> bool {
        true
    }
}

impl Checkpoint {
    /// Iterations done.
    pub fn iteration(&self) -> usize {
        self.state.iteration
    }

    /// Seconds of training so far.
    pub fn seconds(&self) -> f64 {
        self.state.seconds
    }

    /// As named sections of bytes.
    pub fn to_sections(&self) -> Vec<(String, Vec<u8>)> {
        // Plain structs with string keys: serializing them cannot fail.
        let state = serde_json::to_vec(&self.state).unwrap_or_default();
        let mut sections = vec![("training".to_owned(), state)];
        let floats = |values: &[f32]| bytemuck::cast_slice(values).to_vec();
        let best = self.best.iter().map(|best| ("best", best));
        for (name, snapshot) in best.chain([("model", &self.model)]) {
            for (index, plane) in snapshot.planes.iter().enumerate() {
                sections.push((format!("{name} {index}"), floats(plane)));
            }
        }
        sections.push(("statistics".to_owned(), floats(&self.statistics)));
        for (photo, bits) in &self.left_out {
            sections.push((format!("left out {photo}"), bits.clone()));
        }
        sections
    }

    /// Parses the output of [`Checkpoint::to_sections`]; `None` if a section is missing or damaged.
    pub fn from_sections(sections: &BTreeMap<String, Vec<u8>>) -> Option<Self> {
        let state: TrainingState = serde_json::from_slice(sections.get("training")?).ok()?;
        let floats = |name: &str| -> Option<Vec<f32>> {
            let bytes = sections.get(name)?;
            let floats = bytes.chunks_exact(4);
            floats.remainder().is_empty().then(|| {
                floats
                    .map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]))
                    .collect()
            })
        };
        let snapshot = |name: &str, held| {
            Snapshot::of((0..).map_while(|k| floats(&format!("{name} {k}"))), held)
        };
        let [held, best_held] = state.held;
        let left_out = sections.iter().filter_map(|(name, bits)| {
            let photo = name.strip_prefix("left out ")?.parse().ok()?;
            Some((photo, bits.clone()))
        });
        let best = match state.best {
            Some(_) => Some(snapshot("best", best_held)?),
            None => None,
        };
        let (model, statistics) = (snapshot("model", held)?, floats("statistics")?);
        let fits = statistics.len() == STATISTICS_PLANES * model.len()
            && state.status.len() == STATUS_WORDS;
        fits.then_some(Self {
            model,
            statistics,
            left_out: left_out.collect(),
            best,
            state,
        })
    }
}
