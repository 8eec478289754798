//! The oracle: every kernel once more, in `f64` and plain loops.
//!
//! One file a kernel, under the kernel's own name: [`project`], [`shade`],
//! [`tiles`], [`blend`], [`luma_loss`], [`chroma_loss`], [`lab_loss`], [`lbfgs`],
//! [`view_correction`], [`adam`]. [`render`] chains the first four
//! without tiles; [`gradient`] differentiates the chain
//! with dual numbers, so no derivative in here was worked out by hand.
//!
//! The code is generic over [`Number`]. Control flow (cull, skip, stop) looks
//! at the real part only: a dual number takes the path that `f64` takes.
//! Nothing here uses the crate under test.

pub mod adam;
pub mod blend;
pub mod chroma_loss;
pub mod constants;
pub mod gradient;
#[cfg(test)]
mod gradient_tests;
pub mod lab_loss;
pub mod lbfgs;
pub mod linear;
pub mod luma_loss;
pub mod numerics;
pub mod project;
#[cfg(test)]
mod project_tests;
pub mod random;
pub mod render;
pub mod rgb_loss;
pub mod scene;
pub mod shade;
pub mod tiles;
pub mod view;
pub mod view_correction;

use num_dual::{Dual64, DualNum};

/// Scalar of the oracle: `f64`, or a dual number over it.
pub trait Number: DualNum<Primitive = f64> + Copy {}

impl<T: DualNum<Primitive = f64> + Copy> Number for T {}

/// A constant as a dual number, its derivative part zero.
pub fn lift(value: f64) -> Dual64 {
    Dual64::new(value, 0.0)
}

/// A variable as a dual number, its derivative part one.
pub fn seed(value: f64) -> Dual64 {
    Dual64::new(value, 1.0)
}

/// `|value / threshold - 1|`: how far, relatively, a decision was from
/// falling the other way.
pub fn relative_distance(value: f64, threshold: f64) -> f64 {
    (value / threshold - 1.0).abs()
}
