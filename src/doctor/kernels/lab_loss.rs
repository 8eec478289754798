//! `lab_loss`, with and without a coarser picture.

use std::sync::Arc;

use super::losses::{SIZES, logged, view};
use crate::{
    chroma::{LabLossParameters, pack_rgb},
    compare::widen,
    doctor::measured::{Allowance, Row, Sample},
    gpu::{Buffer, Gpu, GpuError, Kernel, groups_for, shaders},
    oracle::{
        lab_loss::{LabTarget, LabWeights},
        random::{Random, round},
    },
    raster::Raster,
};

/// What wanted RGB are rounded to.
const STEPS: f64 = 1023.0;

/// All terms, none of which drowns another.
const WEIGHTS: LabWeights = LabWeights {
    lightness: 0.5,
    squared: false,
    chroma: 0.75,
    agreement: 0.25,
    variation: 2.0,
};

/// RGB as the device has pictures.
fn picture(gpu: &Gpu, rgb: &[[f64; 3]]) -> Result<Buffer<f32>, GpuError> {
    let padded: Vec<f32> = (rgb.iter())
        .flat_map(|&[r, g, b]| [r, g, b, f64::NAN])
        .map(|v| v as f32)
        .collect();
    Buffer::from_slice(gpu, "image", &padded)
}

/// Loss, and gradient, on the device.
fn on_device(
    gpu: &Gpu,
    drawn: &[[f64; 3]],
    target: &LabTarget,
    weighted: bool,
) -> Result<(f64, Vec<f32>), GpuError> {
    let source = match target.coarser {
        Some(_) => shaders::LAB_LOSS_AGREEING,
        None => shaders::LAB_LOSS,
    };
    let kernel = Kernel::new(gpu, "lab_loss", source);
    let view = view(gpu, target.size)?;
    let image = picture(gpu, drawn)?;
    let words = target.rgb.iter().map(|rgb| pack_rgb(rgb.map(|v| v as f32)));
    let words = Buffer::from_slice(gpu, "wanted", &words.collect::<Vec<_>>())?;
    let coarser = (target.coarser.as_ref()).map(|(_, rgb)| picture(gpu, rgb));
    let coarser = coarser.transpose()?;
    let parameters = LabLossParameters {
        coarser_size: (target.coarser.as_ref()).map_or([0; 2], |(size, _)| size.map(|s| s as u32)),
        lightness: target.of.lightness as f32,
        squared: u32::from(target.of.squared),
        chroma: target.of.chroma as f32,
        agreement: target.of.agreement as f32,
        variation: target.of.variation as f32,
        weighted: u32::from(weighted),
    };
    let parameters = Buffer::uniform(gpu, "parameters", &parameters)?;
    let weights: Vec<f32> = target.weights.iter().map(|&w| w as f32).collect();
    let weights = Buffer::from_slice(gpu, "pixel weights", &weights)?;
    let figures = Buffer::<f32>::zeros(gpu, "figures", 4 * drawn.len())?;
    let groups = groups_for(drawn.len());
    let loss = logged(
        gpu,
        target.size,
        groups as usize,
        |recorder, block_losses| {
            let mut buffers = vec![
                view.raw(),
                image.raw(),
                words.raw(),
                parameters.raw(),
                block_losses.raw(),
                figures.raw(),
                weights.raw(),
            ];
            buffers.extend(coarser.as_ref().map(Buffer::raw));
            recorder.dispatch(&kernel, &kernel.bind(gpu, &buffers), groups);
        },
    )?;
    Ok((loss, figures.read(gpu)?))
}

/// Which pictures are compared.
#[derive(Clone, Copy)]
struct Kind {
    /// Beyond black and white, far off, or not off at all.
    hard: bool,
    /// With weights and a coarser picture, lightness squared.
    full: bool,
}

/// Values and gradients.
fn measure(gpu: &Gpu, Kind { hard, full }: Kind) -> Result<[Vec<Sample>; 2], GpuError> {
    let mut samples: [Vec<Sample>; 2] = Default::default();
    for (seed, size) in (0..).zip(SIZES) {
        let mut random = Random::new(seed);
        let count = size[0] * size[1];
        let rgb: Vec<[f64; 3]> = (0..count)
            .map(|_| {
                let spread = if hard { [-0.5, 1.5] } else { [0.05, 1.0] };
                let rgb: [f64; 3] = random.array(spread[0], spread[1]);
                rgb.map(|v| (v.clamp(0.0, 1.0) * STEPS).round() / STEPS)
            })
            .collect();
        let drawn: Vec<[f64; 3]> = (rgb.iter().enumerate())
            .map(|(p, rgb)| {
                let off: [f64; 3] = match (hard, p % 3) {
                    (false, _) => random.array(-0.1, 0.1),
                    (true, 0) => random.array(0.0, 8.0),
                    (true, 1) => random.array(-1e-4, 1e-4),
                    (true, _) => [0.0; 3],
                };
                // What is drawn is not negative.
                [0, 1, 2].map(|c| round((rgb[c] + off[c]).max(0.0)))
            })
            .collect();
        let coarse = size.map(|side| (side / 2).max(1));
        let of_coarse = (0..coarse[0] * coarse[1]).map(|_| random.array(0.0, 1.0).map(round));
        let coarser = full.then(|| (coarse, of_coarse.collect()));
        let weight = |p: usize| if full { [0.0, 0.375, 1.0][p % 3] } else { 1.0 };
        let target = LabTarget {
            size,
            rgb,
            weights: (0..count).map(weight).collect(),
            coarser,
            of: LabWeights {
                squared: full,
                ..WEIGHTS
            },
        };
        let (loss, figures) = on_device(gpu, &drawn, &target, full)?;
        let figures: Vec<[f64; 4]> = widen(&figures).as_chunks().0.to_vec();
        let scaled = |values: &mut dyn Iterator<Item = f64>| -> Vec<f64> {
            values.map(|v| v * count as f64).collect()
        };
        let found = scaled(&mut figures.iter().flat_map(|f| [f[0], f[1], f[2]]));
        let expected = scaled(&mut target.gradient(&drawn).into_iter().flatten());
        samples[0].push(Sample::new(vec![loss], vec![target.loss(&drawn)]));
        samples[1].push(Sample::new(found, expected));
    }
    Ok(samples)
}

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let (gpu, allowed) = (&raster.gpu, Allowance::of(&raster.gpu));
    let mut rows = Vec::new();
    // a and b are 500 and 200 times small differences: what f32 rounds in these is seen.
    for (what, [hard, full], [l2, worst]) in [
        (["value", "gradient × pixels"], [false, false], [5e-6, 8e-5]),
        (
            ["value, agreeing", "gradient × pixels, agreeing"],
            [false, true],
            [3e-6, 8e-5],
        ),
        (
            ["value, hard", "gradient × pixels, hard"],
            [true, false],
            [5.4e-5, 1.7e-4],
        ),
    ] {
        let [values, gradients] = measure(gpu, Kind { hard, full })?;
        let value = allowed.relative(9e-7, 0.0);
        rows.push(Row::elementwise("lab_loss", what[0], value, &values));
        let bounds = allowed.gradient(l2, allowed.relative(worst, 100.0));
        rows.push(Row::gradient("lab_loss", what[1], bounds, &gradients));
    }
    Ok(rows)
}
