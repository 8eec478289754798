//! Stage 1: geometry and luminance from grayscale photographs.

mod curve;
pub mod densify;
mod goal;
mod loss;
mod memory;
mod numerics;
pub mod outliers;
mod pace;
mod photos;
mod preset;
mod rehearsal;
pub mod relocation;
mod roofline;
mod schedule;
mod settings;
mod trainer;
mod view;
mod workspace;

pub use curve::{CurvePoint, gain_of_doubling};
pub use densify::DensifyParameters;
pub use goal::Goal;
pub use loss::{LossEffects, LumaLossParameters};
pub use memory::Demand;
pub use numerics::{Numerics, SsimWindow};
pub use preset::{FLAT, Preset};
pub use rehearsal::{frontal_camera, random_cloud, rehearse};
pub use roofline::minimum_words;
pub use schedule::{PAPER_ITERATIONS, Schedule};
pub use settings::{Densification, LearningRates, LumaSettings};
pub use trainer::{Look, LumaProgress, LumaTrainer};
pub use view::TrainingView;
