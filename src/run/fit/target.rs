//! As much work as a PSNR takes, and no more.

use super::super::{Event, Observer, RunError, preset::Work};
use super::{
    attempt::{Attempt, Job},
    goal::Family,
};

/// The first attempt: less than `draft`.
const FIRST: f64 = -0.3;

/// From one attempt to the next; from `draft` to `balanced` iterations become 1.6 times and the
/// cap on Gaussians 4.6 times as much, so those before the last take no longer than it, unless
/// photos are small and sets stay below their cap: then up to 1.7 times as long.
const STEP: f64 = 0.3;

/// An attempt that brings less than this, in dB, was worth nothing: a further one would not be.
const GAIN_MIN: f64 = 0.1;

/// What came of the attempts.
pub(super) struct Reached {
    /// The best of them.
    pub attempt: Attempt,
    /// Its level.
    pub level: f64,
    /// How many there were.
    pub attempts: usize,
}

impl Job<'_> {
    /// Trains with more and more work until the held-out views' PSNR is at least `target`,
    /// or until it is clear that it will not be: the highest level is tried, or the last
    /// attempt brought nothing, or there is no time for the next.
    ///
    /// # Errors
    /// [`RunError`].
    pub fn reach(
        &self,
        target: f64,
        family: &Family,
        observe: &mut Observer<'_>,
    ) -> Result<Reached, RunError> {
        let mut level = FIRST.min(family.highest);
        let mut limit = self.time_for_training(0.0)?;
        let mut attempt = self.attempt(&family.work(level), limit, observe)?;
        let mut attempts = 1;
        loop {
            let psnr = attempt.psnr().unwrap_or(f64::NEG_INFINITY);
            observe(Event::Note(format!(
                "attempt {attempts}: {} iterations, {} Gaussians, {psnr:.2} dB of {target:.2} dB",
                attempt.iterations,
                attempt.splats.len(),
            )));
            let next_level = (level + STEP).min(family.highest);
            let reached = Reached {
                attempt,
                level,
                attempts,
            };
            if psnr >= target || next_level == level {
                return Ok(reached);
            }
            let [work, before] = [next_level, level].map(|level| family.work(level));
            let more = |of: fn(&Work) -> usize| of(&work) as f64 / of(&before) as f64;
            let expected = reached.attempt.seconds.iter().sum::<f64>()
                * more(|work| work.settings.iterations)
                * (1.0 + more(|work| work.settings.max_splats))
                / 2.0;
            limit = self.time_for_training(0.0).unwrap_or(Some(0.0));
            if limit.is_some_and(|limit| limit < expected) {
                return Ok(reached);
            }
            let next = self.attempt(&work, limit, observe)?;
            attempts += 1;
            let gain = next.psnr().unwrap_or(f64::NEG_INFINITY) - psnr;
            if gain < GAIN_MIN && next.psnr().is_none_or(|psnr| psnr < target) {
                let kept = if gain > 0.0 {
                    Reached {
                        attempt: next,
                        level: next_level,
                        attempts,
                    }
                } else {
                    Reached {
                        attempts,
                        ..reached
                    }
                };
                return Ok(kept);
            }
            (attempt, level) = (next, next_level);
        }
    }
}
