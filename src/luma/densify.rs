//! Adaptive density control: the host plans from a few numbers a Gaussian, the
//! device carries the plan out (`shaders/densify.wgsl`).
//!
//! As in 3DGS, Gaussians that the loss pulls at are divided and faint ones
//! removed. What differs, and why, is in docs/decisions/training.md: the pull does not
//! cancel between pixels (AbsGS, Ye et al. 2024), every division is a split that
//! keeps the first two moments, and a set grows by a bounded share at a time.

use std::f64::consts::FRAC_1_SQRT_2;

use bytemuck::{Pod, Zeroable};

use super::LumaSettings;
use crate::{
    gpu::{Buffer, Gpu, GpuError, Kernel, Recorder, groups_for, shaders},
    raster::{AdamMoments, Field, Geometry, Model, constants::*},
};

/// Both halves of a split together let as much light through as this power of
/// the whole's transmittance, each: a half alone would be ½ where they coincide,
/// but they stand apart. The value is Brush's.
const SPLIT_TRANSMITTANCE_POWER: f64 = FRAC_1_SQRT_2;

/// Opacities of halves stay this far from 0 and 1, where a logit has no bounds.
const OPACITY_MARGIN: f64 = 1.0 / 255.0;

/// Twin of `struct Descent`: where a new Gaussian comes from.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Descent {
    /// Offset in the source's standard deviations.
    pub offset: [f32; 3],
    /// Index of the source.
    pub source: u32,
    /// Added to the log-scales.
    pub log_growth: [f32; 3],
    /// 1 for a survivor, which is copied with its moments; 0 for the half of a split.
    pub survives: u32,
    /// Added to the opacity logit.
    pub logit_step: f32,
    /// Keeps the size a multiple of 16.
    pub padding: [u32; 3],
}

/// Twin of `struct DensifyParameters`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct DensifyParameters {
    /// Gaussians before.
    pub old_count: u32,
    /// Gaussians after.
    pub new_count: u32,
    /// Planes of the array at hand.
    pub planes: u32,
}

/// Input of a densification plan.
pub struct Evidence<'a> {
    /// Geometry planes `[11, N]`.
    pub geometry: &'a [f32],
    /// Statistics planes `[2, N]`.
    pub statistics: &'a [f32],
    /// [`Model::held`].
    pub held: usize,
    /// Gaussians that are still to be added.
    pub reserved: usize,
}

/// One that stays as it is.
pub fn survivor(source: usize) -> Descent {
    Descent {
        source: source as u32,
        survives: 1,
        ..Descent::default()
    }
}

/// Plans one densification by our own rules.
pub fn plan(settings: &LumaSettings, evidence: &Evidence<'_>) -> Vec<Descent> {
    let n = evidence.geometry.len() / GEOMETRY_PLANES;
    let at = |plane: usize, i: usize| f64::from(evidence.geometry[plane * n + i]);
    let halved = |i: usize| {
        let log_scales = std::array::from_fn(|axis| at(PLANE_LOG_SCALE + axis, i));
        halves(i as u32, log_scales, at(PLANE_OPACITY, i))
    };
    plan_by(settings, evidence, halved, |_| true)
}

