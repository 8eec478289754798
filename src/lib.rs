//! gs-chroma: colored 3D Gaussian scenes from grayscale photographs.
//!
//! Imports go down only:
//!
//! ```text
//! cli → auto → tradeoff, view → run, prepare → subject → store → tell → eval, frames, viewers, blocks → report, doctor → luma, chroma → effects, measure, trajectory → raster
//! → capture, splats → gpu, color, sections, download, npy, programs, oracle, compare → disk, hash, input
//! ```
//!
//! [`doctor`] compares the kernels of [`raster`], [`luma`] and [`chroma`] with the [`oracle`],
//! which uses nothing else of the crate. The feature `cli` adds the program.
//!
//! # A whole job
//!
//! Photos with poses in, a colored scene out. Anyone who implements
//! [`chroma::Colorizer`] can color the photos; networks and folders of colored images do
//! ([`chroma::teacher::Teacher`]).
//!
//! ```
//! use std::{error::Error, ops::ControlFlow, path::Path, sync::Arc};
//!
//! use gs_chroma::{
//!     capture::{Dataset, LoadOptions},
//!     chroma::{self, ChromaSettings, teacher::{Teacher, TeacherSettings}},
//!     gpu::Gpu,
//!     luma::{self, LumaSettings},
//!     raster::Raster,
//! };
//!
//! # fn main() -> Result<(), Box<dyn Error>> {
//! let options = LoadOptions { max_side: Some(48), ..LoadOptions::default() };
//! let dataset = Arc::new(Dataset::open(Path::new("assets/demo"), &options, &mut |_| {})?);
//! let gpu = Gpu::open()?;
//! let scene = luma::fit(&gpu, &dataset, &LumaSettings::new(20), &mut |_| ControlFlow::Continue(()))?;
//!
//! let raster = Arc::new(Raster::with(&gpu, scene.settings.raster_options()));
//! let mut teacher = Teacher::open(Path::new("assets/demo/images"), None, &TeacherSettings::default())?;
//! let settings = ChromaSettings { rounds: 2, ..ChromaSettings::irls() };
//! let colored = chroma::colorize(
//!     &raster, &dataset, &scene.splats, &mut teacher, &settings, &mut |_| ControlFlow::Continue(()),
//! )?;
//! assert_eq!(colored.splats.sh.channels, 3);
//! # Ok(())
//! # }
//! ```

#[cfg(feature = "cli")]
pub mod auto;
pub mod blocks;
pub mod capture;
pub mod chroma;
#[cfg(feature = "cli")]
pub mod cli;
pub mod color;
pub mod compare;
mod disk;
pub mod doctor;
#[cfg(feature = "cli")]
mod download;
pub mod effects;
pub mod eval;
pub mod frames;
pub mod gpu;
mod hash;
mod input;
pub mod luma;
pub mod measure;
mod npy;
pub mod oracle;
#[cfg(feature = "cli")]
pub mod prepare;
mod programs;
pub mod raster;
pub mod report;
pub mod run;
mod sections;
pub mod splats;
pub mod store;
pub mod subject;
pub mod tell;
#[cfg(feature = "cli")]
pub mod tradeoff;
pub mod trajectory;
#[cfg(feature = "cli")]
pub mod view;
pub mod viewers;
