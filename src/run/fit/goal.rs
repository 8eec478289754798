//! How much work there is time for.
//!
//! The presets are points of one family: from a sketch over `draft` (level 0) and `balanced`
//! (1) to `paper` (2) iterations, Gaussians and pixels grow together, between two of these
//! each by the same factor for equal steps.

use std::sync::Arc;

use super::super::{
    Event, Observer, RunError,
    preset::{Amounts, Preset},
};
use super::FitOptions;
use crate::{
    capture::{Capture, CaptureOptions},
    gpu::GpuError,
    luma::{Schedule, rehearse},
    raster::Raster,
};

/// Where a family begins.
const LOWEST: f64 = Amounts::LOWEST;

/// Between two levels that are rehearsed.
const STEP: f64 = 0.5;

/// Fewer iterations than this make no scene.
pub(super) const ITERATIONS_MIN: usize = 50;

/// Share of a time limit that is left for writing files.
pub(super) const WRITING: f64 = 0.01;

/// Share of a time limit that is taken to be for training as long as nobody knows how long
/// photos take to read.
pub(super) const SURELY: f64 = 0.9;

/// What a run may do, and on what.
pub(super) struct Family {
    /// The highest level, that of the preset asked for.
    pub highest: f64,
    /// Options that hold at every level.
    pub max_splats: Option<usize>,
    /// The longer side of the photos as they are.
    pub longest_side: u32,
    /// The longer side at every level.
    pub max_side: Option<u32>,
    /// Height by width.
    pub aspect: f64,
    /// Gaussians to begin with.
    pub points: usize,
}

impl Family {
    /// What there is for the capture and the options; `max_side` holds at every level where
    /// there is a target, for PSNR at different sizes cannot be compared.
    ///
    /// # Errors
    /// [`RunError::Capture`].
    pub fn of(options: &FitOptions, max_side: Option<u32>) -> Result<Self, RunError> {
        let capture = Capture::load_with(&options.colmap_dir, &CaptureOptions::default())?;
        let sizes = || capture.views.iter().map(|view| view.photo_size());
        let [width, height] = sizes().next().unwrap_or([1, 1]).map(f64::from);
        Ok(Self {
            highest: options.preset.unwrap_or(Preset::Paper).level(),
            max_splats: options.max_splats,
            longest_side: sizes().flatten().max().unwrap_or(1),
            max_side: match options.target_psnr {
                Some(_) => max_side,
                None => options.load.max_side,
            },
            aspect: height / width,
            points: capture.points.len(),
        })
    }

    /// Amounts at a level.
    pub fn amounts(&self, level: f64) -> Amounts {
        let amounts = Preset::at_level(level.clamp(LOWEST, self.highest), self.longest_side);
        Amounts {
            max_splats: self.max_splats.unwrap_or(amounts.max_splats),
            max_side: self.max_side.or(amounts.max_side),
            ..amounts
        }
    }

    /// Gaussians, in the mean over a run.
    fn mean_splats(&self, amounts: &Amounts) -> usize {
        let schedule = Schedule::of(amounts.iterations);
        let densifications = schedule.densify_until / schedule.densify_every;
        let grown = self.points as f64 * 1.3_f64.powf(densifications as f64);
        let last = grown.min(amounts.max_splats as f64);
        let first = last.min(self.points as f64);
        ((first + last) / 2.0).max(1.0) as usize
    }

    /// The size of the photos.
    fn size(&self, amounts: &Amounts) -> [u32; 2] {
        let side = f64::from(
            amounts
                .max_side
                .map_or(self.longest_side, |side| side.min(self.longest_side)),
        );
        let (width, height) = match self.aspect {
            aspect if aspect > 1.0 => (side / aspect, side),
            aspect => (side, side * aspect),
        };
        [width, height].map(|side| side.round().max(1.0) as u32)
    }

