//! Scenes larger than one machine: a capture divided into blocks on the ground, each with the
//! photos that show it, so that each is trained by itself and all are put together again.
//!
//! As in VastGaussian (Lin et al. 2024) and CityGaussian (Liu et al. 2024): cells of equal work,
//! neighbors that overlap, views by what they see, and of what a block trains only what lies in
//! its own cell is kept, outer cells reaching to infinity.

mod area;
mod cells;
mod error;
mod estimate;
mod ground;
mod job;
mod picture;
mod plan;
mod region;
mod seen;

pub use area::Area;
pub use cells::Blocks;
pub use error::BlocksError;
pub use estimate::Estimate;
pub use ground::Ground;
pub use job::{Block, BlockFile, COARSE, JOB_VERSION, Job, Kind, refuse_link};
pub use picture::picture;
pub use plan::{Division, FAR_PART, PartitionPlan, plan};
pub use region::Region;
pub use seen::PhotoCoverage;
