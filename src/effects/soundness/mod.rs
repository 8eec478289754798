//! Whether photos, poses and points contradict each other.
//!
//! Two figures tell. Of the model alone: how far from its observations a point projects. Of the
//! photos: how the colors that COLMAP gave its points correlate with what a photo shows where it
//! saw them. Bounds and what was measured are in docs/soundness.md.

mod cause;
mod colors;
mod contradiction;
mod coverage;
mod doubts;
mod photos;
mod reprojection;

pub(crate) use colors::correlation;
pub use colors::{Agreement, PointColors};
pub use contradiction::{Cause, Contradiction, Contradictory};
pub use coverage::{FEW_POINTS, SparsePhotos};
pub use doubts::{Levels, doubts};
pub(crate) use photos::listed;
pub(super) use photos::median;
pub use reprojection::{Reprojection, observe_where_projected};

#[cfg(test)]
mod tests;
