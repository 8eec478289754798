//! The settings of stage 1. Rates are of the 3DGS paper (Kerbl et al. 2023) unless another
//! reason is given.

use std::sync::Arc;

use serde::{Deserialize, Serialize, de::IgnoredAny};

use super::Numerics;
use crate::{
    effects::{Effect, Plan, TrainingBudget},
    gpu::Gpu,
    raster::{Raster, RasterOptions},
};

/// Luma iterations of ChromaDistill (WACV 2025, supplement).
pub const PAPER_ITERATIONS: usize = 15_000;

/// In a run with fewer iterations the set of Gaussians changes at a pace of its own.
pub(super) const SHORT_RUN: usize = 3_000;

/// Iterations between two looks at the device.
pub(super) const SYNC_EVERY: usize = 25;

/// Learning rates of Adam.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct LearningRates {
    /// Means at the first and last iteration, in scene extents.
    ///
    /// Exponential decay between.
    pub means: [f64; 2],
    /// Unnormalized quaternions.
    pub quats: f64,
    /// Log-scales.
    pub log_scales: f64,
    /// Opacity logits.
    pub opacity_logits: f64,
    /// Constant harmonic.
    pub sh_constant: f64,
    /// The other harmonics.
    ///
    /// Slower, for they explain less.
    pub sh_rest: f64,
}

impl Default for LearningRates {
    /// Beside the 3DGS rates, which were tuned for 30,000 iterations, sizes and attitudes
    /// learn twice as fast, colors four times, opacities half as fast, and the means' rate
    /// falls by half a decade instead of two: there is little time to move in (measured in
    /// docs/experiments.md).
    fn default() -> Self {
        Self {
            means: [1.6e-4, 4.8e-5],
            quats: 2e-3,
            log_scales: 1e-2,
            opacity_logits: 2.5e-2,
            sh_constant: 1e-2,
            sh_rest: 2.5e-3 / 20.0,
        }
    }
}

impl LearningRates {
    /// Those of 3DGS, whose means slow down a hundredfold over 30,000 iterations: a training of
    /// 15,000 is their first half, which a shorter one passes through in proportion.
    fn published(iterations: usize) -> Self {
        let over = iterations.max(PAPER_ITERATIONS) as f64 / (2 * PAPER_ITERATIONS) as f64;
        Self {
            means: [1.6e-4, 1.6e-4 * 0.01_f64.powf(over.min(1.0))],
            quats: 1e-3,
            log_scales: 5e-3,
            opacity_logits: 5e-2,
            sh_constant: 2.5e-3,
            sh_rest: 2.5e-3 / 20.0,
        }
    }

    /// All of them times a factor.
    pub fn times(&self, factor: f64) -> Self {
        Self {
            means: self.means.map(|rate| rate * factor),
            quats: self.quats * factor,
            log_scales: self.log_scales * factor,
            opacity_logits: self.opacity_logits * factor,
            sh_constant: self.sh_constant * factor,
            sh_rest: self.sh_rest * factor,
        }
    }

    /// Learning rate of the means in world units after a share `t` of the training.
    pub fn means_at(&self, t: f64, extent: f64) -> f64 {
        let [first, last] = self.means;
        extent * first * (last / first).powf(t)
    }
}

/// Rules of densification, with learning rates and a schedule of their own.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum DensifyRules {
    /// Ours (docs/decisions/training.md).
    #[default]
    Own,
    /// Those of 3DGS (Kerbl et al. 2023), as published.
    #[serde(rename = "3dgs")]
    Published,
}

/// Settings of one training: what presets produce, the command line overlays and the report
/// holds. What happens when follows from them ([`Schedule`](super::Schedule)).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct LumaSettings {
    /// Iterations, unless a goal or early stopping ends the training.
    pub iterations: usize,
    /// Gaussians at most.
    pub max_splats: usize,
    /// Degree of the luma harmonics, 0 to 3.
    pub sh_degree: u32,
    /// Seed of every random choice.
    pub seed: u64,
    /// Gain of twice the iterations below which training ends, in dB.
    ///
    /// Of the [watched](super::LumaTrainer::watch) views: training goes back to its best, settles
    /// and ends. `None`: it does not.
    pub stop_when_flat: Option<f64>,
    /// Choices that earlier versions had, and their reports have.
    #[serde(default, skip_serializing)]
    #[cfg_attr(test, schemars(skip))]
    pub densify: IgnoredAny,
    /// As `densify`.
    #[serde(default, skip_serializing)]
    #[cfg_attr(test, schemars(skip))]
    pub coarse: IgnoredAny,
    /// Rules of densification.
    #[serde(default)]
    pub rules: DensifyRules,
    /// Share of Gaussians that a densification adds at most.
    pub growth: f64,
    /// Gradient of a center above which a Gaussian is split.
    ///
    /// Mean pull (`STAT_PULL`): absolute by our rules, signed by those of 3DGS.
    pub pull_threshold: f64,
    /// Opacity below which a Gaussian is removed.
    pub prune_opacity: f64,
    /// Learning rates of Adam.
    pub rates: LearningRates,
    /// True if outlier pixels are left out.
    ///
    /// They show something else than the scene and are found on the way (`luma::outliers`).
    pub robust: bool,
    /// True if opacities fall by what the screen blur spreads.
    ///
    /// The scene must then be drawn the same way ([`RasterOptions::antialiased`]).
    pub antialiased: bool,
    /// True if some Gaussians represent a far background.
    ///
    /// How large one may be then grows with its distance.
    pub background: bool,
    /// True if a gray shell surrounds the scene.
    ///
    /// A few hundred Gaussians far behind it, in the grays that photos show in their direction:
    /// what other views see where no photo shows anything.
    #[serde(default)]
    pub surround: bool,
    /// True if Gaussians also start where COLMAP has no points.
    ///
    /// Photos are matched where they have texture.
    #[serde(default)]
    pub fill_gaps: bool,
    /// Most memory of the device, in bytes; `None`: no limit.
    pub memory_limit: Option<u64>,
    /// True if photos of any size are streamed from the host one at a time; set for blocks.
    #[serde(default)]
    pub stream_photos: bool,
    /// Numerical accuracy (`--numerics`).
    pub numerics: Numerics,
}