/// Plans one densification: survivors in their old order, then the two that each of the others is
/// `divided` into, then those that are held; no others than `stays` keeps. Where growth or the cap
/// does not admit all, the Gaussians with the strongest pull come first (ties by index).
pub fn plan_by(
    settings: &LumaSettings,
    evidence: &Evidence<'_>,
    divided: impl FnMut(usize) -> [Descent; 2],
    stays: impl Fn(&Descent) -> bool,
) -> Vec<Descent> {
    let n = evidence.geometry.len() / GEOMETRY_PLANES;
    let at = |plane: usize, i: usize| evidence.geometry[plane * n + i];
    let opacity = |i: usize| 1.0 / (1.0 + f64::from(-at(PLANE_OPACITY, i)).exp());
    // Positively written: whatever is not a number does not survive.
    let lives = |i: usize| {
        opacity(i) >= settings.prune_opacity && (0..GEOMETRY_PLANES).all(|p| at(p, i).is_finite())
    };
    let pull = |i: usize| {
        let views = evidence.statistics[STAT_VIEWS * n + i];
        if views > 0.0 {
            f64::from(evidence.statistics[STAT_PULL * n + i] / views)
        } else {
            0.0
        }
    };

    let survivors: Vec<usize> = (0..n - evidence.held).filter(|&i| lives(i)).collect();
    let mut candidates: Vec<(f64, usize)> = survivors
        .iter()
        .map(|&i| (pull(i), i))
        .filter(|&(pull, _)| pull >= settings.pull_threshold)
        .collect();
    candidates.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    let remain = |i: usize| stays(&survivor(i));
    let kept = survivors.iter().filter(|&&i| remain(i)).count();
    let taken = evidence.held + evidence.reserved + kept;
    let mut room = settings.max_splats.saturating_sub(taken);
    let growth = (survivors.len() as f64 * settings.growth).ceil() as usize;
    candidates.truncate(growth);
    // Division adds one, or two to what would go undivided.
    let fits = |i: &usize| {
        let added = if remain(*i) { 1 } else { 2 };
        let fits = added <= room;
        room = room.saturating_sub(added);
        fits
    };
    let divisible = candidates.into_iter().map(|(_, i)| i);
    let mut splits: Vec<usize> = divisible.take_while(fits).collect();
    splits.sort_unstable();

    let mut plan: Vec<Descent> = survivors
        .iter()
        .filter(|i| splits.binary_search(i).is_err())
        .map(|&i| survivor(i))
        .collect();
    plan.extend(splits.into_iter().flat_map(divided));
    plan.retain(stays);
    if !plan.is_empty() {
        plan.extend((n - evidence.held..n).map(survivor));
    }
    plan
}

/// Two halves that keep the whole's mean and variances. Along the largest axis
/// they stand 1/√2 standard deviations to either side and are narrower by 1/√2: (1/√2)² + (1/√2)² = 1. Shorter axes shrink less, by their square
/// share of the largest, so that a needle is cut across and a ball along its
/// diagonal.
fn halves(source: u32, log_scales: [f64; 3], logit: f64) -> [Descent; 2] {
    let largest = log_scales.into_iter().fold(f64::NEG_INFINITY, f64::max);
    let shrink = log_scales.map(|log_scale| {
        let relative = (log_scale - largest).exp();
        1.0 - (1.0 - FRAC_1_SQRT_2) * relative * relative
    });
    let offset = shrink.map(|k| (1.0 - k * k).max(0.0).sqrt() as f32);
    // 1 - opacity = 1 / (1 + exp(logit)).
    let opacity = 1.0 - (1.0 + logit.exp()).powf(-SPLIT_TRANSMITTANCE_POWER);
    let opacity = opacity.clamp(OPACITY_MARGIN, 1.0 - OPACITY_MARGIN);
    let half = Descent {
        offset,
        source,
        log_growth: shrink.map(|k| k.ln() as f32),
        logit_step: ((opacity / (1.0 - opacity)).ln() - logit) as f32,
        ..Descent::default()
    };
    let other = Descent {
        offset: offset.map(|x| -x),
        ..half
    };
    [half, other]
}

/// The three entry points.
pub struct DensifyKernels {
    /// Kernel for geometry planes.
    pub geometry: Kernel,
    /// Kernel for spherical-harmonic planes.
    pub sh: Kernel,
    /// Kernel for Adam's moments of either.
    pub moments: Kernel,
}

impl DensifyKernels {
    /// Compiles them.
    pub fn new(gpu: &Gpu) -> Self {
        let kernel = |name| Kernel::new(gpu, name, shaders::DENSIFY);
        Self {
            geometry: kernel("densify_geometry"),
            sh: kernel("densify_sh"),
            moments: kernel("densify_moments"),
        }
    }

