//! A distillation on disk: all that decides how it goes on.

use std::{collections::BTreeMap, time::Duration};

use serde::{Deserialize, Serialize};

use super::{ChosenDegree, ChromaError, ChromaObserver, ChromaProgress, Correction, Task};
use crate::{
    gpu::{Buffer, Gpu},
    splats::ShField,
};

/// A distillation between two rounds of its solver; those of Adam are the iterations that it
/// reports together. What goes on from it ends with the bytes of one that was never interrupted.
#[derive(Clone, Debug, PartialEq)]
pub struct ChromaCheckpoint {
    pub(super) state: SolveDecisions,
    pub(super) solver: SolverState,
}

/// Decisions made so far.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct SolveDecisions {
    /// The degree that views held back have chosen, where they were asked.
    pub chosen: Option<ChosenDegree>,
    /// Disagreement of the views without and with corrections that were taken back.
    pub uncorrected: Option<[f64; 2]>,
    /// The solver's last report.
    pub last: Option<ChromaProgress>,
    /// Seconds of the distillation so far.
    pub seconds: f64,
}

/// A solver between two rounds.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct SolverState {
    pub rounds: Rounds,
    /// Contents of its buffers.
    pub buffers: BTreeMap<String, Vec<f32>>,
    /// Contents of its vectors on the host.
    pub doubles: BTreeMap<String, Vec<f64>>,
}

impl SolverState {
    /// Writes back the contents of a buffer; `false` where they are missing or of another length.
    pub fn put(&self, name: &str, buffer: &Buffer<f32>, gpu: &Gpu) -> bool {
        let values = self.buffers.get(name);
        let values = values.filter(|values| values.len() == buffer.len());
        values.map(|values| buffer.write(gpu, values)).is_some()
    }
}

/// A solver that can be interrupted between two rounds.
pub(super) trait Interruptible {
    /// Does a round; `false` if none was left.
    fn go_on(&mut self, observe: &mut ChromaObserver<'_>) -> Result<bool, ChromaError>;

    /// The harmonics so far.
    fn so_far(&self) -> Result<ShField, ChromaError>;

    /// All that the next rounds go by.
    fn state(&self) -> Result<SolverState, ChromaError>;

    /// Goes on from a state of the same problem; `false` where it is of another.
    fn go_on_from(&mut self, state: &SolverState) -> bool;

    /// Corrections so far that bring each view into line with the others.
    fn corrections(&self) -> Result<Vec<(Task, Correction)>, ChromaError> {
        Ok(Vec::new())
    }

    /// Takes these back and goes on without.
    fn uncorrect(&mut self) {}
}

/// A solver's counters on the host.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Rounds {
    /// Rounds done, or iterations of Adam.
    pub done: usize,
    /// See [`IrlsSolver`](super::IrlsSolver).
    pub plain: bool,
    pub settled: usize,
    pub undone: bool,
    pub corrected: bool,
    pub anchored: bool,
    pub ended: bool,
    /// The newest pair of L-BFGS.
    pub newest: usize,
    /// Passes over all views.
    pub spent: f64,
    /// Seconds of these rounds.
    pub seconds: f64,
}

/// Receiver of checkpoints.
pub trait ChromaCheckpointing {
    /// Returns true if a checkpoint is due after a round.
    fn wants(&mut self) -> bool;

    /// Takes one; `false` ends the distillation with
    /// [`ChromaError::Cancelled`](super::ChromaError).
    fn keep(&mut self, checkpoint: ChromaCheckpoint) -> bool;

    /// There will be no other.
    fn end(&mut self) {}

    /// Returns true if a viewer needs the colors now.
    fn looks_on(&mut self) -> bool {
        false
    }

    /// Takes a and b of every Gaussian; reading them from the device took so long.
    fn show(&mut self, _chroma: &ShField, _took: Duration) {}
}

/// Keeps none.
pub struct NoChromaCheckpoints;

impl ChromaCheckpointing for NoChromaCheckpoints {
    fn wants(&mut self) -> bool {
        false
    }

    fn keep(&mut self, _: ChromaCheckpoint) -> bool {
        true
    }
}

impl ChromaCheckpoint {
    /// Rounds done, or iterations of Adam.
    pub fn rounds(&self) -> usize {
        self.solver.rounds.done
    }

    /// As named sections of bytes.
    pub fn to_sections(&self) -> Vec<(String, Vec<u8>)> {
        // Plain structs with string keys: serializing them cannot fail.
        let numbers = serde_json::to_vec(&(&self.state, self.solver.rounds)).unwrap_or_default();
        let mut sections = vec![("distillation".to_owned(), numbers)];
        let buffers = self.solver.buffers.iter();
        sections.extend(buffers.map(|(name, values)| {
            let bytes = bytemuck::cast_slice(values).to_vec();
            (format!("{BUFFER}{name}"), bytes)
        }));
        let doubles = self.solver.doubles.iter();
        sections.extend(doubles.map(|(name, values)| {
            let bytes = bytemuck::cast_slice(values).to_vec();
            (format!("{DOUBLES}{name}"), bytes)
        }));
        sections
    }

    /// The checkpoint of [`ChromaCheckpoint::to_sections`]; `None` of anything else.
    pub fn from_sections(sections: &BTreeMap<String, Vec<u8>>) -> Option<Self> {
        let numbers = serde_json::from_slice(sections.get("distillation")?);
        let (state, rounds): (SolveDecisions, Rounds) = numbers.ok()?;
        let buffers = sections.iter().filter_map(|(name, bytes)| {
            let (floats, rest) = bytes.as_chunks::<4>();
            let values = floats.iter().map(|&bytes| f32::from_le_bytes(bytes));
            let name = name.strip_prefix(BUFFER).filter(|_| rest.is_empty())?;
            Some((name.to_owned(), values.collect()))
        });
        let buffers = buffers.collect();
        let doubles = sections.iter().filter_map(|(name, bytes)| {
            let (doubles, rest) = bytes.as_chunks::<8>();
            let values = doubles.iter().map(|&bytes| f64::from_le_bytes(bytes));
            let name = name.strip_prefix(DOUBLES).filter(|_| rest.is_empty())?;
            Some((name.to_owned(), values.collect()))
        });
        let doubles = doubles.collect();
        Some(Self {
            state,
            solver: SolverState {
                rounds,
                buffers,
                doubles,
            },
        })
    }
}

/// Prefixes of the names of buffers' sections.
const BUFFER: &str = "solver ";
const DOUBLES: &str = "solver's host ";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_is_read_again() {
        let checkpoint = ChromaCheckpoint {
            state: SolveDecisions {
                chosen: Some(ChosenDegree {
                    degree: 1,
                    losses: vec![2.5, 1.0 / 3.0],
                }),
                uncorrected: None,
                last: None,
                seconds: 2.5,
            },
            solver: SolverState {
                rounds: Rounds {
                    done: 5,
                    plain: true,
                    spent: 0.1,
                    ..Rounds::default()
                },
                buffers: [("unknowns".to_owned(), vec![0.5, -0.0, f32::MAX])].into(),
                doubles: [("rhos".to_owned(), vec![1.0 / 3.0, f64::INFINITY])].into(),
            },
        };
        let sections: BTreeMap<_, _> = checkpoint.to_sections().into_iter().collect();
        assert_eq!(ChromaCheckpoint::from_sections(&sections), Some(checkpoint));
        assert_eq!(ChromaCheckpoint::from_sections(&BTreeMap::new()), None);
    }
}
