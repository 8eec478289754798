//! Stage 2: color, distilled from a teacher into frozen geometry.
//!
//! [`Targets`] hold what the teacher wants, [`FrozenViews`] what the cameras see of the
//! geometry; [`IrlsSolver`] or [`AdamSolver`] solve for a/b, and [`bake`] brings them into
//! the RGB that splat files have.

mod adam;
mod bake;
mod checkpoint;
mod colorize;
mod correction;
mod degree;
mod distill;
mod error;
mod field;
mod fill;
mod frozen;
mod frozen_view;
mod host_field;
mod host_lbfgs;
mod host_system;
mod irls;
mod kernels;
mod lbfgs;
mod likeness;
mod loss;
mod memory;
mod passes;
mod picture;
mod plan;
mod progress;
mod recipe;
mod relight;
mod repaint;
mod roofline;
mod saturation;
mod settings;
mod solve;
mod steps;
mod strokes;
mod supervision;
mod targets;
pub mod teacher;
mod view_adjoint;

pub use adam::{AdamSolver, follow_recipe};
pub use bake::{bake, bake_rgb, fit_rgb};
pub use checkpoint::{ChromaCheckpoint, ChromaCheckpointing, NoChromaCheckpoints};
pub use colorize::{Colored, colorize};
pub use correction::{CorrectionKernels, CorrectionParameters, Corrections, SUM_GROUPS, SUMS};
pub use degree::choose_degree;
pub use distill::{ColorizeEvent, ColorizeObserver, Distill, Distilled};
pub use error::{ChromaError, ColorizerError};
pub use field::{Colors, DrawBuffers, Drawing, FrozenField, Primitives};
pub use fill::fill_unseen;
pub use frozen::FrozenViews;
pub use host_field::HostField;
pub use irls::IrlsSolver;
pub use kernels::ChromaKernels;
pub use lbfgs::{
    Lbfgs, LbfgsKernels, LbfgsParameters, LbfgsState, REST, System, UNBOUNDED, diagonal_scale,
};
pub use loss::{ChromaLossWeights, Correction, LabLossParameters, RgbLossParameters};
pub use memory::MemoryBudget;
pub use passes::Task;
pub use picture::native_rgb;
pub use plan::{ChosenDegree, Degree, LEAST_GAIN};
pub use progress::{ChromaObserver, ChromaProgress};
pub use recipe::Recipe;
pub use relight::relight;
pub(crate) use repaint::Repainter;
pub use roofline::minimum_words;
pub use saturation::match_saturation;
pub use settings::{ChromaSettings, SolverKind};
pub use solve::{Solved, solve, unseen_share};
pub(crate) use strokes::{at_middle_lightness, claimed_by_strokes, shaded_at};
pub use supervision::{Colorizer, Supervision, ViewTarget, masked_weights, teach};
pub use targets::{Target, Targets, pack_ab, pack_rgb};
