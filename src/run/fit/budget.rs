//! Amount of work within a time limit.
//!
//! The presets are points of one family: from a sketch over `draft` (level 0) and `balanced`
//! (1) to `paper` (2) iterations, Gaussians and pixels grow together, between two of these
//! each by the same factor for equal steps.

use std::{sync::Arc, time::Instant};

use serde::{Deserialize, Serialize};

use super::request::FitRequest;
use crate::{
    capture::{Capture, LoadOptions},
    gpu::GpuError,
    luma::{Goal, LumaError, LumaOverlay, LumaSettings, Schedule, seconds_per_iteration},
    raster::Raster,
    run::{Preset, RunError, preset::Workload},
    tell::{Event, Observer, Stage},
};

/// Lowest level of a family: that of the sketch.
const LOWEST: f64 = -0.5;

/// Between two levels whose cost is measured.
const STEP: f64 = 0.5;

/// Fewer iterations than this make no scene.
pub(super) const ITERATIONS_MIN: usize = 50;

/// Share of a time limit that is left for writing files.
pub(super) const WRITING: f64 = 0.01;

/// Share of a time limit that is taken to be for training as long as nobody knows how long
/// photos take to read.
const SURELY: f64 = 0.9;

/// The least work that makes a scene. With fewer iterations there is none yet, so time
/// is saved on Gaussians and pixels.
fn sketch() -> Workload {
    Workload {
        settings: LumaSettings {
            max_splats: 3_000,
            sh_degree: 0,
            ..LumaSettings::new(350)
        },
        max_side: Some(240),
    }
}

/// A preset's level.
fn level_of(preset: Preset) -> f64 {
    f64::from(preset as u8)
}

/// The greatest preset that is no more work than a level.
fn preset_below(level: f64) -> Preset {
    Preset::ALL[(level.max(0.0) as usize).min(2)]
}

/// The work at a level from [`LOWEST`] to 2: that of a preset at its own level, and between
/// two for equal steps each amount grown by the same factor. `longest` is the longer side of
/// the photos as they are.
fn at_level(level: f64, longest: u32) -> Workload {
    let [draft, balanced, paper] = Preset::ALL.map(Preset::work);
    let (from, to, share) = match level {
        _ if level < 0.0 => (sketch(), draft, 1.0 - level / LOWEST),
        _ if level < 1.0 => (draft, balanced, level),
        _ => (balanced, paper, level - 1.0),
    };
    let between = |amount: &dyn Fn(&Workload) -> f64| {
        let [from, to] = [&from, &to].map(amount);
        (from * (to / from).powf(share)).round()
    };
    let degree = |work: &Workload| f64::from(work.settings.sh_degree);
    let degree = degree(&from) + share * (degree(&to) - degree(&from));
    let side = |work: &Workload| f64::from(work.max_side.unwrap_or(longest).min(longest));
    Workload {
        settings: LumaSettings {
            max_splats: between(&|work| work.settings.max_splats as f64) as usize,
            sh_degree: degree as u32,
            // What says how much is to be done is the level.
            ..LumaSettings::new(between(&|work| work.settings.iterations as f64) as usize)
        },
        max_side: Some(between(&side) as u32),
    }
}

/// The work that a run is to do.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Budget {
    /// The preset that comes nearest, and no higher than that asked for.
    pub preset: Preset,
    pub work: Workload,
    /// Seconds that an iteration is expected to take; 0 where time does not matter.
    pub each: f64,
}

