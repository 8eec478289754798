//! What stage 1 can be told. Rates are of the 3DGS paper (Kerbl et al. 2023) unless
//! another reason is given.

use super::Numerics;
use crate::raster::RasterOptions;

/// Iterations between two looks at the device.
pub(super) const SYNC_EVERY: usize = 25;

/// Learning rates of Adam.
#[derive(Clone, Debug, PartialEq)]
pub struct LearningRates {
    /// Means at the first and the last iteration, as a share of the scene's
    /// extent: exponential decay between.
    pub means: [f64; 2],
    /// Unnormalised quaternions.
    pub quats: f64,
    /// Log-scales.
    pub log_scales: f64,
    /// Opacity logits.
    pub opacity_logits: f64,
    /// Constant spherical-harmonic term.
    pub sh_constant: f64,
    /// The other terms: slower, for they explain less.
    pub sh_rest: f64,
}

impl Default for LearningRates {
    /// Beside the 3DGS rates, which were tuned for 30,000 iterations, sizes and attitudes
    /// learn twice as fast, colours four times, opacities half as fast, and the means' rate
    /// falls by half a decade instead of two: there is little time to move in (measured in
    /// docs/decisions.md).
    fn default() -> Self {
        Self {
            means: [1.6e-4, 4.8e-5],
            quats: 2e-3,
            log_scales: 1e-2,
            opacity_logits: 2.5e-2,
            sh_constant: 1e-2,
            sh_rest: 2.5e-3 / 20.0,
        }
    }
}

/// How the set of Gaussians changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Densification {
    /// Those that the loss pulls at are split, faint ones removed (`luma::densify`).
    #[default]
    Split,
    /// Faint ones are put where others are (`luma::relocation`).
    Relocate,
}

/// When the set of Gaussians changes, in iterations.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Schedule {
    /// Iterations in all.
    pub iterations: usize,
    /// First densification not before this.
    pub densify_from: usize,
    /// No densification from this on.
    pub densify_until: usize,
    /// Iterations between densifications.
    pub densify_every: usize,
    /// Iterations between two degrees of spherical harmonics.
    pub raise_degree_every: usize,
    /// From here on all learning rates fall, to [`SETTLED`] at the end.
    pub settle_from: usize,
    /// Until here photos are seen at half their size: a quarter of the pixels.
    pub coarse_until: usize,
    /// Where outliers are looked for, if they are.
    pub find_outliers_at: [usize; 2],
}

impl Schedule {
    /// The paper's schedule is written for 15,000 iterations; a shorter run passes
    /// through the same phases in proportion. There are no opacity resets, splitting
    /// ends with four fifths of the run, and harmonics come sooner than every 1,000
    /// iterations (measured in docs/decisions.md).
    pub fn of(iterations: usize) -> Self {
        let share = |of_paper: usize| (of_paper * iterations).div_ceil(PAPER_ITERATIONS);
        Self {
            iterations,
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
            raise_degree_every: share(1_000).clamp(1, RAISED_BY),
            settle_from: iterations * 7 / 10,
            coarse_until: 0,
            find_outliers_at: OUTLIERS_AT.map(|share| (share * iterations as f64) as usize),
        }
    }

    /// Ends the run at `end` instead, seen from iteration `now`: what is still to come
    /// is stretched or squeezed in proportion, what has begun stays.
    pub fn end_at(&mut self, end: usize, now: usize) {
        let before = self.iterations.saturating_sub(now).max(1) as f64;
        let stretch = end.saturating_sub(now) as f64 / before;
        let moved = |at: usize| match at.checked_sub(now) {
            None | Some(0) => at,
            Some(ahead) => now + (ahead as f64 * stretch).round() as usize,
        };
        *self = Self {
            iterations: end.max(now),
            densify_from: moved(self.densify_from),
            densify_until: moved(self.densify_until),
            settle_from: moved(self.settle_from),
            coarse_until: moved(self.coarse_until),
            find_outliers_at: self.find_outliers_at.map(moved),
            ..*self
        };
    }

    /// Lets the run settle from iteration `now` on, and end when it has: nothing that is
    /// still to come changes the set any more.
    pub fn settle_at(&mut self, now: usize) {
        let end = now + (now as f64 * SETTLING_SHARE).ceil() as usize;
        *self = Self {
            iterations: self.iterations.min(end),
            densify_until: self.densify_until.min(now),
            settle_from: self.settle_from.min(now),
            // Outliers do harm to the last; there is one more chance to find them.
            find_outliers_at: self.find_outliers_at.map(|at| at.min(now + 1)),
            ..*self
        };
    }
}

