//! Stage 2: colour, distilled from a teacher into frozen geometry.

mod bake;
mod conjugate;
mod correction;
mod distill;
mod irls;
mod loss;
mod pass;
mod picture;
mod rows;
mod settings;
pub mod teacher;
mod view;

pub use bake::bake_rgb;
pub use conjugate::{Conjugate, ConjugateParameters, System};
pub use correction::{CorrectionParameters, Corrections};
pub use distill::{ChromaProgress, Distiller};
pub use irls::Solver;
pub use loss::{ChromaLossWeights, Correction};
pub use picture::native_rgb;
pub use settings::ChromaSettings;
pub use view::ChromaView;
