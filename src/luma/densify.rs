//! Adaptive density control of 3DGS: the host plans from a few numbers a
//! Gaussian, the device carries the plan out (`shaders/densify.wgsl`).

use bytemuck::{Pod, Zeroable};

use super::LumaSettings;
use crate::{
    gpu::{Buffer, Gpu, GpuError, Kernel, Recorder, groups_for, shaders},
    raster::constants::*,
};

/// Splits divide the standard deviations by this.
const SHRINK: f32 = 1.6;

/// Twin of `struct Descent`: where a new Gaussian comes from.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Descent {
    /// Offset in the source's standard deviations, splits only.
    pub offset: [f32; 3],
    /// Index of the source.
    pub source: u32,
    /// 1 when Adam's moments are kept.
    pub keep_moments: u32,
    /// 1 for the half of a split.
    pub split: u32,
    /// Keeps the size a multiple of 16.
    pub padding: [u32; 2],
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
    /// Taken off the log-scales of a split.
    pub shrink: f32,
}

/// What the plan is made from.
pub struct Evidence<'a> {
    /// Geometry planes `[11, N]`.
    pub geometry: &'a [f32],
    /// Statistics planes `[3, N]`.
    pub statistics: &'a [f32],
    /// The scene's extent in world units.
    pub extent: f64,
    /// Whether oversized Gaussians go as well.
    pub prune_large: bool,
}

/// Plans one densification: survivors in their old order, then clones, then
/// halves of splits. Where the cap does not admit all, the Gaussians with the
/// strongest gradients come first (ties by index).
pub fn plan(
    settings: &LumaSettings,
    evidence: &Evidence<'_>,
    random: &mut fastrand::Rng,
) -> Vec<Descent> {
    let n = evidence.geometry.len() / GEOMETRY_PLANES;
    let at = |plane: usize, i: usize| evidence.geometry[plane * n + i];
    let largest = |i: usize| {
        (0..3)
            .map(|axis| f64::from(at(PLANE_LOG_SCALE + axis, i)).exp())
            .fold(0.0, f64::max)
    };
    let opacity = |i: usize| 1.0 / (1.0 + f64::from(-at(PLANE_OPACITY, i)).exp());
    // Positively written: whatever is not a number does not survive.
    let lives = |i: usize| {
        let fits = !evidence.prune_large || largest(i) <= settings.prune_share * evidence.extent;
        opacity(i) >= settings.prune_opacity
            && fits
            && (0..GEOMETRY_PLANES).all(|p| at(p, i).is_finite())
    };
    let pull = |i: usize| {
        let count = evidence.statistics[n + i];
        if count > 0.0 {
            f64::from(evidence.statistics[i] / count)
        } else {
            0.0
        }
    };

    let survivors: Vec<usize> = (0..n).filter(|&i| lives(i)).collect();
    let mut candidates: Vec<(f64, usize)> = survivors
        .iter()
        .map(|&i| (pull(i), i))
        .filter(|&(pull, _)| pull >= settings.gradient_threshold)
        .collect();
    candidates.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    // A clone and a split each add one.
    candidates.truncate(settings.max_splats.saturating_sub(survivors.len()));
    let mut chosen: Vec<usize> = candidates.into_iter().map(|(_, i)| i).collect();
    chosen.sort_unstable();

    let (splits, clones): (Vec<usize>, Vec<usize>) = chosen
        .into_iter()
        .partition(|&i| largest(i) > settings.split_share * evidence.extent);
    let of = |source: usize, keep_moments: u32| Descent {
        source: source as u32,
        keep_moments,
        ..Descent::default()
    };
    let mut plan: Vec<Descent> = survivors
        .iter()
        .filter(|i| splits.binary_search(i).is_err())
        .map(|&i| of(i, 1))
        .collect();
    plan.extend(clones.iter().map(|&i| of(i, 0)));
    for &i in &splits {
        for _ in 0..2 {
            plan.push(Descent {
                offset: std::array::from_fn(|_| standard_normal(random)),
                split: 1,
                ..of(i, 0)
            });
        }
    }
    plan
}

/// Box and Muller's normal deviate.
fn standard_normal(random: &mut fastrand::Rng) -> f32 {
    // 1 - u lies in (0, 1]: its logarithm is finite.
    let radius = (-2.0 * (1.0 - random.f64()).ln()).sqrt();
    (radius * (std::f64::consts::TAU * random.f64()).cos()) as f32
}

/// The three entry points.
pub struct DensifyKernels {
    geometry: Kernel,
    sh: Kernel,
    moments: Kernel,
}

