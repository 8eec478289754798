//! Stage 1: geometry and luminance from grayscale photographs.

pub mod densify;
mod loss;
mod settings;
mod trainer;
mod workspace;

pub use densify::DensifyParameters;
pub use settings::{LumaSettings, Schedule};
pub use trainer::{LumaProgress, LumaTrainer, TrainingView};
