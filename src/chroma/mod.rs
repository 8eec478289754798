//! Stage 2: colour, distilled from a teacher into frozen geometry.

mod bake_rgb;
mod correction;
mod degree;
mod distil;
mod distill;
mod fill;
mod irls;
mod lbfgs;
mod loss;
mod pass;
mod picture;
mod rgb;
mod roofline;
mod rows;
mod settings;
pub mod teacher;
mod view;

pub use bake_rgb::bake_rgb;
pub use correction::{CorrectionParameters, Corrections, SUM_GROUPS, SUMS};
pub use degree::{ChosenDegree, LEAST_GAIN, choose_degree};
pub use distil::{Distilled, SolverKind, distil};
pub use distill::{ChromaProgress, Distiller};
pub use fill::fill_unseen;
pub use irls::Solver;
pub use lbfgs::{Lbfgs, LbfgsParameters, System, UNBOUNDED};
pub use loss::{ChromaLossWeights, Correction};
pub use picture::native_rgb;
pub use rgb::{RgbView, bake, fit_rgb};
pub use roofline::minimum_words;
pub use settings::ChromaSettings;
pub use view::ChromaView;
