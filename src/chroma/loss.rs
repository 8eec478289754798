//! The losses of stage 2 (`shaders/chroma_loss.wgsl`, `shaders/rgb_loss.wgsl`,
//! `shaders/lab_loss.wgsl`).

use bytemuck::{Pod, Zeroable};

/// Pixels that a workgroup of the loss takes.
pub(super) const LOSS_BLOCK: usize = 256;

/// Twin of `struct ChromaLossWeights`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct ChromaLossWeights {
    /// Width and height of the coarser image.
    pub coarser_size: [u32; 2],
    /// Weight of the teacher.
    pub teacher: f32,
    /// Weight of the agreement with the coarser image; 0 where there is none.
    pub agreement: f32,
    /// One over the residual, in CIELAB units, at which the loss has all but
    /// leveled off; 0: it never does.
    pub decline: f32,
    /// Index of this view's correction.
    pub view_index: u32,
    /// 1 where each pixel has a weight.
    pub weighted: u32,
    /// 1 where a and b are judged together, by their distance.
    pub joint: u32,
}

impl ChromaLossWeights {
    /// The teacher's part of a loss that levels off at the residual `robust` in CIELAB
    /// units, and then judges a and b together: a color that is wrong in one is not to be
    /// believed in the other. Without it, L1 of each.
    pub(super) fn robust(robust: Option<f32>) -> Self {
        Self {
            teacher: 1.0,
            decline: robust.map_or(0.0, |residual| 1.0 / residual),
            joint: u32::from(robust.is_some()),
            ..Self::default()
        }
    }
}

/// Twin of `struct Correction`: wanted a/b become gain · ab + offset.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct Correction {
    /// Rows of the gain.
    pub gain: [[f32; 2]; 2],
    /// In CIELAB units.
    pub offset: [f32; 2],
    /// Unused; keeps the size a multiple of 16.
    pub padding: [f32; 2],
}

impl Correction {
    /// Changes nothing.
    pub const NONE: Self = Self {
        gain: [[1.0, 0.0], [0.0, 1.0]],
        offset: [0.0; 2],
        padding: [0.0; 2],
    };

    /// A wanted a/b as corrected.
    pub fn of(&self, [a, b]: [f32; 2]) -> [f32; 2] {
        [0, 1].map(|c: usize| self.gain[c][0] * a + self.gain[c][1] * b + self.offset[c])
    }
}

/// Twin of `struct RgbLossParameters`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct RgbLossParameters {
    /// 1 where each pixel has a weight.
    pub weighted: u32,
}

/// Twin of `struct LabLossParameters`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct LabLossParameters {
    /// Width and height of the coarser image.
    pub coarser_size: [u32; 2],
    /// Weight of the lightness.
    pub lightness: f32,
    /// 1 where the lightness's difference is squared.
    pub squared: u32,
    /// Weight of a and of b.
    pub chroma: f32,
    /// Weight of the agreement of a and of b with the coarser image; 0 where there is none.
    pub agreement: f32,
    /// Weight of the total variation of R, G and B: half the sum of the mean squared differences
    /// across and down.
    pub variation: f32,
    /// 1 where each pixel has a weight.
    pub weighted: u32,
    /// Coarser scales, each half as large as the last, at which both pictures are pooled and
    /// compared; all scales count alike.
    pub pooled: u32,
    /// 1 where R, G and B are compared in place of L, a and b.
    pub in_rgb: u32,
}

/// Color space in which RGB pictures are judged; a/b have one only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Space {
    /// By their distance in RGB.
    Rgb,
    /// By lightness, a and b.
    Lab,
}
