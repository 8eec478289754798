//! Stage 2 as a whole: one of the solvers, and colour for what no view shows.

use std::sync::Arc;

use super::{ChromaProgress, ChromaSettings, ChromaView, Distiller, Solver, fill_unseen};
use crate::{
    gpu::GpuError,
    raster::{Load, Raster},
    splats::{ShField, Splats},
};

/// How chroma is solved for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum SolverKind {
    /// Reweighted least squares over all views, sped up by L-BFGS.
    Irls,
    /// The paper's: stochastic steps of Adam, coarse to fine.
    Adam,
}

impl SolverKind {
    /// Its name in reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Irls => "irls",
            Self::Adam => "adam",
        }
    }
}

/// What a distillation found.
pub struct Distilled {
    /// The chroma of each Gaussian.
    pub chroma: ShField,
    /// What a dispatch worked on, the mean over the passes.
    pub load: Load,
}

/// Distils the views' wanted a/b into chroma harmonics of the frozen `splats`. `extent`
/// is the scene's, in world units.
///
/// # Errors
/// [`GpuError`] when it does not fit or the device is lost.
///
/// # Panics
/// Without views, or when a wanted image has not its camera's size.
pub fn distil(
    raster: &Arc<Raster>,
    settings: &ChromaSettings,
    extent: f64,
    splats: &Splats,
    views: Vec<ChromaView>,
    observe: &mut dyn FnMut(ChromaProgress),
) -> Result<Distilled, GpuError> {
    match settings.solver {
        SolverKind::Adam => {
            let mut adam = Distiller::new(raster.clone(), settings.clone(), extent, splats, views)?;
            adam.run(observe)?;
            Ok(Distilled {
                chroma: adam.chroma()?,
                load: adam.load()?,
            })
        }
        SolverKind::Irls => {
            let mut solver = Solver::new(raster.clone(), settings, extent, splats, &views)?;
            solver.run(observe)?;
            let mut chroma = solver.chroma()?;
            if settings.fills {
                fill_unseen(splats, &mut chroma, &solver.seen()?);
            }
            Ok(Distilled {
                chroma,
                load: solver.load()?,
            })
        }
    }
}
