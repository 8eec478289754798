//! gs-chroma: colored 3D Gaussian scenes from grayscale photographs.
//!
//! Imports go down only:
//!
//! ```text
//! cli → auto, paint, studio → tradeoff, view → run, prepare → subject → store → tell → eval, frames, viewers, blocks → report, doctor → luma, chroma → effects, measure, trajectory → raster
//! → capture, splats → gpu, color, sections, download, npy, programs, archive, oracle, compare → disk, hash, input, invocation
//! ```
//!
//! `doctor` compares the kernels of [`raster`], [`luma`] and [`chroma`] with the `oracle`, which
//! uses nothing else of the crate. The feature `cli` adds the program.
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
//! };
//!
//! # fn main() -> Result<(), Box<dyn Error>> {
//! let options = LoadOptions { max_side: Some(48), ..LoadOptions::default() };
//! let dataset = Arc::new(Dataset::open(Path::new("assets/demo"), &options, &mut |_| {})?);
//! let gpu = Gpu::open()?;
//! let scene = luma::fit(&gpu, &dataset, &LumaSettings::new(20), &mut |_| ControlFlow::Continue(()))?;
//!
//! let mut teacher = Teacher::open(Path::new("assets/demo/images"), None, &TeacherSettings::default())?;
//! let settings = ChromaSettings { rounds: 2, ..ChromaSettings::irls() };
//! let colored = chroma::colorize(
//!     &scene.raster(&gpu), &dataset, &scene.splats, &mut teacher, &settings, &mut |_| ControlFlow::Continue(()),
//! )?;
//! assert_eq!(colored.splats.sh.channels, 3);
//! # Ok(())
//! # }
//! ```

#![cfg_attr(
    not(feature = "cli"),
    allow(
        dead_code,
        unused_imports,
        reason = "what the lower floors have for the program alone"
    )
)]

#[cfg(feature = "cli")]
mod archive;
#[cfg(feature = "cli")]
mod auto;
#[cfg(feature = "cli")]
mod blocks;
pub mod capture;
pub mod chroma;
#[cfg(feature = "cli")]
mod cli;
pub mod color;
mod compare;
mod disk;
#[cfg(feature = "cli")]
mod doctor;
#[cfg(feature = "cli")]
mod download;
pub mod effects;
#[cfg(feature = "cli")]
mod eval;
#[cfg(feature = "cli")]
mod frames;
pub mod gpu;
mod hash;
mod input;
mod invocation;
pub mod luma;
pub mod measure;
mod npy;
mod oracle;
#[cfg(feature = "cli")]
mod paint;
#[cfg(feature = "cli")]
mod prepare;
#[cfg(feature = "cli")]
mod programs;
pub mod raster;
#[cfg(feature = "cli")]
mod report;
#[cfg(feature = "cli")]
mod run;
#[cfg(feature = "cli")]
mod sections;
pub mod splats;
#[cfg(feature = "cli")]
mod store;
#[cfg(feature = "cli")]
mod studio;
#[cfg(feature = "cli")]
mod subject;
#[cfg(feature = "cli")]
mod tell;
#[cfg(feature = "cli")]
mod tradeoff;
pub mod trajectory;
#[cfg(feature = "cli")]
mod view;
#[cfg(feature = "cli")]
mod viewers;

/// Kernels, oracle, doctor and the program's own floors, for its tests, benchmarks and tools; no
/// promises between versions.
pub mod low_level {
    pub use crate::invocation::{Invocation, variables};
    #[cfg(feature = "cli")]
    pub use crate::{
        cli::{AnswerError, Cli, CliError, answer},
        store::RunFolder,
        tell::Event,
    };

    /// Comparators.
    pub mod compare {
        pub use crate::compare::*;
    }

    /// Kernels against the oracle, on the user's own device.
    #[cfg(feature = "cli")]
    pub mod doctor {
        pub use crate::doctor::*;
    }

    /// Every kernel once more, in `f64` and plain loops.
    pub mod oracle {
        pub use crate::oracle::*;
    }

    /// A training with everything that the program adds.
    #[cfg(feature = "cli")]
    pub mod run {
        pub use crate::run::{FitRequest, Preset, fit};
    }

    /// Scenes for other viewers.
    #[cfg(feature = "cli")]
    pub mod viewers {
        pub use crate::viewers::{FitSettings, Pictures, Viewer, fit, pictures, shown_psnr, start};
    }
}
