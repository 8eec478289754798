//! Scores of a training on views that it does not train on.

use std::sync::Arc;

use crate::{
    luma::{TrainingViews, curve::CurvePoint},
    raster::Snapshot,
};

/// Held-out score at one validation of the training.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOutScore {
    /// Mean PSNR of the views, in dB.
    pub psnr: f64,
    /// Rise since the previous validation, in dB per minute of training.
    pub per_minute: Option<f64>,
}

/// State of validation during a training.
#[derive(Default)]
pub(super) struct Watch {
    pub views: Option<Arc<dyn TrainingViews>>,
    /// Those of which something counts.
    pub counting: Vec<usize>,
    /// The next look is after this iteration.
    pub next: usize,
    pub curve: Vec<CurvePoint>,
    /// Seconds spent on it.
    pub seconds: f64,
    /// The best set that was looked at, while the training may go back to it.
    pub best: Option<Best>,
    /// The iteration that it went back from.
    pub given_up: Option<usize>,
}

impl Watch {
    /// Returns true if a validation follows `iteration` (counted from 1) of `end`.
    pub fn is_due(&self, iteration: usize, end: usize) -> bool {
        !self.counting.is_empty() && (iteration == end || iteration == self.next)
    }

    /// Score of the last validation.
    pub fn last(&self) -> Option<HeldOutScore> {
        let last = self.curve.last()?;
        let rise = |before: &CurvePoint| {
            let minutes = (last.seconds - before.seconds) / 60.0;
            (minutes > 0.0).then(|| (last.psnr - before.psnr) / minutes)
        };
        let before = self.curve.iter().nth_back(1);
        Some(HeldOutScore {
            psnr: last.psnr,
            per_minute: before.and_then(rise),
        })
    }
}

/// All that a training changes but what it leaves out as outliers, in host memory: the
/// device may have no room for a second set.
pub(super) struct Best {
    pub iteration: usize,
    pub psnr: f64,
    pub model: Snapshot,
}
