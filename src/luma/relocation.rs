//! Densification by relocation (Kheradmand et al. 2024, "3D Gaussian Splatting as
//! Markov Chain Monte Carlo"; `shaders/relocation.wgsl`).
//!
//! Gaussians that have faded are put where others are, chosen by opacity, and the set
//! grows by a fixed share until the cap. Several in one place show what one showed.
//! Noise, shaped like each Gaussian, lets faint ones explore; a pull towards small and
//! faint ones frees those that nobody needs.

use bytemuck::{Pod, Zeroable};

use super::{
    LumaSettings,
    densify::{Descent, Evidence},
};
use crate::{
    gpu::{Bindings, Buffer, Gpu, GpuError, Kernel, Recorder, groups_for, shaders},
    raster::{Model, constants::*},
};

/// Weight of the mean opacity in the loss, the paper's.
const OPACITY_WEIGHT: f64 = 0.01;

/// Weight of the mean standard deviation, in shares of the extent: the paper's 0.01
/// in world units of scenes some five units wide.
const SCALE_WEIGHT: f64 = 0.05;

/// Noise for a learning rate of the means of 1, the paper's.
const NOISE: f64 = 5e5;

/// Opacities of relocated Gaussians stay this far from 0 and 1.
const OPACITY_MARGIN: f64 = 0.005;

/// Nodes and reach of the quadrature in [`width_of`]: beyond 6 the integrand is
/// below 1e-15 a copy, and the trapezoidal rule on it converges like e^(-1/h²).
const NODES: usize = 121;
const REACH: f64 = 6.0;

/// Twin of `struct RelocationParameters`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
pub struct RelocationParameters {
    /// Gaussians.
    pub splat_count: u32,
    /// Of the noise.
    pub seed: u32,
    /// World units of noise for one world unit of variance.
    pub noise: f32,
    /// Those that move; the others, behind them, stay.
    pub trained: u32,
}

impl RelocationParameters {
    /// For a step of `model` with the means' `rate` in world units.
    pub fn new(model: &Model, seed: u64, iteration: usize, rate: f64) -> Self {
        let mut random = fastrand::Rng::with_seed(seed ^ (iteration as u64).rotate_left(32));
        Self {
            splat_count: model.len() as u32,
            trained: (model.len() - model.held) as u32,
            seed: random.u32(..),
            noise: (NOISE * rate) as f32,
        }
    }
}

/// Weights of each opacity and each standard deviation in the loss of `count`
/// Gaussians in a scene of this extent.
pub fn weights(count: usize, extent: f64) -> [f32; 2] {
    let each = 1.0 / count.max(1) as f64;
    [OPACITY_WEIGHT * each, SCALE_WEIGHT * each / (3.0 * extent)].map(|weight| weight as f32)
}

/// The kernel.
pub struct RelocationKernel(Kernel);

impl RelocationKernel {
    /// Compiles it.
    pub fn new(gpu: &Gpu) -> Self {
        Self(Kernel::new(gpu, "relocation_noise", shaders::RELOCATION))
    }
}

/// The noise, tied to its buffers.
pub struct Relocation {
    parameters: Buffer<RelocationParameters>,
    noise: Bindings,
    count: usize,
}

impl Relocation {
    /// Ties the kernel to `geometry`, planes `[11, N]`.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        gpu: &Gpu,
        kernel: &RelocationKernel,
        status: &Buffer<u32>,
        geometry: &Buffer<f32>,
    ) -> Result<Self, GpuError> {
        let nothing = RelocationParameters::default();
        let parameters = Buffer::uniform(gpu, "relocation parameters", &nothing)?;
        let buffers = [parameters.raw(), status.raw(), geometry.raw()];
        Ok(Self {
            noise: kernel.0.bind(gpu, &buffers),
            count: geometry.len() / GEOMETRY_PLANES,
            parameters,
        })
    }

    /// Records the noise: after the step.
    pub fn record(
        &self,
        gpu: &Gpu,
        kernel: &RelocationKernel,
        recorder: &mut Recorder,
        parameters: &RelocationParameters,
    ) {
        self.parameters.write(gpu, &[*parameters]);
        recorder.dispatch(&kernel.0, &self.noise, groups_for(self.count));
    }
}

/// Plans one relocation: Gaussians that stay as they are in their old order, then
/// those that share a place, then those that are held.
pub fn plan(settings: &LumaSettings, evidence: &Evidence<'_>, iteration: usize) -> Vec<Descent> {
    let n = evidence.geometry.len() / GEOMETRY_PLANES;
    let at = |plane: usize, i: usize| evidence.geometry[plane * n + i];
    let opacity = |i: usize| 1.0 / (1.0 + f64::from(-at(PLANE_OPACITY, i)).exp());
    // Positively written: whatever is not a number does not live.
    let trained = n - evidence.held;
    let alive: Vec<usize> = (0..trained)
        .filter(|&i| {
            opacity(i) >= settings.prune_opacity
                && (0..GEOMETRY_PLANES).all(|plane| at(plane, i).is_finite())
        })
        .collect();
    let mut total = 0.0;
    let sums: Vec<f64> = (alive.iter())
        .map(|&i| {
            total += opacity(i);
            total
        })
        .collect();
    let grown = (trained as f64 * (1.0 + settings.growth)).ceil() as usize;
    let wanted = grown.min(evidence.room(settings)).max(trained);
    let mut random = fastrand::Rng::with_seed(settings.seed ^ iteration as u64);
    let mut copies = vec![1_usize; alive.len()];
    if !alive.is_empty() {
        for _ in alive.len()..wanted {
            let drawn = random.f64() * total;
            let place = sums.partition_point(|&sum| sum <= drawn);
            copies[place.min(alive.len() - 1)] += 1;
        }
    }
    let survivors = (alive.iter().zip(&copies)).filter(|(_, copies)| **copies == 1);
    let mut plan: Vec<Descent> = survivors
        .map(|(&i, _)| Descent {
            source: i as u32,
            survives: 1,
            ..Descent::default()
        })
        .collect();
    for (&i, &copies) in alive.iter().zip(&copies) {
        if copies > 1 {
            let share = share_of(i as u32, copies, f64::from(at(PLANE_OPACITY, i)));
            plan.extend(std::iter::repeat_n(share, copies));
        }
    }
    if !plan.is_empty() {
        plan.extend(evidence.held_ones());
    }
    plan
}

