//! Accuracy settings of the rasterizer.
//!
//! docs/results.md has the cost and gain of each (`cargo bench --bench accuracy`).

use serde::{Deserialize, Serialize};

use super::constants::{ALPHA_MIN, TRANSMITTANCE_MIN};

/// Numerical accuracy of a rasterizer. [`DEFAULT`](Self::DEFAULT) draws as viewers do; anything
/// else is for training alone.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(default)]
pub struct RasterNumerics {
    /// Least alpha of a Gaussian that counts at a pixel.
    ///
    /// Also where its tile lists end: a Gaussian of opacity o is seen up to √(2 ln(o / alpha_min))
    /// deviations.
    pub alpha_min: f64,
    /// Least transmittance that a pixel is blended to.
    pub transmittance_min: f64,
    /// Bits of a depth that decide the order, of 32.
    ///
    /// The highest bits of an `f32` above 0, a multiple of 8; the sort takes eight a pass.
    /// Gaussians that agree in all of them keep index order. Of 16 bits, sign and exponent take
    /// nine: depths that differ by less than 1/128.
    pub depth_bits: u32,
    /// Storage of the gradients of tile-list entries.
    pub storage: Storage,
    /// Whose parameters Adam moves; `lazy`: of Gaussians in view.
    pub adam: AdamSteps,
    /// True if pixels that pull a Gaussian apart cancel in its pull: as 3DGS measures it.
    #[serde(skip)]
    #[cfg_attr(test, schemars(skip))]
    pub signed_pulls: bool,
}

/// Storage of a list entry's gradient record, eight figures, until it is summed. Blending's adjoint
/// writes and summing reads as many words as all else in these two together.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Storage {
    /// As `f32`.
    #[default]
    Full,
    /// As the upper half of an `f32`, rounded: a sign, its whole range, seven bits of
    /// fraction. Relative errors up to 2⁻⁸ an entry; what is added up stays `f32`.
    Half,
}

impl Storage {
    /// Words that so many figures take.
    pub fn words(self, figures: usize) -> usize {
        match self {
            Self::Full => figures,
            Self::Half => figures.div_ceil(2),
        }
    }
}

/// Whose parameters Adam moves in an iteration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum AdamSteps {
    /// Everyone's, as Adam is defined: without a gradient moments decay, and parameters
    /// move on by what is left of them.
    #[default]
    Exact,
    /// Those of the Gaussians that the view shows; the others' moments stay too. Bias
    /// corrections count all iterations.
    Lazy,
}

impl RasterNumerics {
    /// As 3D Gaussian splatting computes (Kerbl et al. 2023).
    pub const DEFAULT: Self = Self {
        alpha_min: 1.0 / 255.0,
        transmittance_min: 1e-4,
        depth_bits: 32,
        storage: Storage::Full,
        adam: AdamSteps::Exact,
        signed_pulls: false,
    };

    /// For the kernel that measures pulls.
    pub(super) fn pulls(&self) -> [(&'static str, f64); 1] {
        [("SIGNED_PULLS", f64::from(u8::from(self.signed_pulls)))]
    }

    /// For the kernels that look at alphas only.
    pub(super) fn alpha_cutoff(&self) -> [(&'static str, f64); 1] {
        [("ALPHA_MIN", self.alpha_min)]
    }

    /// For the kernels that stop as well.
    pub(super) fn cutoffs(&self) -> [(&'static str, f64); 2] {
        [
            ("ALPHA_MIN", self.alpha_min),
            ("TRANSMITTANCE_MIN", self.transmittance_min),
        ]
    }
}

impl Default for RasterNumerics {
    fn default() -> Self {
        Self::DEFAULT
    }
}

// The device sees `f32`: both must mean the same.
const _: () = assert!(RasterNumerics::DEFAULT.alpha_min as f32 == ALPHA_MIN);
const _: () = assert!(RasterNumerics::DEFAULT.transmittance_min as f32 == TRANSMITTANCE_MIN);
