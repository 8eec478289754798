//! Selection of the effects of image formation to simulate, and consistency checks of photos and
//! model.
//!
//! Each effect has a figure of evidence, measured in the capture, and a threshold. Effects that are
//! off are in no kernel and no buffer.

mod background;
mod direction;
mod evidence;
mod exposure;
#[cfg(test)]
pub(crate) mod fixtures;
mod outliers;
mod patch_means;
mod plan;
mod sampling;
mod shell;
mod soundness;
mod teacher;
mod tracks;
mod words;

pub use background::{Backdrop, FarPlaces};
pub use evidence::{Evidence, Survey};
pub use exposure::Exposures;
pub use plan::{Decider, Decision, Effect, Overrules, Plan, TrainingBudget, Trials};
pub use soundness::{
    Agreement, Cause, Contradiction, Contradictory, FEW_POINTS, Levels, PointColors, Reprojection,
    SparsePhotos, doubts, observe_where_projected,
};
pub(crate) use soundness::{correlation, listed};
pub use teacher::{TeacherSamples, TeacherSpread};
pub use tracks::Sample;
pub use words::table;
