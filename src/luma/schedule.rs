//! When things happen in a training, which follows from its settings.

use serde::{Deserialize, Serialize};

use super::{
    DensifyRules, LumaSettings, PAPER_ITERATIONS,
    settings::{SHORT_RUN, SYNC_EVERY},
};

/// When things happen in a training, in iterations.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Schedule {
    /// The last iteration: those of the settings, until the goal or a flat curve moves it.
    pub end: usize,
    /// First densification not before this.
    pub densify_from: usize,
    /// No densification from this on.
    pub densify_until: usize,
    /// Iterations between densifications.
    pub densify_every: usize,
    /// Iterations between two resets of all opacities, if there are any.
    #[serde(default)]
    pub reset_every: Option<usize>,
    /// Iterations between two degrees of spherical harmonics.
    pub raise_degree_every: usize,
    /// From here on all learning rates fall, to [`SETTLED`] at the end.
    pub settle_from: usize,
    /// From here on the scene's surroundings are drawn.
    #[serde(default)]
    pub surround_at: usize,
    /// Iterations of the outlier search, if enabled.
    pub find_outliers_at: [usize; 2],
}

impl Schedule {
    /// The schedule of these settings, by their rules of densification.
    pub fn of(settings: &LumaSettings) -> Self {
        match settings.rules {
            DensifyRules::Own => Self::own(settings),
            DensifyRules::Published => Self::published(settings),
        }
    }

    /// As 3DGS publishes it for 30,000 iterations, of which ChromaDistill's luma takes the first
    /// half: densification goes on to its end, "as Gaussian densification and pruning occur only up
    /// to this point". A shorter run passes through it in proportion.
    fn published(settings: &LumaSettings) -> Self {
        let of_paper = |at: usize| (at * settings.iterations).div_ceil(PAPER_ITERATIONS);
        let share = |at: usize| of_paper(at).clamp(1, at);
        Self {
            densify_from: share(500),
            densify_until: share(15_000),
            densify_every: share(100).max(SYNC_EVERY),
            reset_every: Some(share(3_000)),
            raise_degree_every: share(1_000),
            settle_from: settings.iterations,
            ..Self::own(settings)
        }
    }

    /// The paper's schedule is written for 15,000 iterations; a shorter run passes
    /// through the same phases in proportion. There are no opacity resets, splitting
    /// ends with four fifths of the run, and harmonics come sooner than every 1,000
    /// iterations.
    fn own(settings: &LumaSettings) -> Self {
        let iterations = settings.iterations;
        let share = |of_paper: usize| (of_paper * iterations).div_ceil(PAPER_ITERATIONS);
        Self {
            end: iterations,
            // What is split before it has found its place is split in vain; the pace of
            // longer runs is in iterations, so is this.
            densify_from: if iterations < SHORT_RUN {
                share(500).max(100)
            } else {
                500
            },
            // A run needs time to settle after the last split.
            densify_until: share(12_000).min(PAPER_ITERATIONS),
            // Some five looks at the pulls, each over enough iterations to be worth one.
            densify_every: if iterations < SHORT_RUN {
                (iterations / 5).clamp(50, 200)
            } else {
                100
            },
            reset_every: None,
            raise_degree_every: share(1_000).clamp(1, RAISED_BY),
            settle_from: iterations * 7 / 10,
            surround_at: (SURROUND_AT * iterations as f64) as usize,
            find_outliers_at: OUTLIERS_AT.map(|share| (share * iterations as f64) as usize),
        }
    }

    /// Ends the run at `end` instead, seen from iteration `now`: what is still to come
    /// is stretched or squeezed in proportion, what has begun stays.
    pub fn end_at(&mut self, end: usize, now: usize) {
        let before = self.end.saturating_sub(now).max(1) as f64;
        let stretch = end.saturating_sub(now) as f64 / before;
        let moved = |at: usize| match at.checked_sub(now) {
            None | Some(0) => at,
            Some(ahead) => now + (ahead as f64 * stretch).round() as usize,
        };
        *self = Self {
            end: end.max(now),
            densify_from: moved(self.densify_from),
            densify_until: moved(self.densify_until),
            settle_from: moved(self.settle_from),
            surround_at: moved(self.surround_at),
            find_outliers_at: self.find_outliers_at.map(moved),
            ..*self
        };
    }

    /// Lets the run settle from iteration `now` on, and end when it has: nothing that is
    /// still to come changes the set any more.
    pub fn settle_at(&mut self, now: usize) {
        let end = now + (now as f64 * SETTLING_SHARE).ceil() as usize;
        *self = Self {
            end: self.end.min(end),
            densify_until: self.densify_until.min(now),
            settle_from: self.settle_from.min(now),
            // Outliers do harm to the last; there is one more chance to find them.
            find_outliers_at: self.find_outliers_at.map(|at| at.min(now + 1)),
            surround_at: self.surround_at.min(now + 1),
            ..*self
        };
    }

    /// Share of the training that is over at `iteration`, at most 1.
    pub fn share_over(&self, iteration: usize) -> f64 {
        (iteration as f64 / self.end.max(1) as f64).min(1.0)
    }

    /// Factor of all learning rates at `iteration`, the means' included.
    pub fn settling(&self, iteration: usize) -> f64 {
        let settled = iteration.saturating_sub(self.settle_from) as f64;
        SETTLED.powf(settled / self.end.saturating_sub(self.settle_from).max(1) as f64)
    }

