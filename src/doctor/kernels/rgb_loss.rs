//! `rgb_loss`, and `lab_loss` with and without coarser pictures.

use std::sync::Arc;

use bytemuck::Pod;

use super::losses::{SIZES, logged, view};
use crate::{
    chroma::{LabLossParameters, RgbLossParameters, pack_rgb},
    compare::{narrow, widen},
    doctor::measured::{Allowance, Row, Sample, by_quantity},
    gpu::{Buffer, Gpu, GpuError, Kernel, groups_for, shaders},
    oracle::{
        lab_loss::{LabTarget, LabWeights},
        random::{Random, round},
        rgb_loss::RgbTargets,
    },
    raster::Raster,
};

/// Quantization steps of target RGB between 0 and 1.
const STEPS: f64 = 1023.0;

/// All terms of `lab_loss`, none of which drowns another.
const WEIGHTS: LabWeights = LabWeights {
    lightness: 0.5,
    squared: false,
    chroma: 0.75,
    agreement: 0.25,
    variation: 200.0,
    pooled: 0,
    in_rgb: false,
};

/// RGB as the device has pictures.
fn picture(gpu: &Gpu, rgb: &[[f64; 3]]) -> Result<Buffer<f32>, GpuError> {
    let padded = rgb.iter().map(|&[r, g, b]| [r, g, b, f64::NAN]);
    let padded: Vec<[f64; 4]> = padded.collect();
    Buffer::from_slice(gpu, "image", &narrow(padded.as_flattened()))
}

/// Pictures as a loss takes them.
struct Compared<'a, P> {
    size: [usize; 2],
    drawn: &'a [[f64; 3]],
    wanted: &'a [[f64; 3]],
    weights: &'a [f64],
    parameters: P,
    coarser: Option<&'a [[f64; 3]]>,
}

impl<P: Pod> Compared<'_, P> {
    /// The loss on the device, and a pixel's four figures.
    fn on_device(&self, gpu: &Gpu, kernel: &Kernel) -> Result<(f64, Vec<[f64; 4]>), GpuError> {
        let view = view(gpu, self.size)?;
        let image = picture(gpu, self.drawn)?;
        let words = self
            .wanted
            .iter()
            .map(|rgb| pack_rgb(rgb.map(|v| v as f32)));
        let words = Buffer::from_slice(gpu, "wanted", &words.collect::<Vec<_>>())?;
        let coarser = self.coarser.map(|rgb| picture(gpu, rgb)).transpose()?;
        let parameters = Buffer::uniform(gpu, "parameters", &self.parameters)?;
        let weights = Buffer::from_slice(gpu, "pixel weights", &narrow(self.weights))?;
        let figures = Buffer::<f32>::zeros(gpu, "figures", 4 * self.drawn.len())?;
        let groups = groups_for(self.drawn.len());
        let loss = logged(gpu, self.size, groups as usize, |recorder, block_losses| {
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
            recorder.dispatch(kernel, &kernel.bind(gpu, &buffers), groups);
        })?;
        let figures = widen(&figures.read(gpu)?);
        Ok((loss, figures.as_chunks().0.to_vec()))
    }
}

/// Wanted RGB from black, or `darkest`, to white; where it is `hard`, many of them clipped.
fn wanted(random: &mut Random, count: usize, hard: bool, darkest: f64) -> Vec<[f64; 3]> {
    let [low, high] = if hard { [-0.5, 1.5] } else { [darkest, 1.0] };
    (0..count)
        .map(|_| {
            let rgb: [f64; 3] = random.array(low, high);
            rgb.map(|v| (v.clamp(0.0, 1.0) * STEPS).round() / STEPS)
        })
        .collect()
}

/// Weights of pixels: those given in turn, or all alike.
fn weights(count: usize, differ: bool, given: &[f64]) -> Vec<f64> {
    let given = if differ { given } else { &[1.0] };
    given.iter().copied().cycle().take(count).collect()
}

/// Values, gradients and curvatures of `rgb_loss`. Pictures are near what is wanted, or `hard`
/// and weighed: beyond white and black, wanted or not, and where nothing is off.
fn of_rgb(gpu: &Gpu, hard: bool) -> Result<[Vec<Sample>; 3], GpuError> {
    let kernel = Kernel::new(gpu, "rgb_loss", shaders::RGB_LOSS);
    by_quantity((0..).zip(SIZES).map(|(seed, size)| {
        let mut random = Random::new(seed);
        let count = size[0] * size[1];
        let rgb = wanted(&mut random, count, hard, 0.0);
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
        let wanted = RgbTargets {
            rgb,
            weights: weights(count, hard, &[0.0, 0.375, 1.0]),
        };
        let compared = Compared {
            size,
            drawn: &drawn,
            wanted: &wanted.rgb,
            weights: &wanted.weights,
            parameters: RgbLossParameters {
                weighted: u32::from(hard),
            },
            coarser: None,
        };
        let (loss, figures) = compared.on_device(gpu, &kernel)?;
        let slopes = wanted.slopes(&drawn);
        let part = |of: &[[f64; 4]], from: usize, to: usize| -> Vec<f64> {
            let values = of.iter().flat_map(|f| f[from..to].to_vec());
            values.map(|v| v * count as f64).collect()
        };
        Ok([
            Sample::new(vec![loss], vec![wanted.loss(&drawn)]),
            Sample::new(part(&figures, 0, 3), part(&slopes, 0, 3)),
            Sample::new(part(&figures, 3, 4), part(&slopes, 3, 4)),
        ])
    }))
}

