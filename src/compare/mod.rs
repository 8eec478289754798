//! Comparators: how tests decide that two arrays agree.
//!
//! Each takes what a kernel gave (`actual`) and what the oracle says
//! (`expected`), returns its figures, and decides in `check()`. Anything that
//! is not finite fails, and so do arrays of different or no length: a
//! comparison of nothing proves nothing. `tests.rs` feeds every comparator
//! wrong answers.
//!
//! - [`Elementwise`]: absolute plus relative bound on every element.
//! - [`relative_l2`], [`cosine`], [`signed_bias`]: of gradients as a whole;
//!   [`GradientBounds`] is all of them with an elementwise bound.
//! - [`FlipBounds`]: a tight bound, and a capped, even-handed share of
//!   elements that may fall the other way at a discontinuity.

mod elementwise;
mod flips;
mod gradient;
#[cfg(test)]
mod tests;

pub use elementwise::{Elementwise, ElementwiseFigures};
pub use flips::{FlipBounds, FlipFigures};
pub use gradient::{
    BiasFigures, Figure, GradientBounds, GradientFigures, cosine, relative_l2, signed_bias,
};

/// `f32` results as `f64`.
pub fn widen(values: &[f32]) -> Vec<f64> {
    values.iter().map(|&v| f64::from(v)).collect()
}

/// `f64` values as the device takes them.
pub fn narrow<'a>(values: impl IntoIterator<Item = &'a f64>) -> Vec<f32> {
    values.into_iter().map(|&v| v as f32).collect()
}

/// Returns the reason why two arrays cannot be compared, if any.
fn unfit(actual: &[f64], expected: &[f64]) -> Option<String> {
    if actual.len() != expected.len() {
        return Some(format!(
            "{} elements against {}",
            actual.len(),
            expected.len()
        ));
    }
    if actual.is_empty() {
        return Some("nothing to compare".to_owned());
    }
    let bad = |values: &[f64]| values.iter().position(|v| !v.is_finite());
    if let Some(index) = bad(actual) {
        return Some(format!("actual[{index}] = {}", actual[index]));
    }
    bad(expected).map(|index| format!("expected[{index}] = {}", expected[index]))
}