impl Budget {
    /// Budget of a request on this device: a whole preset, or as much as fits the time limit.
    /// `begun` is the start of the time.
    ///
    /// # Errors
    /// [`RunError::Capture`], and [`GpuError::Lost`] while an iteration is timed.
    pub fn of(
        options: &FitRequest,
        raster: &Arc<Raster>,
        begun: Instant,
        observe: &mut Observer<'_>,
    ) -> Result<Self, RunError> {
        let usual = Preset::for_device(&raster.gpu);
        let preset = options.preset.unwrap_or(match options.goal {
            Goal::Fixed => usual,
            // The most that is tried.
            Goal::Within { .. } | Goal::Reach { .. } => Preset::Paper,
        });
        let mut max_side = options.load.max_side;
        if options.goal.psnr().is_some() {
            // PSNR at different sizes cannot be compared: whatever there is time for, photos
            // are as large as they would be without a target.
            max_side = max_side.or(options.preset.unwrap_or(usual).max_side());
        }
        let Some(limit) = options.goal.seconds() else {
            if options.preset.is_none() && options.goal == Goal::Fixed && raster.gpu.is_software() {
                observe(Event::Note(format!(
                    "{} is not a GPU: using preset draft unless another is named",
                    raster.gpu.info().name
                )));
            }
            return Ok(Self {
                preset,
                work: Workload::asked(preset, &options.settings, max_side),
                each: 0.0,
            });
        };
        observe(Event::begins(Stage::Pace));
        let family = Family::of(options, max_side)?;
        let seconds = SURELY * limit - begun.elapsed().as_secs_f64();
        let (level, each) = family.level_for(seconds, raster, observe)?;
        if options.timings {
            // The timed iterations are no part of the run.
            raster.gpu.timings()?;
        }
        Ok(Self {
            preset: preset_below(level),
            work: family.work(level),
            each,
        })
    }
}

/// Levels of work for a capture and a request.
struct Family<'a> {
    /// The highest level, that of the preset asked for.
    pub highest: f64,
    /// Holds at every level.
    pub overlay: &'a LumaOverlay,
    /// The longer side of the photos as they are.
    pub longest_side: u32,
    /// The longer side at every level.
    pub max_side: Option<u32>,
    /// Height by width.
    pub aspect: f64,
    /// Gaussians to begin with.
    pub points: usize,
}

impl<'a> Family<'a> {
    /// Family for the capture and the options; `max_side` holds at every level.
    fn of(options: &'a FitRequest, max_side: Option<u32>) -> Result<Self, RunError> {
        let of_photos = LoadOptions {
            chosen: options.load.chosen.clone(),
            ..LoadOptions::default()
        };
        let capture = Capture::load_with(&options.colmap_dir, &of_photos)?;
        let sizes = || capture.views.iter().map(|view| view.photo_size());
        let [width, height] = sizes().next().unwrap_or([1, 1]).map(f64::from);
        Ok(Self {
            highest: level_of(options.preset.unwrap_or(Preset::Paper)),
            overlay: &options.settings,
            longest_side: sizes().flatten().max().unwrap_or(1),
            max_side,
            aspect: height / width,
            points: capture.points.len(),
        })
    }

    fn work(&self, level: f64) -> Workload {
        let mut work = at_level(level.clamp(LOWEST, self.highest), self.longest_side);
        self.overlay.apply(&mut work.settings);
        work.max_side = self.max_side.or(work.max_side);
        work
    }

    /// Gaussians, in the mean over a run.
    fn mean_splats(&self, settings: &LumaSettings) -> usize {
        let schedule = Schedule::of(settings);
        let densifications = schedule.densify_until / schedule.densify_every;
        let grown = self.points as f64 * (1.0 + settings.growth).powf(densifications as f64);
        let last = grown.min(settings.max_splats as f64);
        let first = last.min(self.points as f64);
        ((first + last) / 2.0).max(1.0) as usize
    }

    /// The size of the photos.
    fn size(&self, work: &Workload) -> [u32; 2] {
        let side = f64::from(
            work.max_side
                .map_or(self.longest_side, |side| side.min(self.longest_side)),
        );
        let (width, height) = match self.aspect {
            aspect if aspect > 1.0 => (side / aspect, side),
            aspect => (side, side * aspect),
        };
        [width, height].map(|side| side.round().max(1.0) as u32)
    }

