//! When a training ends, where its schedule alone does not say.

use super::state::LumaTrainer;
use crate::{gpu::GpuError, luma::curve::gain_of_doubling};

/// No curve is called flat before this share of the iterations, or [`GROWN`] if that is
/// less: the set still grows, and what it learned is lost for a while each time
/// (docs/experiments.md).
const FLAT_FROM: f64 = 0.5;

/// In so many iterations a set that begins to grow after 500 grows twelve times, by 30 % each.
const GROWN: f64 = 1_750.0;

/// Nor before so many times the iterations after which the last harmonics came: they need
/// time to show what they bring.
const HARMONICS_SHOW: f64 = 1.25;

impl LumaTrainer {
    /// Moves the end to where the time limit will be reached.
    pub(super) fn keep_to_limit(&mut self, iteration: usize) {
        let Some(limit) = self.goal.seconds() else {
            return;
        };
        let schedule = &self.schedule;
        let left = schedule.end.saturating_sub(iteration).max(1);
        let growing = schedule.densify_until.saturating_sub(iteration).min(left);
        let densifications = growing as f64 / schedule.densify_every as f64;
        let room = self.settings.max_splats as f64 / self.model.len() as f64;
        let growth = (1.0 + self.settings.growth).powf(densifications).min(room);
        let share = growing as f64 / left as f64;
        if let Some(end) = self.pace.end(limit, growth.max(1.0), share) {
            // The last iteration is one that is reported, so it is still to come.
            let end = end.min(self.longest).max(iteration + 1);
            self.schedule.end_at(end, iteration);
        }
    }

    /// Lets the run settle where the watched views are as good as the goal asks.
    pub(super) fn settle_when_reached(&mut self, iteration: usize) {
        let wanted = self.goal.psnr().unwrap_or(f64::INFINITY);
        let reached = self.watch.last().is_some_and(|look| look.psnr >= wanted);
        if reached {
            self.schedule.settle_at(iteration);
            self.longest = self.schedule.end;
        }
    }

    /// Returns true if the goal's PSNR will be reached by the end of the schedule, with a gain of
    /// `gain` dB per doubling of the iterations.
    fn will_reach(&self, iteration: usize, gain: f64) -> bool {
        let doublings = (self.schedule.end as f64 / iteration as f64).log2();
        let expected = self.watch.last().map(|look| look.psnr + gain * doublings);
        self.goal
            .psnr()
            .is_some_and(|wanted| expected >= Some(wanted))
    }

    /// Lets the run settle where little is left to gain, from where it was best: when it has
    /// gone back there, the iteration that it goes on from.
    pub(super) fn stop_when_flat(&mut self, iteration: usize) -> Result<Option<usize>, GpuError> {
        let Some(threshold) = self.settings.stop_when_flat else {
            return Ok(None);
        };
        let schedule = self.schedule.clone();
        // What few harmonics have taught says nothing about what more will.
        let degrees = schedule.degree_from(self.settings.sh_degree);
        if iteration <= degrees || iteration >= schedule.settle_from {
            return Ok(None);
        }
        self.keep_best(iteration)?;
        let grown = (FLAT_FROM * schedule.end as f64).min(GROWN);
        let early = grown.max(HARMONICS_SHOW * degrees as f64);
        // Harmonics that are yet to come only make a curve steeper.
        let flat = gain_of_doubling(self.curve())
            .is_some_and(|gain| gain < threshold && !self.will_reach(iteration, gain));
        if !flat || (iteration as f64) < early {
            return Ok(None);
        }
        let best = self.back_to_best(iteration)?;
        self.schedule.settle_at(best.unwrap_or(iteration));
        // Time that is left is no reason to go on.
        self.longest = self.schedule.end;
        Ok(best)
    }
}