/// One of several copies that together show what the source showed: the same opacity
/// in the middle, the same integral of it along a line through it (the paper's
/// equation 9).
fn share_of(source: u32, copies: usize, logit: f64) -> Descent {
    let whole = 1.0 / (1.0 + (-logit).exp());
    let opacity = 1.0 - (1.0 - whole).powf(1.0 / copies as f64);
    let opacity = opacity.clamp(OPACITY_MARGIN, 1.0 - OPACITY_MARGIN);
    let growth = (whole / width_of(opacity, copies)).ln() as f32;
    Descent {
        source,
        log_growth: [growth; 3],
        logit_step: ((opacity / (1.0 - opacity)).ln() - logit) as f32,
        ..Descent::default()
    }
}

/// The integral over x of what `copies` Gaussians o·e^(-x²) in one place show, over
/// that of e^(-x²). The paper expands it into an alternating sum of binomials, which
/// loses all digits beyond some fifty copies; this is the integral itself.
fn width_of(opacity: f64, copies: usize) -> f64 {
    let step = 2.0 * REACH / (NODES - 1) as f64;
    let shown = |node: usize| {
        let x = node as f64 * step - REACH;
        1.0 - (1.0 - opacity * (-x * x).exp()).powi(copies as i32)
    };
    (0..NODES).map(shown).sum::<f64>() * step / std::f64::consts::PI.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The paper's double sum.
    fn binomial_sum(opacity: f64, copies: usize) -> f64 {
        let mut sum = 0.0;
        for i in 1..=copies {
            let mut binomial = 1.0;
            for k in 0..i {
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                sum += sign * binomial * opacity.powi(k as i32 + 1) / ((k + 1) as f64).sqrt();
                binomial *= (i - 1 - k) as f64 / (k + 1) as f64;
            }
        }
        sum
    }

    #[test]
    fn widths_are_the_papers() {
        for opacity in [0.005, 0.3, 0.9, 0.995] {
            for copies in [1, 2, 3, 7, 12] {
                let [ours, theirs] = [width_of, binomial_sum].map(|f| f(opacity, copies));
                assert!(
                    (ours / theirs - 1.0).abs() < 1e-9,
                    "{opacity}, {copies}: {ours} {theirs}"
                );
            }
        }
        // Where the sum has lost itself.
        let many = width_of(0.9, 1000);
        assert!(many > width_of(0.9, 100) && many < 4.0, "{many}");
    }

    #[test]
    fn copies_show_what_one_showed() {
        let alone = share_of(3, 1, 0.4);
        assert!(alone.logit_step.abs() < 1e-6 && alone.log_growth[0].abs() < 1e-6);
        let pair = share_of(3, 2, 0.4);
        let whole = 1.0 / (1.0 + (-0.4_f64).exp());
        let half = 1.0 / (1.0 + (-0.4 - f64::from(pair.logit_step)).exp());
        assert!((1.0 - (1.0 - half).powi(2) - whole).abs() < 1e-6);
        // Two flat-topped together are wider than one, so each is narrower.
        assert!(pair.log_growth[0] < 0.0);
    }

    fn geometry(logits: &[f32]) -> Vec<f32> {
        let n = logits.len();
        let mut geometry = vec![0.0; GEOMETRY_PLANES * n];
        geometry[PLANE_QUAT * n..(PLANE_QUAT + 1) * n].fill(1.0);
        geometry[PLANE_OPACITY * n..].copy_from_slice(logits);
        geometry
    }

    fn planned(settings: &LumaSettings, logits: &[f32]) -> Vec<Descent> {
        let evidence = Evidence {
            geometry: &geometry(logits),
            statistics: &[],
            held: 0,
            reserved: 0,
        };
        plan(settings, &evidence, 7)
    }

    #[test]
    fn the_faded_go_where_others_are_and_the_cap_holds() {
        let settings = LumaSettings {
            growth: 0.5,
            max_splats: 11,
            ..LumaSettings::new(1000)
        };
        let mut logits = [1.0; 10];
        logits[4] = -9.0;
        logits[7] = f32::NAN;
        let plan = planned(&settings, &logits);
        assert_eq!(plan.len(), 11);
        assert!(plan.iter().all(|descent| ![4, 7].contains(&descent.source)));
        // Each of the living is still there.
        for i in (0..10).filter(|i| ![4, 7].contains(i)) {
            assert!(plan.iter().any(|descent| descent.source == i));
        }
        assert_eq!(plan, planned(&settings, &logits));
        // A full set is never cut.
        let full = LumaSettings {
            max_splats: 5,
            ..settings
        };
        assert_eq!(planned(&full, &[1.0; 10]).len(), 10);
        assert!(planned(&full, &[-9.0; 3]).is_empty());
    }
}
