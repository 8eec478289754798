//! Hard cases on the user's own device: results of the kernels against those of the oracle. The
//! first thing to ask of someone who reports a bad picture.

pub mod cases;
pub mod kernels;
pub mod measured;
pub mod stage;

use std::{fmt::Write, sync::Arc};

use serde::Serialize;

use crate::{
    compare::{Elementwise, FlipBounds, widen},
    gpu::{Gpu, GpuError},
    oracle::{
        constants::ALPHA_MAX,
        gradient::gradient,
        numerics::Numerics,
        random::Random,
        render::render_pixels,
        scene::{Gaussian, Scene},
        shade::Shading,
    },
    raster::Raster,
};
use cases::{CASES, Case, HardCase};
use kernels::TOPICS;
use measured::Row;
pub use measured::{MARGIN, headroom};
use stage::{Stage, splats};

/// No bound is tighter than this: a case that happens to come out exact on one
/// device need not on the next.
const TIGHTEST: f64 = 2e-6;

/// A group of parameters whose whole gradient is smaller than this share of the
/// largest group's is judged against that share: what is zero but for rounding
/// has no relative error.
const SMALL_GROUP: f64 = 1e-3;

/// Result of a case.
#[derive(Clone, Debug, Serialize)]
pub struct Verdict {
    /// Name of the case.
    pub name: &'static str,
    /// Failure of a rasterizer that does nothing about the case.
    pub trouble: &'static str,
    /// Largest error of a pixel that had no choice, in units of the brightest
    /// pixel or of 1, whichever is larger.
    pub picture_error: f64,
    /// Bound of the picture error.
    pub picture_bound: f64,
    /// Largest relative L2 error of the gradient of a group of parameters.
    pub gradient_error: f64,
    /// Bound of the gradient error.
    pub gradient_bound: f64,
    /// Gaussians that the device counted as poisoned.
    pub poisoned: usize,
    /// Failures, joined into one line, if any.
    pub failure: Option<String>,
}

/// Properties of the device, and the result of each case.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// The adapter's name.
    pub adapter: String,
    /// Its driver and the driver's version.
    pub driver: String,
    /// Vulkan, Metal or DX12.
    pub backend: String,
    /// True if it is a software adapter.
    pub software: bool,
    /// Largest binding in bytes: what bounds the number of Gaussians.
    pub max_binding_bytes: u64,
    /// Largest number of workgroups along one side of a dispatch.
    pub max_workgroups_per_dimension: u32,
    /// Workgroup memory in bytes.
    pub max_workgroup_bytes: u32,
    /// Optional features in use; the kernels need none.
    pub features: Vec<String>,
    /// Every kernel on random inputs.
    pub kernels: Vec<Row>,
    /// Every hard case.
    pub cases: Vec<Verdict>,
}

/// Steps of a diagnosis: topics of kernels, then cases.
pub const STEPS: usize = TOPICS.len() + CASES.len();

