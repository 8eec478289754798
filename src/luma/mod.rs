//! Stage 1: geometry and luminance from grayscale photographs.

pub mod densify;
mod loss;
mod memory;
mod numerics;
pub mod outliers;
mod photos;
pub mod relocation;
mod settings;
mod trainer;
mod view;
mod workspace;

pub use densify::DensifyParameters;
pub use loss::{LossEffects, LumaLossParameters};
pub use memory::Demand;
pub use numerics::{Numerics, SsimWindow};
pub use settings::{Densification, LumaSettings, Schedule};
pub use trainer::{LumaProgress, LumaTrainer};
pub use view::TrainingView;
