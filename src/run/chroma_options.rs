//! What `colorize` can be told about the solving, and the settings it stands for.

use crate::chroma::{ChromaSettings, SolverKind};

/// Degree of the chroma harmonics.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Degree {
    /// This one.
    Fixed(u32),
    /// As high as training views that are held back prove useful.
    Auto,
}

/// How chroma is solved for; `None` leaves the choice to the solver's defaults.
#[derive(Clone, Debug, PartialEq)]
pub struct ChromaOptions {
    /// Who solves.
    pub solver: SolverKind,
    /// Degree of the chroma harmonics.
    pub sh_degree: Degree,
    /// Coarser scales that count beside the full one.
    pub scales: Option<u32>,
    /// Rounds of least squares at full size.
    pub rounds: Option<usize>,
    /// Rounds on each coarser scale that least squares passes through on its way.
    pub coarse_rounds: Option<usize>,
    /// Residual, in CIELAB units, at which the loss levels off; infinite: plain L1.
    pub robust: Option<f32>,
    /// Whether each view's teacher is brought into line with the others.
    pub correct_views: Option<bool>,
    /// Whether Gaussians that no view sees well take their neighbours' colour.
    pub fill: Option<bool>,
}

impl Default for ChromaOptions {
    fn default() -> Self {
        Self {
            solver: SolverKind::Irls,
            sh_degree: Degree::Fixed(0),
            scales: None,
            rounds: None,
            coarse_rounds: None,
            robust: None,
            correct_views: None,
            fill: None,
        }
    }
}

impl ChromaOptions {
    /// The settings of one distillation with harmonics of `sh_degree`; `iterations` are
    /// Adam's.
    pub(super) fn settings(&self, iterations: usize, sh_degree: u32, seed: u64) -> ChromaSettings {
        let base = match self.solver {
            SolverKind::Irls => ChromaSettings::irls(),
            SolverKind::Adam => ChromaSettings::adam(iterations),
        };
        ChromaSettings {
            sh_degree,
            seed,
            coarser_scales: self.scales.unwrap_or(base.coarser_scales),
            rounds: self.rounds.unwrap_or(base.rounds),
            warm_rounds: self.coarse_rounds.unwrap_or(base.warm_rounds),
            robust: match self.robust {
                Some(residual) => Some(residual).filter(|r| r.is_finite()),
                None => base.robust,
            },
            corrects_views: self.correct_views.unwrap_or(base.corrects_views),
            fills: self.fill.unwrap_or(base.fills),
            ..base
        }
    }
}
