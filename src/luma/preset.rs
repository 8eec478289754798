//! Named settings.

use serde::{Deserialize, Serialize};

use super::{LumaSettings, PAPER_ITERATIONS};

/// Amount of work for a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// Small photos, few Gaussians: the bundled garden within a minute on two processor cores, 24.9 dB of
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

serde_plain::derive_display_from_serialize!(Preset);

impl Preset {
    /// All, by the work they are.
    pub const ALL: [Self; 3] = [Self::Draft, Self::Balanced, Self::Paper];

    /// The settings of stage 1.
    pub fn settings(self) -> LumaSettings {
        match self {
            Self::Draft => LumaSettings {
                max_splats: 12_000,
                // A short run only learns noise from the direction of view.
                sh_degree: 0,
                ..LumaSettings::new(700)
            },
            // Twice the Gaussians in half of the iterations are better and no slower.
            Self::Balanced => LumaSettings {
                max_splats: 2_000_000,
                sh_degree: 2,
                stop_when_flat: Some(BALANCED_FLAT),
                ..LumaSettings::new(3_500)
            },
            Self::Paper => LumaSettings {
                max_splats: 3_000_000,
                sh_degree: 3,
                stop_when_flat: Some(FLAT),
                ..LumaSettings::new(PAPER_ITERATIONS)
            },
        }
    }

    /// The longer side that photos are scaled down to, in pixels; `None` leaves them as they
    /// are.
    pub fn max_side(self) -> Option<u32> {
        match self {
            Self::Draft => Some(400),
            Self::Balanced => Some(1_600),
            Self::Paper => None,
        }
    }
}