impl Default for LumaSettings {
    /// For as many iterations as the paper's.
    fn default() -> Self {
        Self::new(PAPER_ITERATIONS)
    }
}

impl LumaSettings {
    /// The defaults for a training of so many iterations.
    pub fn new(iterations: usize) -> Self {
        Self {
            iterations,
            max_splats: 1_000_000,
            sh_degree: 3,
            seed: 0,
            stop_when_flat: None,
            densify: IgnoredAny,
            coarse: IgnoredAny,
            rules: DensifyRules::Own,
            growth: 0.3,
            // gsplat's advice for absolute gradients.
            pull_threshold: 8e-4,
            prune_opacity: 0.005,
            rates: LearningRates::default(),
            robust: false,
            antialiased: false,
            background: false,
            surround: true,
            fill_gaps: true,
            memory_limit: None,
            stream_photos: false,
            numerics: Numerics::default(),
        }
    }

    /// The same by these rules of densification, with their thresholds, rates and early stopping.
    #[must_use]
    pub fn by(self, rules: DensifyRules) -> Self {
        let own = Self::new(self.iterations);
        match rules {
            DensifyRules::Own => Self {
                rules,
                growth: own.growth,
                pull_threshold: own.pull_threshold,
                rates: own.rates,
                ..self
            },
            DensifyRules::Published => Self {
                rules,
                growth: 1.0,
                pull_threshold: 2e-4,
                rates: LearningRates::published(self.iterations),
                stop_when_flat: None,
                ..self
            },
        }
    }

    /// Training budget before effects are decided.
    pub fn room(&self) -> TrainingBudget {
        TrainingBudget {
            iterations: self.iterations,
            sh_degree: self.sh_degree,
        }
    }

    /// The same with the effects of a plan.
    pub fn planned(self, plan: &Plan) -> Self {
        Self {
            sh_degree: plan.sh_degree,
            robust: plan.has(Effect::Robust),
            antialiased: plan.has(Effect::Antialias),
            background: plan.has(Effect::Background),
            ..self
        }
    }

    /// Rasterizer that draws a scene of these settings.
    pub fn raster(&self, gpu: &Gpu) -> Arc<Raster> {
        Arc::new(Raster::with(gpu, self.raster_options()))
    }

    /// Options of this rasterizer.
    pub fn raster_options(&self) -> RasterOptions {
        RasterOptions {
            antialiased: self.antialiased,
            ..RasterOptions::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rates_of_means_decay_from_end_to_end() {
        let rates = LearningRates::default();
        for (t, wanted) in [(0.0, 3.2e-4), (0.5, 3.2e-4 * 0.3_f64.sqrt()), (1.0, 9.6e-5)] {
            assert!((rates.means_at(t, 2.0) - wanted).abs() < 1e-12);
        }
    }

    #[test]
    fn what_is_written_is_read_again() {
        let settings = LumaSettings {
            stop_when_flat: Some(0.3),
            memory_limit: Some(1 << 30),
            ..LumaSettings::new(700)
        };
        let text = serde_json::to_string(&settings).unwrap();
        assert_eq!(
            serde_json::from_str::<LumaSettings>(&text).unwrap(),
            settings
        );
        let earlier = text.replacen('{', "{\"densify\":\"split\",\"coarse\":0.0,", 1);
        assert_eq!(
            serde_json::from_str::<LumaSettings>(&earlier).unwrap(),
            settings
        );
        let unknown = text.replacen("\"seed\"", "\"sede\"", 1);
        let error = serde_json::from_str::<LumaSettings>(&unknown).unwrap_err();
        assert!(error.to_string().contains("sede"), "{error}");
    }
}
