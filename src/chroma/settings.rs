//! What stage 2 can be told.

/// Settings of one distillation.
#[derive(Clone, Debug, PartialEq)]
pub struct ChromaSettings {
    /// Iterations; each takes one view through all scales, one step a scale.
    pub iterations: usize,
    /// Degree of the chroma harmonics, 0 to 3. Degree 0 cannot memorise that a
    /// teacher colours the views differently.
    pub sh_degree: u32,
    /// Scales beside the full one: the coarsest is 2^this times smaller. The
    /// paper leaves it open; see docs/decisions.md for the ablation.
    pub coarser_scales: u32,
    /// Weight of the agreement with the next coarser scale, the teacher's being 1.
    pub agreement: f32,
    /// Adam's rate at the first and last iteration, in CIELAB units: the first
    /// lets a colour cross the whole a/b range within some hundred steps, the
    /// last leaves it steadier than half a unit. Exponential between.
    pub rates: [f64; 2],
    /// The rate of the terms beyond the constant one, as a share of it (3DGS).
    pub rest_share: f64,
    /// Residual in CIELAB units at which the loss has all but levelled off, so that
    /// what is plainly wrong in one view does not count; `None`: plain L1.
    pub robust: Option<f32>,
    /// Whether each view's teacher is brought into line with the others (solver only).
    pub corrects_views: bool,
    /// Coarser scales that the solver passes through on its way, one round each.
    pub warm_scales: u32,
    /// Rounds of reweighting at full size.
    pub rounds: usize,
    /// Steps of conjugate gradients in each round.
    pub steps: usize,
    /// Seeds the order of the views.
    pub seed: u64,
}

impl ChromaSettings {
    /// The defaults for so many iterations.
    pub fn new(iterations: usize) -> Self {
        Self {
            iterations,
            sh_degree: 0,
            coarser_scales: 2,
            agreement: 1.0,
            rates: [2.0, 0.1],
            rest_share: 1.0 / 20.0,
            robust: None,
            corrects_views: false,
            warm_scales: 2,
            rounds: 8,
            steps: 5,
            seed: 0,
        }
    }

    /// Adam's rate at `iteration`.
    pub fn rate(&self, iteration: usize) -> f64 {
        let [first, last] = self.rates;
        let t = iteration as f64 / self.iterations.max(1) as f64;
        first * (last / first).powf(t.min(1.0))
    }
}
