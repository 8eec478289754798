//! Time of an iteration with each knob, as a ratio to the default's.

use std::{array, collections::BTreeMap, sync::Arc, time::Instant};

use gs_chroma::{
    gpu::Gpu,
    luma::{LumaError, LumaSettings, LumaTrainer, Numerics, Schedule},
    raster::Raster,
};
use serde::Serialize;

use crate::{Fallible, cloud::median, knobs::KNOBS, scene::Subject};

/// Iterations of a turn.
const ITERATIONS: usize = 4;

/// Rounds by the host's clock and by the device's; odd numbers, so that the median is one
/// of them.
const ROUNDS: usize = 5;
const TIMED_ROUNDS: usize = 3;

/// Kernels by what they do.
const STAGES: [(&str, &[&str]); 5] = [
    (
        "lists",
        &[
            "project",
            "compact",
            "scan_reduce",
            "scan_sums",
            "scan_apply",
            "sort_count",
            "sort_scatter",
            "tile_lists",
            "tile_ranges",
        ],
    ),
    ("blending", &["shade", "blend"]),
    ("loss", &["luma_loss", "luma_loss_backward", "sum_loss"]),
    ("adjoint", &["blend_backward", "sum_instances"]),
    ("steps", &["shade_backward", "project_backward"]),
];

/// The times of one value of one knob; the default's are 1.
#[derive(Clone, Debug, Serialize)]
pub struct Time {
    /// Time of an iteration over the default's, the median over the rounds.
    pub ratio: f64,
    /// The rounds' quartiles.
    pub quartiles: [f64; 2],
    /// Milliseconds of an iteration: the default's median times the ratio.
    pub milliseconds: f64,
    /// Time of each stage over the default's, the median over the rounds.
    pub stages: BTreeMap<&'static str, f64>,
}

/// A trainer that has found its room already.
fn trainer(raster: &Arc<Raster>, subject: &Subject, numerics: Numerics) -> Fallible<LumaTrainer> {
    let settings = LumaSettings {
        sh_degree: subject.large.sh.degree,
        max_splats: subject.large.len(),
        numerics,
        ..LumaSettings::new(ITERATIONS)
    };
    let views = subject.views.clone();
    let raster = raster.clone();
    let mut trainer = LumaTrainer::new(raster, settings, subject.extent, &subject.large, views)?;
    trainer.follow(Schedule {
        // All harmonics from the start, as in most of a training.
        raise_degree_every: 1,
        ..trainer.schedule().clone()
    });
    trainer.train(&mut |_| {})?;
    Ok(trainer)
}

/// Ratios of each knob's times to the default's right before and right after it, `[rounds, knobs]`:
/// the machine's other load changes slowly. The order changes as well, for the next one may find
/// the caches cold.
fn rounds<const N: usize>(
    count: usize,
    mut turn: impl FnMut(usize) -> Result<[f64; N], LumaError>,
) -> Result<Vec<Vec<[f64; N]>>, LumaError> {
    (0..count)
        .map(|round| {
            let mut ratios = vec![[1.0; N]; KNOBS.len()];
            let mut before = turn(0)?;
            for place in 1..KNOBS.len() {
                let knob = if round % 2 == 0 {
                    place
                } else {
                    KNOBS.len() - place
                };
                let own = turn(knob)?;
                let after = turn(0)?;
                ratios[knob] = array::from_fn(|k| 2.0 * own[k] / (before[k] + after[k]));
                before = after;
            }
            Ok(ratios)
        })
        .collect()
}

/// The times of all knobs.
pub fn measure(gpu: &Gpu, subject: &Subject) -> Fallible<Vec<Time>> {
    let trainers = |gpu: &Gpu| -> Fallible<Vec<LumaTrainer>> {
        let raster = Arc::new(Raster::new(gpu));
        (KNOBS.iter())
            .map(|knob| trainer(&raster, subject, knob.numerics()))
            .collect()
    };
    let mut plain = trainers(gpu)?;
    let mut usual = Vec::new();
    let walls = rounds(ROUNDS, |knob| {
        let begun = Instant::now();
        plain[knob].train(&mut |_| {})?;
        let seconds = begun.elapsed().as_secs_f64() / ITERATIONS as f64;
        if knob == 0 {
            usual.push(1e3 * seconds);
        }
        Ok([seconds])
    })?;
    drop(plain);
    let timed = gpu.timed();
    let mut watched = trainers(&timed)?;
    timed.timings()?;
    let stages = rounds(TIMED_ROUNDS, |knob| {
        watched[knob].train(&mut |_| {})?;
        let times = timed.timings()?;
        Ok(STAGES.map(|(_, kernels)| {
            let own = times.iter().filter(|time| kernels.contains(&time.kernel));
            own.map(|time| time.seconds).sum::<f64>()
        }))
    })?;
    let milliseconds = median(usual);
    let of_knob = |knob: usize| {
        let mut ratios: Vec<f64> = walls.iter().map(|round| round[knob][0]).collect();
        ratios.sort_by(f64::total_cmp);
        let ratio = ratios[ROUNDS / 2];
        Time {
            ratio,
            quartiles: [ratios[ROUNDS / 4], ratios[ROUNDS - 1 - ROUNDS / 4]],
            milliseconds: ratio * milliseconds,
            stages: (STAGES.iter().enumerate())
                .map(|(k, &(stage, _))| {
                    (
                        stage,
                        median(stages.iter().map(|round| round[knob][k]).collect()),
                    )
                })
                .collect(),
        }
    };
    Ok((0..KNOBS.len()).map(of_knob).collect())
}