/// Values and gradients of `lab_loss` with terms `of`, with weights where pixels are `weighted`.
/// Pictures that are `hard` are beyond black and white, far off, or not off at all; without
/// squares of lightness there is no coarser picture to agree with.
fn of_lab(
    gpu: &Gpu,
    hard: bool,
    weighted: bool,
    of: LabWeights,
) -> Result<[Vec<Sample>; 2], GpuError> {
    let source = match of.squared {
        true => shaders::LAB_LOSS_AGREEING,
        false => shaders::LAB_LOSS,
    };
    let kernel = Kernel::new(gpu, "lab_loss", source);
    by_quantity((0..).zip(SIZES).map(|(seed, size)| {
        let mut random = Random::new(seed);
        let count = size[0] * size[1];
        let rgb = wanted(&mut random, count, hard, 0.05);
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
        let target = LabTarget {
            size,
            rgb,
            weights: weights(count, weighted, &[0.0, 0.375, 1.0, 1.0, 0.75, 1.0, 1.0]),
            coarser: of.squared.then(|| (coarse, of_coarse.collect())),
            of,
        };
        let compared = Compared {
            size,
            drawn: &drawn,
            wanted: &target.rgb,
            weights: &target.weights,
            parameters: LabLossParameters {
                coarser_size: coarse.map(|side| if of.squared { side as u32 } else { 0 }),
                lightness: of.lightness as f32,
                squared: u32::from(of.squared),
                chroma: of.chroma as f32,
                agreement: of.agreement as f32,
                variation: of.variation as f32,
                weighted: u32::from(weighted),
                pooled: of.pooled as u32,
                in_rgb: u32::from(of.in_rgb),
            },
            coarser: target.coarser.as_ref().map(|(_, rgb)| &rgb[..]),
        };
        let (loss, figures) = compared.on_device(gpu, &kernel)?;
        let scaled = |values: &mut dyn Iterator<Item = f64>| -> Vec<f64> {
            values.map(|v| v * count as f64).collect()
        };
        let found = scaled(&mut figures.iter().flat_map(|f| [f[0], f[1], f[2]]));
        let expected = scaled(&mut target.gradient(&drawn).into_iter().flatten());
        Ok([
            Sample::new(vec![loss], vec![target.loss(&drawn)]),
            Sample::new(found, expected),
        ])
    }))
}

pub(super) fn rgb_rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let (gpu, allowed) = (&raster.gpu, Allowance::of(&raster.gpu));
    let mut rows = Vec::new();
    for (kind, hard) in [("", false), (", weighed, hard", true)] {
        let [values, gradients, curvatures] = of_rgb(gpu, hard)?;
        rows.push(allowed.values("rgb_loss", format!("value{kind}"), [5.19e-7, 0.0], &values));
        for (what, samples) in [("gradient", &gradients), ("curvature", &curvatures)] {
            let what = format!("{what} × pixels{kind}");
            rows.push(allowed.gradients("rgb_loss", what, [1.32e-6, 1.71e-6, 100.0], samples));
        }
    }
    Ok(rows)
}

pub(super) fn lab_rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let (gpu, allowed) = (&raster.gpu, Allowance::of(&raster.gpu));
    let mut rows = Vec::new();
    let [mut agreeing, mut pooled, mut in_rgb] = [WEIGHTS; 3];
    agreeing.squared = true;
    pooled.pooled = 2;
    in_rgb.in_rgb = true;
    // a and b are 500 and 200 times small differences: what f32 rounds in these is seen.
    for (kind, [hard, weighted], of, [value, l2, worst]) in [
        ("", [false, false], WEIGHTS, [9e-7, 5e-6, 8e-5]),
        (", agreeing", [false, true], agreeing, [9e-7, 3e-6, 8e-5]),
        (", pooled", [false, true], pooled, [9e-7, 5e-6, 8e-5]),
        (", in RGB", [false, false], in_rgb, [1.2e-6, 1e-6, 8e-5]),
        (", hard", [true, false], WEIGHTS, [9e-7, 5.4e-5, 1.7e-4]),
    ] {
        let [values, gradients] = of_lab(gpu, hard, weighted, of)?;
        rows.push(allowed.values("lab_loss", format!("value{kind}"), [value, 0.0], &values));
        let what = format!("gradient × pixels{kind}");
        rows.push(allowed.gradients("lab_loss", what, [l2, worst, 100.0], &gradients));
    }
    Ok(rows)
}