/// In a run with fewer iterations the set of Gaussians changes at a pace of its own.
pub const SHORT_RUN: usize = 3_000;

/// The next degree of harmonics waits no longer than this: a run whose curve is soon flat
/// ends with what it has learnt by then.
const RAISED_BY: usize = 250;

/// Share of its learning rates at which a run that settles ends: steps that answer to one
/// view at a time leave noise as large as they are.
pub const SETTLED: f64 = 0.1;

/// A run that is made to settle early takes so many more iterations, as a share of those
/// before: half of what a short run's schedule spends on it, for less is left to gain.
pub const SETTLING_SHARE: f64 = 0.2;

/// Shares of the iterations after which outliers are looked for: once the scene is
/// there, and again when it is sharper.
pub const OUTLIERS_AT: [f64; 2] = [0.4, 0.65];

/// Luma iterations of ChromaDistill (WACV 2025, supplement).
pub const PAPER_ITERATIONS: usize = 15_000;

/// Settings of one training.
#[derive(Clone, Debug, PartialEq)]
pub struct LumaSettings {
    /// Learning rates.
    pub rates: LearningRates,
    /// Phases.
    pub schedule: Schedule,
    /// How the set of Gaussians changes.
    pub densification: Densification,
    /// Degree of the luma harmonics, 0 to 3.
    pub sh_degree: u32,
    /// Never more Gaussians than this.
    pub max_splats: usize,
    /// Seeds the order of the views.
    pub seed: u64,
    /// Mean pull on a centre (`STAT_PULL`)
    /// from which a Gaussian is split.
    pub pull_threshold: f64,
    /// A densification splits at most this share of the Gaussians.
    pub growth: f64,
    /// Gaussians below this opacity are removed.
    pub prune_opacity: f64,
    /// Whether pixels that show something else than the scene are found on the way
    /// (`luma::outliers`) and no longer count.
    pub robust: bool,
    /// Bytes that the training may take on the device; no limit when `None`.
    pub memory_limit: Option<u64>,
    /// Whether opacities fall by what the blur of the projection spreads
    /// ([`RasterOptions::antialiased`]); the scene must then be drawn the same way.
    pub antialiased: bool,
    /// Whether some of the Gaussians stand for a background far behind the scene: how
    /// large one may be then grows with its distance.
    pub background: bool,
    /// Seconds that a training may take: it ends where they are over, and its schedule is
    /// stretched or squeezed to end there.
    pub time_limit: Option<f64>,
    /// A training goes back to its best, settles and ends where twice the iterations would
    /// bring less than so many dB in the views that are
    /// [watched](super::LumaTrainer::watch).
    pub flat: Option<f64>,
    /// How accurately it computes.
    pub numerics: Numerics,
}

impl LumaSettings {
    /// The defaults for a run of so many iterations.
    pub fn new(iterations: usize) -> Self {
        Self {
            rates: LearningRates::default(),
            schedule: Schedule::of(iterations),
            densification: Densification::Split,
            sh_degree: 3,
            max_splats: 1_000_000,
            seed: 0,
            // gsplat's advice for absolute gradients.
            pull_threshold: 8e-4,
            growth: 0.3,
            prune_opacity: 0.005,
            robust: false,
            memory_limit: None,
            antialiased: false,
            background: false,
            time_limit: None,
            flat: None,
            numerics: Numerics::default(),
        }
    }

    /// The same with densification by relocation: a set that grows by 5 % a time as in the
    /// paper; in a short run oftener and by 10 %.
    pub fn relocating(mut self) -> Self {
        let short = self.schedule.iterations < SHORT_RUN;
        self.densification = Densification::Relocate;
        self.growth = if short { 0.1 } else { 0.05 };
        if short {
            self.schedule.densify_every = (self.schedule.iterations / 20).clamp(25, 100);
        }
        self
    }

    /// How the scene is drawn.
    pub fn raster_options(&self) -> RasterOptions {
        RasterOptions {
            antialiased: self.antialiased,
        }
    }

