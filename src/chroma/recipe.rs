//! Colorization recipes of other methods, for comparison: RGB harmonics that Adam moves until
//! images are like the teacher's in CIELAB.

use std::ops::RangeInclusive;

use super::LabLossParameters;

/// A way to color RGB splats whose geometry stays.
#[derive(Clone, Debug, PartialEq)]
pub struct Recipe {
    /// Iterations; each takes one view through all scales, one step a scale.
    pub iterations: usize,
    /// Adam's rate of the constant harmonics at the first and the last iteration, exponential
    /// between.
    pub rates: [f64; 2],
    /// The rate of the other harmonics, up to degree 3, as a share of it; `None`: they stay as
    /// luma has them, the same in all channels.
    pub rest_share: Option<f64>,
    /// Scales that are drawn, 0 the full one, each half as large as the last.
    pub scales: RangeInclusive<usize>,
    /// Weight of a's and b's agreement with the next coarser scale.
    pub agreement: f32,
    /// Weights of the loss.
    pub loss: LabLossParameters,
}

impl Recipe {
    /// ChromaDistill's paper (WACV 2025) for splats: the square of lightness's difference and
    /// the size of a's and of b's in CIELAB units, coarse to fine by algorithm 1, from
    /// iteration 15,000 to 30,000 at the rates of 3DGS, by which all harmonics learn. The
    /// number of scales it leaves open; three are taken, as for a/b by Adam here. Of the losses
    /// that the algorithm sums, each scale's takes a step of its own.
    pub fn chromadistill_paper() -> Self {
        Self {
            iterations: 15_000,
            rates: [2.5e-3; 2],
            rest_share: Some(1.0 / 20.0),
            scales: 0..=2,
            agreement: 1.0,
            loss: LabLossParameters {
                lightness: 1.0,
                squared: 1,
                chroma: 1.0,
                ..LabLossParameters::default()
            },
        }
    }

    /// The paper's without coarser scales.
    pub fn chromadistill_one_scale() -> Self {
        Self {
            scales: 0..=0,
            agreement: 0.0,
            ..Self::chromadistill_paper()
        }
    }

    /// ChromaDistill's released code for splats: 3,000 steps of the constant harmonics on L/50,
    /// a/110 and b/110 of the picture at full, half and quarter size, with total variation.
    /// L is to be the gray photo's, as by default there. Its content loss, a thousandth of
    /// VGG's features, needs a network that it brings along; it is left out.
    pub fn chromadistill_code() -> Self {
        Self {
            iterations: 3_000,
            rates: [1e-2, 1e-3],
            rest_share: None,
            scales: 0..=0,
            agreement: 0.0,
            loss: LabLossParameters {
                lightness: 1.0 / 50.0,
                chroma: 1.0 / 110.0,
                variation: 1.0,
                pooled: 2,
                ..LabLossParameters::default()
            },
        }
    }

    /// The code's on R, G and B from 0 to 1 in place of L, a and b.
    pub fn chromadistill_rgb() -> Self {
        let code = Self::chromadistill_code();
        Self {
            loss: LabLossParameters {
                lightness: 1.0 / 100.0,
                chroma: 1.0 / 100.0,
                in_rgb: 1,
                ..code.loss
            },
            ..code
        }
    }

    /// Scales that targets are needed at, the full one included.
    pub fn target_scales(&self) -> usize {
        1 + self.scales.end()
    }
}
