//! A tight bound away from discontinuities and a capped share of flips at them.

use super::{Elementwise, unfit};

/// Bounds on an array in which some elements may fall the other way.
#[derive(Clone, Copy, Debug)]
pub struct FlipBounds {
    /// On every element that does not flip.
    pub rest: Elementwise,
    /// On those that flip: no flip is larger than the jump of a decision.
    pub jump: Elementwise,
    /// The largest share of all elements that may flip.
    pub cap: f64,
}

/// Counts of flipped elements by direction.
#[derive(Clone, Debug, Default)]
pub struct FlipFigures {
    /// Reason why nothing could be compared, if any.
    pub unfit: Option<String>,
    /// Flips where the actual value is above the expected one.
    pub up: usize,
    /// Flips where it is below.
    pub down: usize,
    /// `(up + down) / elements`.
    pub share: f64,
    /// The cap on the share.
    pub cap: f64,
    /// Elements beyond the tight bound where nothing may flip, the first one.
    pub astray: Option<usize>,
    /// Flips larger than a jump, the first one.
    pub leap: Option<usize>,
    /// The largest use of the tight bound among elements that did not flip.
    pub rest_used: f64,
}

impl FlipBounds {
    /// Compares two arrays. `may_flip[i]` says that element `i` is close to a
    /// discontinuity (see the oracle's `decision_margin`).
    pub fn compare(&self, actual: &[f64], expected: &[f64], may_flip: &[bool]) -> FlipFigures {
        let mut figures = FlipFigures {
            unfit: unfit(actual, expected),
            cap: self.cap,
            ..FlipFigures::default()
        };
        if may_flip.len() != expected.len() {
            figures.unfit = Some(format!(
                "{} marks for {} elements",
                may_flip.len(),
                expected.len()
            ));
        }
        if figures.unfit.is_some() {
            return figures;
        }
        for (index, (&a, &e)) in actual.iter().zip(expected).enumerate() {
            let used = self.rest.used(a, e);
            if used <= 1.0 {
                figures.rest_used = figures.rest_used.max(used);
                continue;
            }
            if !may_flip[index] {
                figures.astray.get_or_insert(index);
            }
            if self.jump.used(a, e) > 1.0 {
                figures.leap.get_or_insert(index);
            }
            if a > e {
                figures.up += 1;
            } else {
                figures.down += 1;
            }
        }
        figures.share = (figures.up + figures.down) as f64 / actual.len() as f64;
        figures
    }
}

impl FlipFigures {
    /// Returns true if one direction prevails by more than chance: fair flips keep within three
    /// standard deviations, `|up - down| <= 3 √(up + down)`.
    pub fn lopsided(&self) -> bool {
        let excess = self.up.abs_diff(self.down) as f64;
        excess > 3.0 * ((self.up + self.down) as f64).sqrt()
    }

    /// Passes if flips are few, small, even-handed and where they may be.
    ///
    /// # Errors
    /// One line that says which of these fails.
    pub fn check(&self) -> Result<(), String> {
        if let Some(reason) = &self.unfit {
            return Err(format!("flips: {reason}"));
        }
        if let Some(index) = self.astray {
            return Err(format!(
                "flips: [{index}] is out of bounds, far from any discontinuity"
            ));
        }
        if let Some(index) = self.leap {
            return Err(format!("flips: [{index}] jumps further than a flip can"));
        }
        if self.share > self.cap {
            return Err(format!(
                "flips: a share of {:e} exceeds {:e}",
                self.share, self.cap
            ));
        }
        if self.lopsided() {
            return Err(format!("flips: {} up and {} down", self.up, self.down));
        }
        Ok(())
    }
}
