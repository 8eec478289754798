//! When a training that has so many seconds will have to end.

use serde::{Deserialize, Serialize};

/// An iteration's cost is taken from the last iterations, this share of all so far.
const RECENT: f64 = 0.1;

/// And from so many at least: single ones are noise.
const RECENT_MIN: usize = 20;

/// The first iterations also compile what the driver puts off.
const WARM_UP: usize = 16;

/// Share of an iteration's cost that grows with the number of Gaussians; the rest grows with the
/// pixels. Measured on a software adapter at the presets' sizes (docs/experiments.md);
/// elsewhere it affects only the first estimates, which are corrected as training goes on.
const SHARE_OF_SPLATS: f64 = 0.5;

/// The clock of a training: which iteration was done when.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pace {
    reports: Vec<(usize, f64)>,
}

impl Pace {
    /// Notes that `iteration` was done after `seconds`.
    pub fn note(&mut self, iteration: usize, seconds: f64) {
        // An iteration may be repeated after an overflow.
        self.reports.retain(|&(earlier, _)| earlier < iteration);
        self.reports.push((iteration, seconds));
    }

    /// Notes that after `seconds` all was as it had been at an earlier `iteration`.
    pub fn back_to(&mut self, iteration: usize, seconds: f64) {
        self.reports.retain(|&(earlier, _)| earlier <= iteration);
        let lost = self.reports.last().map_or(0.0, |&(_, then)| seconds - then);
        for (_, when) in &mut self.reports {
            *when += lost;
        }
    }

    /// Seconds of one iteration of late; `None` as long as nobody knows.
    fn cost(&self) -> Option<f64> {
        let &(last, now) = self.reports.last()?;
        let recent = RECENT_MIN.max((RECENT * last as f64) as usize);
        let from = (self.reports.iter().rev())
            .find(|&&(iteration, _)| iteration + recent <= last && iteration >= WARM_UP)?;
        Some((now - from.1).max(0.0) / (last - from.0) as f64)
    }

    /// The iteration at which `limit` seconds will be over, when the set is to grow by
    /// `growth` (1: not any more) until the share `growing` of what is left.
    pub fn end(&self, limit: f64, growth: f64, growing: f64) -> Option<usize> {
        let &(last, now) = self.reports.last()?;
        let cost = self.cost()?;
        let at_the_end = 1.0 + SHARE_OF_SPLATS * (growth - 1.0);
        let mean = growing * (1.0 + at_the_end) / 2.0 + (1.0 - growing) * at_the_end;
        let left = (limit - now).max(0.0) / (cost * mean).max(f64::MIN_POSITIVE);
        Some(last.saturating_add(left as usize))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reports every 25 iterations of a tenth of a second.
    fn steady(until: usize) -> Pace {
        let mut pace = Pace::default();
        for iteration in (25..=until).step_by(25) {
            // What was compiled first took a second.
            pace.note(iteration, 1.0 + 0.1 * iteration as f64);
        }
        pace
    }

    #[test]
    fn a_steady_pace_ends_when_time_is_over() {
        assert_eq!(steady(500).end(101.0, 1.0, 0.0), Some(1_000));
        assert_eq!(steady(500).end(51.0, 1.0, 0.0), Some(500));
        assert_eq!(steady(500).end(10.0, 1.0, 0.0), Some(500));
    }

    #[test]
    fn nobody_knows_at_first() {
        assert_eq!(Pace::default().end(100.0, 1.0, 0.0), None);
        assert_eq!(steady(25).end(100.0, 1.0, 0.0), None);
        assert!(steady(50).end(100.0, 1.0, 0.0).is_some());
    }

    /// Time that was given up is lost, and the pace does not show it.
    #[test]
    fn what_is_given_up_cost_its_time() {
        let mut pace = steady(500);
        pace.back_to(300, 51.0);
        assert_eq!(pace.end(101.0, 1.0, 0.0), Some(800));
        let mut none = Pace::default();
        none.back_to(0, 3.0);
        assert_eq!(none.end(101.0, 1.0, 0.0), None);
    }

    #[test]
    fn a_set_that_grows_ends_earlier() {
        let pace = steady(500);
        let ends = [(1.0, 0.5), (2.0, 0.5), (4.0, 0.5), (4.0, 0.1)]
            .map(|(growth, growing)| pace.end(101.0, growth, growing).unwrap());
        assert!(ends.is_sorted_by(|a, b| a > b), "{ends:?}");
    }

    /// Time lost to an overflow counts in the pace.
    #[test]
    fn what_is_repeated_is_done_once() {
        let mut pace = steady(500);
        pace.note(475, 60.0);
        pace.note(500, 62.5);
        // 16.5 seconds for the last 50.
        assert_eq!(pace.end(72.5, 1.0, 0.0), Some(530));
    }
}
