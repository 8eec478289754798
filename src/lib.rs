//! gs-chroma: coloured 3D Gaussian scenes from grayscale photographs.
//!
//! Imports go down only:
//!
//! ```text
//! cli → tradeoff → run → report, doctor → luma, chroma → effects, measure → raster → capture, splats
//! → gpu, color, beside, oracle, compare
//! ```
//!
//! [`doctor`] compares the kernels of [`raster`], [`luma`] and [`chroma`] with the [`oracle`],
//! which uses nothing else of the crate. The feature `cli` adds the program.

mod beside;
pub mod capture;
pub mod chroma;
#[cfg(feature = "cli")]
pub mod cli;
pub mod color;
pub mod compare;
pub mod doctor;
pub mod effects;
pub mod gpu;
pub mod luma;
pub mod measure;
pub mod oracle;
pub mod raster;
pub mod report;
pub mod run;
pub mod splats;
#[cfg(feature = "cli")]
pub mod tradeoff;