impl Diagnosis {
    /// Measures every kernel and runs every case, telling `observe` which one is
    /// next of [`STEPS`].
    pub fn of(gpu: &Gpu, observe: &mut dyn FnMut(usize, &'static str)) -> Result<Self, GpuError> {
        let raster = Arc::new(Raster::new(gpu));
        let mut kernels = Vec::new();
        for (index, (topic, measure)) in TOPICS.into_iter().enumerate() {
            observe(index, topic);
            kernels.extend(measure(&raster)?);
        }
        let mut cases = Vec::new();
        for (index, case) in CASES.iter().enumerate() {
            observe(TOPICS.len() + index, case.name);
            cases.push(examine(&raster, case)?);
        }
        let info = gpu.info();
        let limits = gpu.device().limits();
        let features = gpu.device().features();
        Ok(Self {
            adapter: info.name.clone(),
            driver: format!("{} {}", info.driver, info.driver_info),
            backend: format!("{:?}", info.backend),
            software: gpu.is_software(),
            max_binding_bytes: gpu.binding_limit(),
            max_workgroups_per_dimension: limits.max_compute_workgroups_per_dimension,
            max_workgroup_bytes: limits.max_compute_workgroup_storage_size,
            features: features
                .iter_names()
                .map(|(name, _)| name.to_owned())
                .collect(),
            kernels,
            cases,
        })
    }

    /// Number of kernels' quantities and cases that failed.
    pub fn failures(&self) -> usize {
        let kernels = self.kernels.iter().filter(|row| !row.failures.is_empty());
        let cases = self.cases.iter().filter(|case| case.failure.is_some());
        kernels.count() + cases.count()
    }

    /// Number of kernels' quantities and cases in all.
    pub fn checks(&self) -> usize {
        self.kernels.len() + self.cases.len()
    }

    /// The cases as a Markdown table.
    pub fn case_table(&self) -> String {
        let mut text = String::from(
            "| case | what goes wrong elsewhere | picture error | bound | gradient error | bound | poisoned | verdict |\n\
             |---|---|--:|--:|--:|--:|--:|---|\n",
        );
        for case in &self.cases {
            // Writing to a string cannot fail.
            let _ = writeln!(
                text,
                "| {} | {} | {:.1e} | {:.1e} | {:.1e} | {:.1e} | {} | {} |",
                case.name,
                case.trouble,
                case.picture_error,
                case.picture_bound,
                case.gradient_error,
                case.gradient_bound,
                case.poisoned,
                case.failure.as_deref().unwrap_or("holds"),
            );
        }
        text
    }
}

/// Runs one case.
pub fn examine(raster: &Arc<Raster>, case: &Case) -> Result<Verdict, GpuError> {
    examine_with(raster, case, Numerics::DEFAULT)
}

/// Runs one case of which device and oracle leave out as much as this.
pub fn examine_with(
    raster: &Arc<Raster>,
    case: &Case,
    numerics: Numerics,
) -> Result<Verdict, GpuError> {
    let mut hard = (case.make)();
    hard.view.numerics = numerics;
    hard.between_sort_keys();
    let stage = Stage::new(raster, &splats(&hard.scene), &hard.view)?;
    let headroom = headroom(&raster.gpu);
    let [picture_bound, gradient_bound] = case.seen.map(|seen| (seen * headroom).max(TIGHTEST));
    let wanted = without_broken(&hard);

    let actual = widen(&stage.forward()?);
    let poisoned = stage.status()?.poisoned;
    let pixels = render_pixels(&wanted, &hard.view, Shading::Offset);
    let expected: Vec<f64> = pixels.iter().flat_map(|pixel| pixel.color).collect();
    let may_flip: Vec<bool> = pixels.iter().map(|pixel| pixel.margin < MARGIN).collect();
    let brightest = expected
        .iter()
        .fold(1.0, |most: f64, value| most.max(value.abs()));
    let picture_error = (actual.iter().zip(&expected).zip(&may_flip))
        .filter(|(_, may_flip)| !**may_flip)
        .map(|((a, e), _)| (a - e).abs() / brightest)
        .fold(0.0, nan_is_worst);
    let picture = FlipBounds {
        rest: Elementwise {
            absolute: picture_bound * brightest,
            relative: 0.0,
        },
        jump: Elementwise {
            absolute: jump(&hard.view.numerics) * brightest,
            relative: 0.0,
        },
        cap: 0.02_f64.max(1.5 / expected.len() as f64),
    };
    let mut failures: Vec<String> = Vec::new();
    let checked = picture.compare(&actual, &expected, &may_flip).check();
    failures.extend(checked.err().map(|reason| format!("picture: {reason}")));
    if poisoned != hard.poisoned {
        let wanted = hard.poisoned;
        failures.push(format!(
            "{poisoned} counted as poisoned instead of {wanted}"
        ));
    }

    // No gradient flows from pixels that may flip.
    let mut random = Random::new(9);
    let upstream: Vec<[f64; 1]> = may_flip
        .iter()
        .map(|&may_flip| [random.range(-1.0, 1.0)].map(|v| if may_flip { 0.0 } else { v }))
        .collect();
    let actual = stage.backward(upstream.as_flattened())?.groups();
    let expected = gradient(&wanted, &hard.view, Shading::Offset, &upstream);
    let expected = expected.groups();
    let norm = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>().sqrt();
    let largest = expected.iter().map(|group| norm(group)).fold(0.0, f64::max);
    let mut gradient_error = 0.0;
    for ((name, actual), expected) in actual.iter().zip(expected) {
        let difference: Vec<f64> = actual.iter().zip(expected).map(|(a, e)| a - e).collect();
        let unit = norm(expected).max(SMALL_GROUP * largest);
        let error = norm(&difference);
        let relative = if error == 0.0 { 0.0 } else { error / unit };
        gradient_error = nan_is_worst(gradient_error, relative);
        // Positively written: what is not a number is no agreement.
        let agrees = actual.len() == expected.len() && relative <= gradient_bound;
        if !agrees {
            failures.push(format!("gradient of {name}: {relative:.1e}"));
        }
    }
    Ok(Verdict {
        name: case.name,
        trouble: case.trouble,
        picture_error,
        picture_bound,
        gradient_error,
        gradient_bound,
        poisoned,
        failure: (!failures.is_empty()).then(|| failures.join("; ")),
    })
}

/// Largest step in a picture: a contribution at the floor of alpha, or the last one that a
/// transmittance at its floor lets through.
fn jump(numerics: &Numerics) -> f64 {
    (2.0 * numerics.alpha_min).max(numerics.transmittance_min / (1.0 - ALPHA_MAX))
}

/// The larger of two errors; one that is not a number is infinitely large.
fn nan_is_worst(worst: f64, error: f64) -> f64 {
    if error.is_nan() {
        f64::INFINITY
    } else {
        worst.max(error)
    }
}

/// Expected scene: Gaussians that must leave no trace replaced by invisible ones.
fn without_broken(hard: &HardCase) -> Scene<f64, 1> {
    let scene = &hard.scene;
    let gaussians = (0..scene.len()).map(|i| {
        if hard.broken.contains(&i) {
            Gaussian {
                mean: [0.0; 3],
                quat: [1.0, 0.0, 0.0, 0.0],
                log_scale: [0.0; 3],
                opacity_logit: -1e3,
                sh: vec![[0.0]; scene.coefficient_count()],
            }
        } else {
            scene.gaussian(i)
        }
    });
    Scene::of(scene.degree, gaussians)
}
