//! Named amounts of work.

use clap::ValueEnum;
use serde::{Deserialize, Serialize};

use crate::{
    capture::LoadOptions,
    effects::{Effect, Overrules, Room},
    gpu::Gpu,
};

/// How much work to put into a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// Small photos, few Gaussians: the bundled garden in 30 s on two processor cores, 23.6 dB of
    /// its held-out photos.
    Draft,
    /// For a GPU; goes back to its best and ends where twice the iterations would bring less than
    /// 0.3 dB: on two processor cores small photos of three scenes took 1.5 to 6.2 times as long
    /// as a draft with as many Gaussians, for 0.5 to 1.9 dB more.
    Balanced,
    /// The schedule of the ChromaDistill paper, for a GPU: 15,000 luma iterations, chroma until
    /// 30,000; luma ends as in `balanced`, below 0.1 dB: the same three scenes took 1.3 to 2.6 times as
    /// long as with `balanced`, for up to 0.35 dB more, or nothing where photos are few.
    Paper,
}

/// Gain of twice the iterations, in dB, below which `paper` ends, and what is asked to end
/// where flat.
pub const FLAT: f64 = 0.1;

/// The same for `balanced`: a gain that is worth twice the time to few.
const BALANCED_FLAT: f64 = 0.3;

/// What a preset stands for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Amounts {
    /// Luma iterations.
    pub iterations: usize,
    /// Last chroma iteration.
    pub until: usize,
    /// Cap on Gaussians.
    pub max_splats: usize,
    /// Longer side of the photos.
    pub max_side: Option<u32>,
    /// Degree of the luma harmonics.
    pub sh_degree: u32,
    /// Training ends where twice the iterations would bring less than so many dB.
    pub flat: Option<f64>,
}

impl Amounts {
    /// The level of [`Self::SKETCH`].
    pub const LOWEST: f64 = -0.5;

    /// The least work that makes a scene. With fewer iterations there is none yet, so time
    /// is saved on Gaussians and pixels (docs/accuracy-and-time.md).
    pub const SKETCH: Self = Self {
        iterations: 350,
        until: 500,
        max_splats: 3_000,
        max_side: Some(240),
        sh_degree: 0,
        flat: None,
    };

    /// What there is room for.
    pub fn room(&self) -> Room {
        Room {
            sh_degree: self.sh_degree,
            iterations: self.iterations,
        }
    }
}

impl Preset {
    /// All, by the work they are.
    pub(super) const ALL: [Self; 3] = [Self::Draft, Self::Balanced, Self::Paper];

    /// Its place in [`Self::ALL`].
    pub(super) fn level(self) -> f64 {
        f64::from(self as u8)
    }

    /// The greatest preset that is no more work than a level.
    pub(super) fn below(level: f64) -> Self {
        Self::ALL[(level.max(0.0) as usize).min(2)]
    }

    /// Amounts at a level from [`Amounts::LOWEST`] to 2: those of a preset at its own level,
    /// and between two for equal steps each grown by the same factor. `longest` is the longer
    /// side of the photos as they are.
    pub(super) fn at_level(level: f64, longest: u32) -> Amounts {
        let [draft, balanced, paper] = Self::ALL.map(Self::amounts);
        let (from, to, share) = match level {
            _ if level < 0.0 => (Amounts::SKETCH, draft, 1.0 - level / Amounts::LOWEST),
            _ if level < 1.0 => (draft, balanced, level),
            _ => (balanced, paper, level - 1.0),
        };
        let between = |amount: &dyn Fn(&Amounts) -> f64| {
            let [from, to] = [&from, &to].map(amount);
            (from * (to / from).powf(share)).round()
        };
        let degree = f64::from(from.sh_degree)
            + share * (f64::from(to.sh_degree) - f64::from(from.sh_degree));
        let side = |amounts: &Amounts| f64::from(amounts.max_side.unwrap_or(longest).min(longest));
        Amounts {
            iterations: between(&|a| a.iterations as f64) as usize,
            until: between(&|a| a.until as f64) as usize,
            max_splats: between(&|a| a.max_splats as f64) as usize,
            max_side: Some(between(&side) as u32),
            sh_degree: degree as u32,
            // What says how much is to be done is the level.
            flat: None,
        }
    }

    /// What there is time for on a device.
    pub(super) fn for_device(gpu: &Gpu) -> Self {
        if gpu.is_software() {
            Self::Draft
        } else {
            Self::Paper
        }
    }

    pub(super) fn amounts(self) -> Amounts {
        match self {
            Self::Draft => Amounts {
                iterations: 700,
                until: 850,
                max_splats: 12_000,
                max_side: Some(400),
                // A short run only learns noise from the direction of view.
                sh_degree: 0,
                flat: None,
            },
            Self::Balanced => Amounts {
                // Twice the Gaussians in half of the iterations are better and no slower
                // (docs/decisions.md).
                iterations: 3_500,
                until: 6_500,
                max_splats: 2_000_000,
                max_side: Some(1_600),
                sh_degree: 2,
                flat: Some(BALANCED_FLAT),
            },
            Self::Paper => Amounts {
                iterations: 15_000,
                until: 30_000,
                max_splats: 3_000_000,
                max_side: None,
                sh_degree: 3,
                flat: Some(FLAT),
            },
        }
    }

    /// Its amounts where nothing else is asked for.
    pub(super) fn asked(
        self,
        iterations: Option<usize>,
        max_splats: Option<usize>,
        max_side: Option<u32>,
    ) -> Amounts {
        let amounts = self.amounts();
        Amounts {
            iterations: iterations.unwrap_or(amounts.iterations),
            max_splats: max_splats.unwrap_or(amounts.max_splats),
            max_side: max_side.or(amounts.max_side),
            // Who says how many iterations wants them all.
            flat: amounts.flat.filter(|_| iterations.is_none()),
            ..amounts
        }
    }

    /// The options with the preset's longer side where they leave it open, and with
    /// what is overruled about the lens.
    pub(super) fn load_options(self, asked: &LoadOptions, overrules: &Overrules) -> LoadOptions {
        LoadOptions {
            max_side: asked.max_side.or(self.amounts().max_side),
            lens: overrules.choice(Effect::Lens),
            ..asked.clone()
        }
    }

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Draft => "draft",
            Self::Balanced => "balanced",
            Self::Paper => "paper",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_presets_end_where_flat_unless_told_how_long() {
        let flat = |preset: Preset, iterations| preset.asked(iterations, None, None).flat;
        assert_eq!(flat(Preset::Draft, None), None);
        assert_eq!(flat(Preset::Balanced, None), Some(0.3));
        assert_eq!(flat(Preset::Paper, None), Some(0.1));
        assert_eq!(flat(Preset::Balanced, Some(3_500)), None);
    }
}
