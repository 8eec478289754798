//! gs-chroma: coloured 3D Gaussian scenes from grayscale photographs.
//!
//! Imports go down only: `cli` → `tradeoff` → `run`, `report` → `luma`, `chroma`, `measure` →
//! `raster` → `gpu` → `splats`, `capture`, `color`. [`doctor`] compares the kernels
//! of `raster` with the [`oracle`], which uses nothing else of the crate.

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