    /// The level whose training takes `seconds`, as near as a rehearsal on random Gaussians
    /// tells; with it the seconds of an iteration there.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn level_for(
        &self,
        seconds: f64,
        raster: &Arc<Raster>,
        observe: &mut Observer<'_>,
    ) -> Result<(f64, f64), RunError> {
        let rehearsed = |level: f64| -> Result<Option<[f64; 2]>, RunError> {
            let amounts = self.amounts(level);
            match rehearse(raster, self.mean_splats(&amounts), self.size(&amounts)) {
                Ok(each) => Ok(Some([each * amounts.iterations as f64, each])),
                Err(GpuError::TooLarge { .. } | GpuError::TooManySplats { .. }) => Ok(None),
                Err(error) => Err(error.into()),
            }
        };
        let start = 0.0_f64.min(self.highest);
        let (mut low, mut at_low) = (start, rehearsed(start)?);
        if at_low.is_none_or(|[whole, _]| whole > seconds) && start > LOWEST {
            let at_lowest = rehearsed(LOWEST)?;
            (low, at_low) = (LOWEST, at_lowest);
        }
        let Some(mut known) = at_low else {
            // Whoever trains will hear why.
            return Ok((LOWEST, 0.0));
        };
        while known[0] < seconds && low < self.highest {
            let high = (low + STEP).min(self.highest);
            let Some(next) = rehearsed(high)? else {
                break;
            };
            if next[0] >= seconds {
                let share = (seconds / known[0]).ln() / (next[0] / known[0]).ln();
                let level = low + share * (high - low);
                let each = known[1] * (next[1] / known[1]).powf(share);
                (low, known) = (level, [seconds, each]);
                break;
            }
            (low, known) = (high, next);
        }
        let amounts = self.amounts(low);
        observe(Event::Note(format!(
            "time for about {} iterations with {} Gaussians on photos of {} pixels",
            amounts.iterations,
            amounts.max_splats,
            self.size(&amounts).map(|side| side.to_string()).join("×")
        )));
        Ok((low, known[1]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FAMILY: Family = Family {
        highest: 2.0,
        max_splats: None,
        longest_side: 4_000,
        max_side: None,
        aspect: 0.75,
        points: 10_000,
    };

    #[test]
    fn presets_are_members() {
        for (level, preset) in [
            (0.0, Preset::Draft),
            (1.0, Preset::Balanced),
            (2.0, Preset::Paper),
        ] {
            let (is, wanted) = (FAMILY.amounts(level), preset.amounts());
            assert_eq!(is.iterations, wanted.iterations);
            assert_eq!(is.max_splats, wanted.max_splats);
            assert_eq!(is.sh_degree, wanted.sh_degree);
            assert_eq!(is.max_side, Some(wanted.max_side.unwrap_or(4_000)));
        }
    }

    #[test]
    fn work_grows_with_the_level() {
        let all: Vec<Amounts> = (-5..=20)
            .map(|l| FAMILY.amounts(f64::from(l) / 10.0))
            .collect();
        for pair in all.windows(2) {
            assert!(pair[0].iterations < pair[1].iterations);
            assert!(pair[0].max_splats < pair[1].max_splats);
            assert!(pair[0].max_side < pair[1].max_side);
        }
    }

    #[test]
    fn what_was_asked_for_holds_at_every_level() {
        let family = Family {
            max_splats: Some(5_000),
            max_side: Some(320),
            highest: 0.0,
            ..FAMILY
        };
        let amounts = family.amounts(1.7);
        assert_eq!(amounts.iterations, Preset::Draft.amounts().iterations);
        assert_eq!((amounts.max_splats, amounts.max_side), (5_000, Some(320)));
        assert_eq!(family.size(&amounts), [320, 240]);
        let upright = Family {
            aspect: 1.5,
            ..family
        };
        assert_eq!(upright.size(&amounts), [213, 320]);
    }

    #[test]
    fn small_photos_stay_small() {
        let family = Family {
            longest_side: 500,
            ..FAMILY
        };
        for level in [0.0, 1.0, 1.5, 2.0] {
            assert!(family.amounts(level).max_side.unwrap() <= 500);
        }
    }
}