/// Which array a plan is applied to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// Geometry planes.
    Geometry,
    /// Spherical-harmonic planes.
    Field,
    /// Moments of either.
    Moments,
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

    /// Applies a plan to one array of planes and gives the new one.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn apply(
        &self,
        gpu: &Gpu,
        plan: &Buffer<Descent>,
        old_count: usize,
        source: &Buffer<f32>,
        target: Target,
    ) -> Result<Buffer<f32>, GpuError> {
        let planes = source.len() / old_count.max(1);
        let destination = Buffer::zeros(gpu, "densified", planes * plan.len())?;
        let parameters = Buffer::uniform(
            gpu,
            "densify parameters",
            &DensifyParameters {
                old_count: old_count as u32,
                new_count: plan.len() as u32,
                planes: planes as u32,
                shrink: SHRINK.ln(),
            },
        )?;
        let kernel = match target {
            Target::Geometry => &self.geometry,
            Target::Field => &self.sh,
            Target::Moments => &self.moments,
        };
        let bindings = kernel.bind(
            gpu,
            &[
                parameters.raw(),
                plan.raw(),
                source.raw(),
                destination.raw(),
            ],
        );
        let mut recorder = Recorder::new(gpu);
        recorder.dispatch(kernel, &bindings, groups_for(plan.len()));
        recorder.submit();
        Ok(destination)
    }
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
            statistics[i] = 4.0 * pull;
            statistics[n + i] = 4.0;
        }
        (geometry, statistics)
    }

    fn planned(
        settings: &LumaSettings,
        gaussians: &[(f32, f32, f32)],
        prune_large: bool,
    ) -> Vec<Descent> {
        let (geometry, statistics) = evidence(gaussians);
        let evidence = Evidence {
            geometry: &geometry,
            statistics: &statistics,
            extent: 1.0,
            prune_large,
        };
        plan(settings, &evidence, &mut fastrand::Rng::with_seed(1))
    }

    fn sources(plan: &[Descent]) -> Vec<(u32, u32, u32)> {
        plan.iter()
            .map(|d| (d.source, d.keep_moments, d.split))
            .collect()
    }

    const CALM: (f32, f32, f32) = (0.005, 0.5, 1e-5);
    const SMALL: (f32, f32, f32) = (0.005, 0.5, 1e-3);
    const LARGE: (f32, f32, f32) = (0.05, 0.5, 1e-3);
    const FAINT: (f32, f32, f32) = (0.005, 0.004, 1e-3);
    const HUGE: (f32, f32, f32) = (0.2, 0.5, 1e-5);

    #[test]
    fn small_ones_are_cloned_large_ones_split_faint_ones_removed() {
        let plan = planned(
            &LumaSettings::new(1000),
            &[CALM, SMALL, LARGE, FAINT],
            false,
        );
        assert_eq!(
            sources(&plan),
            [(0, 1, 0), (1, 1, 0), (1, 0, 0), (2, 0, 1), (2, 0, 1)]
        );
        assert_eq!(plan[2].offset, [0.0; 3]);
        assert_ne!(plan[3].offset, plan[4].offset);
    }

    #[test]
    fn oversized_ones_go_only_when_asked() {
        let settings = LumaSettings::new(1000);
        assert_eq!(sources(&planned(&settings, &[HUGE, CALM], false)).len(), 2);
        assert_eq!(
            sources(&planned(&settings, &[HUGE, CALM], true)),
            [(1, 1, 0)]
        );
    }

    #[test]
    fn the_cap_holds_and_the_strongest_come_first() {
        let settings = LumaSettings {
            max_splats: 4,
            ..LumaSettings::new(1000)
        };
        let stronger = (0.005, 0.5, 2e-3);
        let plan = planned(&settings, &[SMALL, stronger, CALM], false);
        assert_eq!(sources(&plan), [(0, 1, 0), (1, 1, 0), (2, 1, 0), (1, 0, 0)]);
        let full = LumaSettings {
            max_splats: 2,
            ..settings
        };
        assert_eq!(planned(&full, &[SMALL, stronger, CALM], false).len(), 3);
    }

    #[test]
    fn what_is_not_a_number_does_not_survive() {
        let (mut geometry, statistics) = evidence(&[CALM, CALM]);
        geometry[2 * PLANE_QUAT] = f32::NAN;
        let evidence = Evidence {
            geometry: &geometry,
            statistics: &statistics,
            extent: 1.0,
            prune_large: false,
        };
        let mut random = fastrand::Rng::with_seed(1);
        assert_eq!(
            sources(&plan(&LumaSettings::new(1000), &evidence, &mut random)),
            [(1, 1, 0)]
        );
    }

    #[test]
    fn normal_deviates_have_mean_zero_and_variance_one() {
        let mut random = fastrand::Rng::with_seed(7);
        let sample: Vec<f64> = (0..20_000)
            .map(|_| f64::from(standard_normal(&mut random)))
            .collect();
        let mean = sample.iter().sum::<f64>() / sample.len() as f64;
        let square = sample.iter().map(|v| v * v).sum::<f64>() / sample.len() as f64;
        assert!(
            mean.abs() < 0.03 && (square - 1.0).abs() < 0.04,
            "{mean} {square}"
        );
    }
}