    /// Learning rate of the means at `iteration`, in world units.
    pub fn means_rate(&self, iteration: usize, extent: f64) -> f64 {
        let [first, last] = self.rates.means;
        let t = iteration as f64 / self.schedule.iterations.max(1) as f64;
        extent * first * (last / first).powf(t.min(1.0))
    }

    /// What all learning rates are multiplied by at `iteration`, the means' included.
    pub fn settling(&self, iteration: usize) -> f64 {
        let Schedule {
            iterations,
            settle_from,
            ..
        } = self.schedule;
        let settled = iteration.saturating_sub(settle_from) as f64;
        SETTLED.powf(settled / iterations.saturating_sub(settle_from).max(1) as f64)
    }

    /// Whether pixels that show something else than the scene are looked for after
    /// `iteration` (counted from 1).
    pub fn finds_outliers_after(&self, iteration: usize) -> bool {
        self.robust && self.schedule.find_outliers_at.contains(&iteration)
    }

    /// Degree of the harmonics in use at `iteration`.
    pub fn degree_at(&self, iteration: usize) -> u32 {
        let raised = iteration / self.schedule.raise_degree_every;
        self.sh_degree
            .min(u32::try_from(raised).unwrap_or(u32::MAX))
    }

    /// The iteration from which on all harmonics are in use.
    pub fn full_degree_from(&self) -> usize {
        self.sh_degree as usize * self.schedule.raise_degree_every
    }

    /// Whether the set changes after `iteration` (counted from 1).
    pub fn densifies_after(&self, iteration: usize) -> bool {
        let schedule = &self.schedule;
        iteration > schedule.densify_from
            && iteration < schedule.densify_until
            && iteration.is_multiple_of(schedule.densify_every)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_schedule() {
        let schedule = Schedule::of(PAPER_ITERATIONS);
        assert_eq!(
            schedule,
            Schedule {
                iterations: 15_000,
                densify_from: 500,
                densify_until: 12_000,
                densify_every: 100,
                raise_degree_every: 250,
                settle_from: 10_500,
                coarse_until: 0,
                find_outliers_at: [6_000, 9_750],
            }
        );
        let settings = LumaSettings::new(PAPER_ITERATIONS);
        assert!(!settings.densifies_after(500) && settings.densifies_after(600));
        assert_eq!(
            [0, 249, 250, 600, 9_000].map(|i| settings.degree_at(i)),
            [0, 0, 1, 2, 3]
        );
    }

    #[test]
    fn rates_of_means_decay_from_end_to_end() {
        let settings = LumaSettings::new(PAPER_ITERATIONS);
        assert!((settings.means_rate(0, 2.0) - 3.2e-4).abs() < 1e-12);
        assert!((settings.means_rate(15_000, 2.0) - 9.6e-5).abs() < 1e-12);
        let half_way = 3.2e-4 * 0.3_f64.sqrt();
        assert!((settings.means_rate(7_500, 2.0) - half_way).abs() < 1e-12);
    }

    #[test]
    fn runs_settle() {
        let settings = LumaSettings::new(1_000);
        let at = [0, 700, 850, 1_000].map(|i| settings.settling(i));
        let wanted = [1.0, 1.0, 0.1_f64.sqrt(), 0.1];
        assert!(
            at.iter().zip(wanted).all(|(a, w)| (a - w).abs() < 1e-12),
            "{at:?}"
        );
        // One iteration is all there is.
        assert_eq!(LumaSettings::new(1).settling(0), 1.0);
    }

    #[test]
    fn a_run_that_ends_elsewhere_passes_through_the_same_phases() {
        let mut schedule = Schedule::of(1_000);
        let before = schedule.clone();
        schedule.end_at(2_000, 0);
        assert_eq!(schedule.iterations, 2_000);
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
        assert_eq!(schedule.iterations, 700);
        assert_eq!(schedule.settle_from, 600);
    }

    #[test]
    fn a_run_that_is_flat_settles_and_ends() {
        let mut schedule = Schedule::of(2_000);
        schedule.settle_at(1_000);
        assert_eq!(schedule.iterations, 1_200);
        assert_eq!([schedule.densify_until, schedule.settle_from], [1_000; 2]);
        assert_eq!(schedule.find_outliers_at, [800, 1_001]);
        // One that settles already ends no later than it would have.
        let mut schedule = Schedule::of(2_000);
        schedule.settle_at(1_900);
        assert_eq!([schedule.iterations, schedule.settle_from], [2_000, 1_400]);
    }
}
