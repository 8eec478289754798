//! Consistency of photos, poses and points.
//!
//! Two figures: for the model alone, the reprojection error; for the photos, the correlation of the
//! colors of COLMAP's points with the photo at their observations. Bounds and measurements are in
//! docs/limits.md.

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
