//! Stage 1: geometry and luminance from grayscale photographs.

mod curve;
pub mod densify;
mod loss;
mod memory;
mod numerics;
pub mod outliers;
mod pace;
mod photos;
mod rehearsal;
pub mod relocation;
mod roofline;
mod settings;
mod trainer;
mod view;
mod workspace;

pub use curve::{CurvePoint, gain_of_doubling};
pub use densify::DensifyParameters;
pub use loss::{LossEffects, LumaLossParameters};
pub use memory::Demand;
pub use numerics::{Numerics, SsimWindow};
pub use rehearsal::{frontal_camera, random_cloud, rehearse};
pub use roofline::minimum_words;
pub use settings::{Densification, LearningRates, LumaSettings, Schedule};
pub use trainer::{Look, LumaProgress, LumaTrainer};
pub use view::TrainingView;
