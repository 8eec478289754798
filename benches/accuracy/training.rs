//! Result of a training with each knob: the distance of its parameters, and held-out PSNR.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use gs_chroma::{
    capture::LoadOptions,
    gpu::Gpu,
    low_level::run::{FitRequest, Preset, fit},
    luma::{LumaOverlay, LumaSettings, LumaTrainer, Numerics, Schedule},
    raster::Raster,
    splats::Splats,
};
use serde::Serialize;

use crate::{Fallible, error::relative, knobs::KNOBS, scene::Subject};

/// Iterations after which parameters are compared.
const DRIFT_ITERATIONS: usize = 200;

/// Iterations and longer side of the photos of a whole training.
const FIT_ITERATIONS: usize = 250;
const FIT_SIDE: u32 = 128;

/// Longer side of the photos of the run that iterations are timed on.
const TIMED_SIDE: u32 = 320;

/// Seeds of the trainings, of which the mean counts: one training more or less differs by
/// as much as the knobs do.
const SEEDS: [u64; 2] = [0, 1];

/// A whole training, the mean over the seeds.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Fit {
    /// Held-out PSNR in dB.
    pub psnr: f64,
    /// Lowest and highest of the seeds'.
    pub range: [f64; 2],
    /// Seconds of training.
    pub seconds: f64,
}

fn groups(splats: &Splats) -> Vec<Vec<f64>> {
    let wide = |values: &[f32]| values.iter().map(|&v| f64::from(v)).collect();
    vec![
        wide(splats.means.as_flattened()),
        wide(splats.quats.as_flattened()),
        wide(splats.log_scales.as_flattened()),
        wide(&splats.opacity_logits),
        wide(&splats.sh.coefficients),
    ]
}

/// Distance of each knob's parameters from the default's after some iterations of the same set of
/// Gaussians, relative to the distance that the default's have moved.
pub fn drifts(gpu: &Gpu, subject: &Subject) -> Fallible<Vec<f64>> {
    let raster = Arc::new(Raster::new(gpu));
    let train = |numerics: Numerics| -> Fallible<Vec<Vec<f64>>> {
        let settings = LumaSettings {
            sh_degree: subject.small.sh.degree,
            max_splats: subject.small.len(),
            numerics,
            ..LumaSettings::new(DRIFT_ITERATIONS)
        };
        let views = vec![subject.view.clone()];
        let (raster, start) = (raster.clone(), &subject.small);
        let mut trainer = LumaTrainer::new(raster, settings, subject.extent, start, views)?;
        trainer.follow(Schedule {
            densify_until: 0,
            ..trainer.schedule().clone()
        });
        trainer.train(&mut |_| {})?;
        Ok(groups(&trainer.splats()?))
    };
    let moved = |from: &[Vec<f64>], to: &[Vec<f64>]| -> Vec<Vec<f64>> {
        let pairs = from.iter().zip(to);
        pairs
            .map(|(from, to)| from.iter().zip(to).map(|(a, b)| b - a).collect())
            .collect()
    };
    let start = groups(&subject.small);
    let usual = moved(&start, &train(Numerics::default())?);
    (KNOBS.iter())
        .map(|knob| Ok(relative(&moved(&start, &train(knob.numerics())?), &usual)))
        .collect()
}

fn options(capture: &Path, output: &Path, seed: u64, numerics: Numerics) -> FitRequest {
    FitRequest {
        output: Some(output.to_owned()),
        preset: Some(Preset::Draft),
        settings: LumaOverlay {
            iterations: Some(FIT_ITERATIONS),
            stop_when_flat: Some(0.0),
            seed: Some(seed),
            numerics: Some(numerics),
            ..LumaOverlay::default()
        },
        load: LoadOptions {
            max_side: Some(FIT_SIDE),
            ..LoadOptions::default()
        },
        ..FitRequest::new(capture.to_owned())
    }
}

fn target(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("target")
        .join(name)
}

/// The bundled scene, and a run of it.
pub fn fitted() -> Fallible<(PathBuf, PathBuf)> {
    let capture = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/demo");
    let output = target("accuracy/garden");
    eprintln!("training the bundled scene");
    let mut options = options(&capture, &output, 0, Numerics::default());
    // This run is timed as well.
    options.load.max_side = Some(TIMED_SIDE);
    fit(&options, &mut |_| {})?;
    Ok((capture, output))
}

/// A training with each knob.
pub fn fits(capture: &Path) -> Fallible<Vec<Fit>> {
    let output = target("accuracy/run");
    let mut fits = Vec::new();
    for knob in KNOBS {
        eprintln!("training with {} {}", knob.key, knob.value);
        let (mut psnrs, mut seconds) = (Vec::new(), Vec::new());
        for seed in SEEDS {
            let options = options(capture, &output, seed, knob.numerics());
            let (_, report) = fit(&options, &mut |_| {})?;
            let held_out = report.luma.held_out.ok_or("no photo is held out")?;
            psnrs.push(held_out.psnr);
            seconds.push(report.luma.seconds.train);
        }
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        fits.push(Fit {
            psnr: mean(&psnrs),
            range: [
                psnrs.iter().copied().fold(f64::INFINITY, f64::min),
                psnrs.iter().copied().fold(0.0, f64::max),
            ],
            seconds: mean(&seconds),
        });
    }
    Ok(fits)
}
