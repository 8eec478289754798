//! When a training ends, where its schedule alone does not say.

use super::LumaTrainer;
use crate::luma::curve::gain_of_doubling;

/// A run with time left takes at most so many times its iterations: beyond, a larger set
/// or larger photos would have been worth more.
pub(super) const LONGER: usize = 3;

/// No curve is called flat within this share of the iterations: the set still grows.
const FLAT_FROM: f64 = 0.25;

impl LumaTrainer {
    /// Moves the end to where the time limit will be reached.
    pub(super) fn keep_to_limit(&mut self, iteration: usize) {
        let Some(limit) = self.settings.time_limit else {
            return;
        };
        let schedule = &self.settings.schedule;
        let left = schedule.iterations.saturating_sub(iteration).max(1);
        let growing = schedule.densify_until.saturating_sub(iteration).min(left);
        let densifications = growing as f64 / schedule.densify_every as f64;
        let room = self.settings.max_splats as f64 / self.geometry.count as f64;
        let growth = (1.0 + self.settings.growth).powf(densifications).min(room);
        let share = growing as f64 / left as f64;
        if let Some(end) = self.pace.end(limit, growth.max(1.0), share) {
            // The last iteration is one that is reported, so it is still to come.
            let end = end.min(self.longest).max(iteration + 1);
            self.settings.schedule.end_at(end, iteration);
        }
    }

    /// Lets the run settle where little is left to gain.
    pub(super) fn stop_when_flat(&mut self, iteration: usize) {
        let schedule = &self.settings.schedule;
        let early = (iteration as f64) < FLAT_FROM * schedule.iterations as f64;
        // What small photos have taught says nothing about what large ones will.
        let curve = self.curve();
        let small = curve.partition_point(|look| look.iteration <= schedule.coarse_until);
        let gain = gain_of_doubling(&curve[small..]);
        let flat = |threshold: f64| gain.is_some_and(|gain| gain < threshold);
        if self.settings.flat.is_some_and(flat) && !early && iteration < schedule.settle_from {
            self.settings.schedule.settle_at(iteration);
            // Time that is left is no reason to go on.
            self.longest = self.settings.schedule.iterations;
        }
    }
}
