//! Settings of stage 2.

use serde::{Deserialize, Serialize};

/// Solver of chroma.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "kebab-case")]
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

/// Settings of one distillation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ChromaSettings {
    /// Solver.
    pub solver: SolverKind,
    /// Degree of the chroma harmonics, 0 to 3.
    ///
    /// Degree 0 cannot memorize that a teacher colors the views differently.
    pub sh_degree: u32,
    /// Coarser scales of Adam beside the full one.
    ///
    /// Each is half as large as the last. The paper leaves their number open. By least squares,
    /// coarser scales make colors paler (docs/experiments.md).
    pub scales: u32,
    /// Weight of Adam's agreement with the next coarser scale.
    ///
    /// The teacher's is 1.
    pub agreement: f32,
    /// Residual at which the loss levels off, in CIELAB units; `None`: plain L1.
    ///
    /// What is plainly wrong in one view does not count.
    pub robust: Option<f32>,
    /// Iterations of Adam.
    ///
    /// Each takes one view through all scales, one step a scale.
    pub iterations: usize,
    /// Adam's rate at the first and last iteration, in CIELAB units.
    ///
    /// The first lets a color cross the whole a/b range within some hundred steps, the last leaves
    /// it steadier than half a unit. Exponential between.
    pub rates: [f64; 2],
    /// Rate of the other harmonics, relative to the constant one's.
    ///
    /// As 3DGS has it.
    pub rest_share: f64,
    /// Seed of the order of Adam's views.
    pub seed: u64,
    /// True if views are corrected in saturation and tint.
    ///
    /// Least squares brings each view's teacher into line with the others.
    pub correct_views: bool,
    /// Rounds of least squares at most.
    ///
    /// In each all views are drawn, reweighted, and a step taken.
    pub rounds: usize,
    /// Rounds end once three in a row move colors less, in CIELAB units.
    ///
    /// The mean over what is drawn, as the loss weighs it. 0: never.
    pub settled: f64,
    /// Pull toward gray, in pixels.
    ///
    /// As strong as so many that show a Gaussian: what depends on fewer stays where the others
    /// leave it.
    pub ridge: f64,
    /// Pull toward the first rounds' result, as a share of the pictures'.
    ///
    /// Of how strongly pictures decide colors: what these decide badly stays. 0: none.
    #[serde(default)]
    pub anchor: f64,
    /// Most memory of the device, in bytes; `None`: up to 2 GiB.
    ///
    /// Solving and baking bring views that do not fit one at a time.
    pub memory_limit: Option<u64>,
    /// True if colors are scaled to the teachers' strength.
    ///
    /// As far as these agree.
    pub match_saturation: bool,
    /// True if Gaussians that no view shows well take their neighbors' color.
    ///
    /// After least squares.
    pub fill: bool,
}

/// In pixels. Less than it says, for the loss of a residual does not grow with its square as
/// this does: a Gaussian of 30 units is held like one that a third of a pixel wants gray. A
/// hundredth of it fits the teacher better and held-out photos worse.
const RIDGE: f64 = 0.01;

/// A twentieth: along directions in which the loss bends twenty times less than in those that are
/// decided best, colors go half of their way.
const ANCHOR: f64 = 0.05;

/// By then anchored colors have come to rest: four times as many change the pictures by less than
/// 0.1 ΔE00 (docs/experiments.md).
const ROUNDS: usize = 12;

/// A tenth of what is just seen.
const SETTLED: f64 = 0.1;

impl ChromaSettings {
    /// The paper's distillation: Adam for so many iterations, three scales.
    pub fn adam(iterations: usize) -> Self {
        Self {
            solver: SolverKind::Adam,
            scales: 2,
            iterations,
            robust: None,
            correct_views: false,
            match_saturation: false,
            fill: false,
            ..Self::irls()
        }
    }

    /// Reweighted least squares; docs/experiments.md has what each choice brings.
    pub fn irls() -> Self {
        Self {
            solver: SolverKind::Irls,
            sh_degree: 0,
            scales: 0,
            agreement: 1.0,
            robust: Some(10.0),
            iterations: 0,
            rates: [2.0, 0.1],
            rest_share: 1.0 / 20.0,
            seed: 0,
            correct_views: true,
            rounds: ROUNDS,
            settled: SETTLED,
            ridge: RIDGE,
            anchor: ANCHOR,
            memory_limit: None,
            match_saturation: true,
            fill: true,
        }
    }

    /// Least squares on wanted values that are right: nothing is doubted, corrected or
    /// filled in.
    pub fn exact() -> Self {
        Self {
            robust: None,
            correct_views: false,
            settled: 0.0,
            anchor: 0.0,
            match_saturation: false,
            fill: false,
            ..Self::irls()
        }
    }

    /// Scales that targets are needed at, the full one included.
    pub fn target_scales(&self) -> usize {
        match self.solver {
            SolverKind::Adam => 1 + self.scales as usize,
            SolverKind::Irls => 1,
        }
    }
}