    /// The level whose training takes `seconds`, as near as timed iterations on random Gaussians
    /// tells; with it the seconds of an iteration there.
    fn level_for(
        &self,
        seconds: f64,
        raster: &Arc<Raster>,
        observe: &mut Observer<'_>,
    ) -> Result<(f64, f64), RunError> {
        let cost_of = |level: f64| -> Result<Option<[f64; 2]>, RunError> {
            let work = self.work(level);
            let splats = self.mean_splats(&work.settings);
            match seconds_per_iteration(raster, splats, self.size(&work)) {
                Ok(each) => Ok(Some([each * work.settings.iterations as f64, each])),
                Err(LumaError::Gpu(GpuError::TooLarge { .. } | GpuError::TooManySplats { .. })) => {
                    Ok(None)
                }
                Err(error) => Err(error.into()),
            }
        };
        let start = 0.0_f64.min(self.highest);
        let (mut low, mut at_low) = (start, cost_of(start)?);
        if at_low.is_none_or(|[whole, _]| whole > seconds) && start > LOWEST {
            let at_lowest = cost_of(LOWEST)?;
            (low, at_low) = (LOWEST, at_lowest);
        }
        let Some(mut known) = at_low else {
            // Whoever trains will hear why.
            return Ok((LOWEST, 0.0));
        };
        while known[0] < seconds && low < self.highest {
            let high = (low + STEP).min(self.highest);
            let Some(next) = cost_of(high)? else {
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
        let work = self.work(low);
        observe(Event::Note(format!(
            "time for about {} iterations with {} Gaussians on photos of {} pixels",
            work.settings.iterations,
            work.settings.max_splats,
            self.size(&work).map(|side| side.to_string()).join("×")
        )));
        Ok((low, known[1]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn family(overlay: &LumaOverlay) -> Family<'_> {
        Family {
            highest: 2.0,
            overlay,
            longest_side: 4_000,
            max_side: None,
            aspect: 0.75,
            points: 10_000,
        }
    }

    fn nothing() -> LumaOverlay {
        LumaOverlay::default()
    }

    #[test]
    fn presets_are_members() {
        for (level, preset) in [
            (0.0, Preset::Draft),
            (1.0, Preset::Balanced),
            (2.0, Preset::Paper),
        ] {
            let (is, mut wanted) = (family(&nothing()).work(level), preset.settings());
            wanted.stop_when_flat = None;
            assert_eq!(is.settings, wanted);
            assert_eq!(is.max_side, Some(preset.max_side().unwrap_or(4_000)));
        }
    }

    #[test]
    fn work_grows_with_the_level() {
        let all: Vec<Workload> = (-5..=20)
            .map(|l| family(&nothing()).work(f64::from(l) / 10.0))
            .collect();
        for pair in all.windows(2) {
            let [a, b] = [0, 1].map(|k| &pair[k].settings);
            assert!(a.iterations < b.iterations && a.max_splats < b.max_splats);
            assert!(pair[0].max_side < pair[1].max_side);
        }
    }

    #[test]
    fn what_was_asked_for_holds_at_every_level() {
        let overlay = LumaOverlay {
            max_splats: Some(5_000),
            ..LumaOverlay::default()
        };
        let family = Family {
            max_side: Some(320),
            highest: 0.0,
            ..family(&overlay)
        };
        let work = family.work(1.7);
        assert_eq!(work.settings.iterations, 700);
        let caps = (work.settings.max_splats, work.max_side);
        assert_eq!(caps, (5_000, Some(320)));
        assert_eq!(family.size(&work), [320, 240]);
        let upright = Family {
            aspect: 1.5,
            ..family
        };
        assert_eq!(upright.size(&work), [213, 320]);
    }

    #[test]
    fn small_photos_stay_small() {
        let overlay = nothing();
        let family = Family {
            longest_side: 500,
            ..family(&overlay)
        };
        for level in [0.0, 1.0, 1.5, 2.0] {
            assert!(family.work(level).max_side.unwrap() <= 500);
        }
    }
}
