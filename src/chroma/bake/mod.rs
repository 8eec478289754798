//! From luma and chroma to the RGB harmonics that viewers blend.

mod fit;
mod gaussian;

pub(super) use fit::{BakeStep, bake_telling};
pub use fit::{bake, fit_rgb};
pub use gaussian::bake_rgb;