    /// The model after a plan.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn carry_out(
        &self,
        gpu: &Gpu,
        plan: &Buffer<Descent>,
        model: &Model,
    ) -> Result<Model, GpuError> {
        let apply = |source: &Buffer<f32>, kernel| apply(gpu, kernel, plan, model.len(), source);
        let moments = |moments: &AdamMoments| -> Result<_, GpuError> {
            Ok(AdamMoments {
                first: apply(&moments.first, &self.moments)?,
                second: apply(&moments.second, &self.moments)?,
            })
        };
        Ok(Model {
            geometry_moments: moments(&model.geometry_moments)?,
            field_moments: moments(&model.field_moments)?,
            geometry: Geometry {
                count: plan.len(),
                planes: apply(&model.geometry.planes, &self.geometry)?,
            },
            held: model.held,
            field: Field {
                planes: apply(&model.field.planes, &self.sh)?,
                ..model.field
            },
        })
    }
}

/// Applies a plan to one array of planes and gives the new one.
///
/// # Errors
/// [`GpuError::TooLarge`].
pub fn apply(
    gpu: &Gpu,
    kernel: &Kernel,
    plan: &Buffer<Descent>,
    old_count: usize,
    source: &Buffer<f32>,
) -> Result<Buffer<f32>, GpuError> {
    let planes = source.len() / old_count.max(1);
    let destination = Buffer::zeros(gpu, "densified", planes * plan.len())?;
    let parameters = DensifyParameters {
        old_count: old_count as u32,
        new_count: plan.len() as u32,
        planes: planes as u32,
    };
    let parameters = Buffer::uniform(gpu, "densify parameters", &parameters)?;
    let buffers = [
        parameters.raw(),
        plan.raw(),
        source.raw(),
        destination.raw(),
    ];
    let mut recorder = Recorder::new(gpu);
    recorder.dispatch(kernel, &kernel.bind(gpu, &buffers), groups_for(plan.len()));
    recorder.submit();
    Ok(destination)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Planes for Gaussians of (standard deviation, opacity, mean pull).
    fn evidence(gaussians: &[(f32, f32, f32)]) -> (Vec<f32>, Vec<f32>) {
        let n = gaussians.len();
        let mut geometry = vec![0.0; GEOMETRY_PLANES * n];
        let mut statistics = vec![0.0; STATISTICS_PLANES * n];
        for (i, &(deviation, opacity, pull)) in gaussians.iter().enumerate() {
            geometry[PLANE_QUAT * n + i] = 1.0;
            for axis in 0..3 {
                geometry[(PLANE_LOG_SCALE + axis) * n + i] = deviation.ln();
            }
            geometry[PLANE_OPACITY * n + i] = (opacity / (1.0 - opacity)).ln();
            // Seen in four views.
            statistics[STAT_PULL * n + i] = 4.0 * pull;
            statistics[STAT_VIEWS * n + i] = 4.0;
        }
        (geometry, statistics)
    }

    fn planned(settings: &LumaSettings, gaussians: &[(f32, f32, f32)]) -> Vec<Descent> {
        let (geometry, statistics) = evidence(gaussians);
        let evidence = Evidence {
            geometry: &geometry,
            statistics: &statistics,
            held: 0,
            reserved: 0,
        };
        plan(settings, &evidence)
    }

    fn sources(plan: &[Descent]) -> Vec<(u32, u32)> {
        plan.iter().map(|d| (d.source, d.survives)).collect()
    }

    fn eager() -> LumaSettings {
        LumaSettings {
            growth: 1.0,
            ..LumaSettings::new(1000)
        }
    }

    const CALM: (f32, f32, f32) = (0.005, 0.5, 1e-5);
    const PULLED: (f32, f32, f32) = (0.005, 0.5, 2e-3);
    const FAINT: (f32, f32, f32) = (0.005, 0.004, 1e-2);
    const HUGE: (f32, f32, f32) = (200.0, 0.5, 1e-5);

    #[test]
    fn pulled_ones_are_split_faint_ones_removed() {
        let plan = planned(&eager(), &[CALM, PULLED, FAINT]);
        assert_eq!(sources(&plan), [(0, 1), (1, 0), (1, 0)]);
        assert_eq!(plan[0].offset, [0.0; 3]);
        assert_eq!(plan[1].offset, plan[2].offset.map(|x| -x));
    }

    /// Far away, or in a view of little else, it may well be what is there.
    #[test]
    fn size_is_no_reason_to_go() {
        assert_eq!(sources(&planned(&eager(), &[HUGE, CALM])), [(0, 1), (1, 1)]);
    }

    #[test]
    fn cap_and_growth_hold_and_the_strongest_come_first() {
        let stronger = (0.005, 0.5, 4e-3);
        let gaussians = [PULLED, stronger, CALM];
        let first = [(0, 1), (2, 1), (1, 0), (1, 0)];
        let capped = LumaSettings {
            max_splats: 4,
            ..eager()
        };
        assert_eq!(sources(&planned(&capped, &gaussians)), first);
        let full = LumaSettings {
            max_splats: 2,
            ..eager()
        };
        assert_eq!(planned(&full, &gaussians).len(), 3);
        let slow = LumaSettings {
            growth: 0.3,
            ..eager()
        };
        assert_eq!(sources(&planned(&slow, &gaussians)), first);
    }

    #[test]
    fn held_ones_stay_behind_all_others_and_take_of_the_cap() {
        let (geometry, statistics) = evidence(&[PULLED, CALM, FAINT, PULLED]);
        let evidence = Evidence {
            geometry: &geometry,
            statistics: &statistics,
            held: 2,
            reserved: 0,
        };
        let held = [(2, 1), (3, 1)];
        assert_eq!(
            sources(&plan(&eager(), &evidence)),
            [&[(1, 1), (0, 0), (0, 0)][..], &held].concat()
        );
        let capped = LumaSettings {
            max_splats: 4,
            ..eager()
        };
        assert_eq!(
            sources(&plan(&capped, &evidence)),
            [&[(0, 1), (1, 1)][..], &held].concat()
        );
        let reserving = Evidence {
            held: 0,
            reserved: 2,
            ..evidence
        };
        let room = LumaSettings {
            max_splats: 6,
            ..eager()
        };
        // Three survive, one may be split.
        assert_eq!(plan(&room, &reserving).len(), 4);
    }

    #[test]
    fn what_is_not_a_number_does_not_survive() {
        let (mut geometry, statistics) = evidence(&[CALM, CALM]);
        geometry[2 * PLANE_QUAT] = f32::NAN;
        let evidence = Evidence {
            geometry: &geometry,
            statistics: &statistics,
            held: 0,
            reserved: 0,
        };
        assert_eq!(sources(&plan(&eager(), &evidence)), [(1, 1)]);
    }

    #[test]
    fn halves_keep_mean_and_variance() {
        let scales = [0.3_f64, 0.1, 1e-4];
        let [one, other] = halves(0, scales.map(f64::ln), 0.7);
        for axis in 0..3 {
            let [a, b] = [one, other].map(|half| f64::from(half.offset[axis]));
            assert_eq!(a + b, 0.0);
            let shrink = f64::from(one.log_growth[axis]).exp();
            assert!((a * a + shrink * shrink - 1.0).abs() < 1e-6, "axis {axis}");
        }
        // The longest axis is halved in area, the shortest left alone.
        assert!((f64::from(one.log_growth[0]) - FRAC_1_SQRT_2.ln()).abs() < 1e-6);
        assert!(one.log_growth[2].abs() < 1e-6);
    }

    #[test]
    fn halves_are_fainter_and_stay_finite() {
        for logit in [-200.0, -5.0, 0.0, 3.0, 200.0] {
            let [half, _] = halves(0, [0.0; 3], logit);
            let after = logit + f64::from(half.logit_step);
            assert!(
                after.is_finite() && after.abs() < 5.6,
                "{logit} gives {after}"
            );
        }
        let [half, _] = halves(0, [0.0; 3], 0.0);
        // 1 - ½^0.7071 = 0.3874.
        let after = 1.0 / (1.0 + (-f64::from(half.logit_step)).exp());
        assert!((after - 0.387_453).abs() < 1e-5, "{after}");
    }
}
