//! `rgb_loss`.

use std::sync::Arc;

use super::losses::{SIZES, logged, view};
use crate::{
    chroma::{RgbLossParameters, pack_rgb},
    compare::widen,
    doctor::measured::{Allowance, Row, Sample},
    gpu::{Buffer, Gpu, GpuError, Kernel, groups_for, shaders},
    oracle::{
        random::{Random, round},
        rgb_loss::Wanted,
    },
    raster::Raster,
};

/// What wanted RGB are rounded to.
const STEPS: f64 = 1023.0;

/// Loss, and gradient with curvature, on the device.
fn on_device(
    gpu: &Gpu,
    size: [usize; 2],
    drawn: &[[f64; 3]],
    wanted: &Wanted,
    weighted: bool,
) -> Result<(f64, Vec<f32>), GpuError> {
    let kernel = Kernel::new(gpu, "rgb_loss", shaders::RGB_LOSS);
    let view = view(gpu, size)?;
    let image: Vec<f32> = (drawn.iter())
        .flat_map(|&[r, g, b]| [r, g, b, f64::NAN])
        .map(|v| v as f32)
        .collect();
    let image = Buffer::from_slice(gpu, "image", &image)?;
    let words = wanted.rgb.iter().map(|rgb| pack_rgb(rgb.map(|v| v as f32)));
    let words = Buffer::from_slice(gpu, "wanted", &words.collect::<Vec<_>>())?;
    let parameters = RgbLossParameters {
        weighted: u32::from(weighted),
    };
    let parameters = Buffer::uniform(gpu, "parameters", &parameters)?;
    let weights: Vec<f32> = wanted.weights.iter().map(|&w| w as f32).collect();
    let weights = Buffer::from_slice(gpu, "pixel weights", &weights)?;
    let figures = Buffer::<f32>::zeros(gpu, "figures", 4 * drawn.len())?;
    let groups = groups_for(drawn.len());
    let loss = logged(gpu, size, groups as usize, |recorder, block_losses| {
        let buffers = [
            view.raw(),
            image.raw(),
            words.raw(),
            parameters.raw(),
            block_losses.raw(),
            figures.raw(),
            weights.raw(),
        ];
        recorder.dispatch(&kernel, &kernel.bind(gpu, &buffers), groups);
    })?;
    Ok((loss, figures.read(gpu)?))
}

/// Values, gradients and curvatures. Pictures are near what is wanted, or where they are
/// hard: beyond white and black, wanted or not, and where nothing is off.
fn measure(gpu: &Gpu, hard: bool, weighted: bool) -> Result<[Vec<Sample>; 3], GpuError> {
    let mut samples: [Vec<Sample>; 3] = Default::default();
    for (seed, size) in (0..).zip(SIZES) {
        let mut random = Random::new(seed);
        let count = size[0] * size[1];
        let rgb: Vec<[f64; 3]> = (0..count)
            .map(|_| {
                let spread = if hard { [-0.5, 1.5] } else { [0.0, 1.0] };
                let rgb: [f64; 3] = random.array(spread[0], spread[1]);
                rgb.map(|v| (v.clamp(0.0, 1.0) * STEPS).round() / STEPS)
            })
            .collect();
        let drawn: Vec<[f64; 3]> = (rgb.iter().enumerate())
            .map(|(p, rgb)| {
                let off: [f64; 3] = match (hard, p % 3) {
                    (false, _) => random.array(-0.1, 0.1),
                    (true, 0) => [0.0; 3],
                    (true, 1) => random.array(-1e-4, 1e-4),
                    (true, _) => random.array(-30.0, 30.0),
                };
                [0, 1, 2].map(|c| round(rgb[c] + off[c]))
            })
            .collect();
        let weight = |p: usize| {
            if weighted {
                [0.0, 0.375, 1.0][p % 3]
            } else {
                1.0
            }
        };
        let wanted = Wanted {
            rgb,
            weights: (0..count).map(weight).collect(),
        };
        let (loss, figures) = on_device(gpu, size, &drawn, &wanted, weighted)?;
        let slopes = wanted.slopes(&drawn);
        let scale = count as f64;
        let scaled = |values: Vec<f64>| values.into_iter().map(|v| v * scale).collect();
        let figures: Vec<[f64; 4]> = widen(&figures).as_chunks().0.to_vec();
        let part = |of: &[[f64; 4]], from: usize, to: usize| -> Vec<f64> {
            scaled(of.iter().flat_map(|f| f[from..to].to_vec()).collect())
        };
        samples[0].push(Sample::new(vec![loss], vec![wanted.loss(&drawn)]));
        samples[1].push(Sample::new(part(&figures, 0, 3), part(&slopes, 0, 3)));
        samples[2].push(Sample::new(part(&figures, 3, 4), part(&slopes, 3, 4)));
    }
    Ok(samples)
}

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let (gpu, allowed) = (&raster.gpu, Allowance::of(&raster.gpu));
    let mut rows = Vec::new();
    for (what, hard, weighted) in [
        (
            ["value", "gradient × pixels", "curvature × pixels"],
            false,
            false,
        ),
        (
            [
                "value, weighed, hard",
                "gradient × pixels, weighed, hard",
                "curvature × pixels, weighed, hard",
            ],
            true,
            true,
        ),
    ] {
        let [values, gradients, curvatures] = measure(gpu, hard, weighted)?;
        let value = allowed.relative(5.19e-7, 0.0);
        rows.push(Row::elementwise("rgb_loss", what[0], value, &values));
        for (what, samples) in [(what[1], &gradients), (what[2], &curvatures)] {
            let bounds = allowed.gradient(1.32e-6, allowed.relative(1.71e-6, 100.0));
            rows.push(Row::gradient("rgb_loss", what, bounds, samples));
        }
    }
    Ok(rows)
}
