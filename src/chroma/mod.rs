//! Stage 2: colour, distilled from a teacher into frozen geometry.

mod bake;
mod distill;
mod loss;
mod pass;
mod picture;
mod settings;
pub mod teacher;

pub use bake::bake_rgb;
pub use distill::{ChromaProgress, ChromaView, Distiller};
pub use loss::ChromaLossWeights;
pub use picture::native_rgb;
pub use settings::ChromaSettings;