    /// Degree of the harmonics in use at `iteration`, of at most `highest`.
    pub fn degree_at(&self, iteration: usize, highest: u32) -> u32 {
        let raised = iteration / self.raise_degree_every;
        highest.min(u32::try_from(raised).unwrap_or(u32::MAX))
    }

    /// The iteration from which on harmonics of a degree are in use.
    pub fn degree_from(&self, degree: u32) -> usize {
        degree as usize * self.raise_degree_every
    }

    /// Returns true if a densification follows `iteration` (counted from 1).
    pub fn densifies_after(&self, iteration: usize) -> bool {
        iteration > self.densify_from
            && iteration < self.densify_until
            && iteration.is_multiple_of(self.densify_every)
    }

    /// Returns true if all opacities are reset after `iteration` (counted from 1).
    pub fn resets_after(&self, iteration: usize) -> bool {
        let every = self.reset_every;
        every.is_some_and(|every| iteration < self.densify_until && iteration.is_multiple_of(every))
    }

    /// Number of densifications.
    pub fn densifications(&self) -> usize {
        (1..self.densify_until)
            .filter(|&iteration| self.densifies_after(iteration))
            .count()
    }
}

/// The next degree of harmonics waits no longer than this: a run whose curve is soon flat
/// ends with what it has learned by then.
const RAISED_BY: usize = 250;

/// Share of its learning rates at which a run that settles ends: steps that answer to one
/// view at a time leave noise as large as they are.
pub const SETTLED: f64 = 0.1;

/// Share of the iterations after which surroundings are drawn. From the first on, Gaussians in
/// front of them would stay thin and lend them their mean gray, which other views show to be
/// wrong; the later they come, the longer have those at the border tried to show what lies
/// beyond it (docs/experiments.md).
const SURROUND_AT: f64 = 0.3;

/// A run that is made to settle early takes so many more iterations, as a share of those
/// before: half of what a short run's schedule spends on it, for less is left to gain.
pub const SETTLING_SHARE: f64 = 0.2;

/// Shares of the iterations after which outliers are looked for: once the scene is
/// there, and again when it is sharper.
pub const OUTLIERS_AT: [f64; 2] = [0.4, 0.65];

#[cfg(test)]
mod tests {
    use super::*;

    fn of(iterations: usize) -> Schedule {
        Schedule::of(&LumaSettings::new(iterations))
    }

    #[test]
    fn the_papers_schedule() {
        let schedule = of(PAPER_ITERATIONS);
        assert_eq!(
            schedule,
            Schedule {
                end: 15_000,
                densify_from: 500,
                densify_until: 12_000,
                densify_every: 100,
                reset_every: None,
                raise_degree_every: 250,
                settle_from: 10_500,
                surround_at: 4_500,
                find_outliers_at: [6_000, 9_750],
            }
        );
        assert!(!schedule.densifies_after(500) && schedule.densifies_after(600));
        assert_eq!(
            [0, 249, 250, 600, 9_000].map(|i| schedule.degree_at(i, 3)),
            [0, 0, 1, 2, 3]
        );
        assert_eq!(schedule.degree_from(3), 750);
    }

    #[test]
    fn short_runs_look_five_times() {
        let every = |iterations| of(iterations).densify_every;
        assert_eq!([100, 700, 2_999, SHORT_RUN].map(every), [50, 140, 200, 100]);
    }

    #[test]
    fn runs_settle() {
        let schedule = of(1_000);
        let at = [0, 700, 850, 1_000].map(|i| schedule.settling(i));
        let wanted = [1.0, 1.0, 0.1_f64.sqrt(), 0.1];
        assert!(
            at.iter().zip(wanted).all(|(a, w)| (a - w).abs() < 1e-12),
            "{at:?}"
        );
        // One iteration is all there is.
        assert_eq!(of(1).settling(0), 1.0);
    }

    #[test]
    fn a_run_that_ends_elsewhere_passes_through_the_same_phases() {
        let mut schedule = of(1_000);
        let before = schedule.clone();
        schedule.end_at(2_000, 0);
        assert_eq!(schedule.end, 2_000);
        assert_eq!(schedule.settle_from, 1_400);
        assert_eq!(schedule.densify_until, 1_600);
        assert_eq!(schedule.find_outliers_at, [800, 1_300]);
        schedule.end_at(1_000, 0);
        assert_eq!(schedule, before);

        // Half-way: what lies behind stays, what lies ahead is twice as near.
        schedule.end_at(750, 500);
        assert_eq!(schedule.densify_from, before.densify_from);
        assert_eq!(schedule.settle_from, 600);
        assert_eq!(schedule.densify_until, 650);
        assert_eq!(schedule.find_outliers_at, [400, 575]);
        // Time is up.
        schedule.end_at(100, 700);
        assert_eq!(schedule.end, 700);
        assert_eq!(schedule.settle_from, 600);
    }

    #[test]
    fn a_run_that_is_flat_settles_and_ends() {
        let mut schedule = of(2_000);
        schedule.settle_at(1_000);
        assert_eq!(schedule.end, 1_200);
        assert_eq!([schedule.densify_until, schedule.settle_from], [1_000; 2]);
        assert_eq!(schedule.find_outliers_at, [800, 1_001]);
        // One that settles already ends no later than it would have.
        let mut schedule = of(2_000);
        schedule.settle_at(1_900);
        assert_eq!([schedule.end, schedule.settle_from], [2_000, 1_400]);
    }
}
