//! `chroma_loss`, and `sum_loss` of many blocks.

use std::sync::Arc;

use super::losses::{SIZES, logged, view};
use crate::{
    chroma::{ChromaLossWeights, Correction, pack_ab},
    compare::{narrow, widen},
    doctor::measured::{Allowance, Row, Sample, by_quantity},
    gpu::{Buffer, Gpu, GpuError, Kernel, groups_for, shaders},
    oracle::{
        chroma_loss::{AbTargets, chroma_loss, chroma_loss_gradient, curvature},
        random::{Random, round},
    },
    raster::Raster,
};

/// More blocks of 256 pixels than `sum_loss` has threads.
const MANY_BLOCKS: [usize; 2] = [301, 243];

/// Weight of the teacher: exact in f32, and not 1.
const TEACHER: f64 = 0.75;

/// Input of the kernel.
pub struct ChromaInput<'a> {
    /// Width and height.
    pub size: [usize; 2],
    /// Rendered a/b, `[pixels][2]`.
    pub image: &'a [[f64; 2]],
    /// Wanted a/b, `[pixels][2]`, in 256ths of a unit.
    pub wanted: &'a [[f64; 2]],
    /// The coarser scale's picture, of the size in `weights`; read where `weights` say so.
    pub coarser: &'a [[f64; 2]],
    /// Weight of each pixel; read where `weights` say so.
    pub pixel_weights: &'a [f64],
    /// Correction of each view.
    pub corrections: &'a [Correction],
    /// Weights of the loss terms.
    pub weights: ChromaLossWeights,
}

/// Output of the kernel.
pub struct ChromaOutput {
    /// Mean loss over the pixels.
    pub loss: f64,
    /// Gradient with respect to the image, `[pixels, 2]`.
    pub gradient: Vec<f32>,
    /// Slope over residual, `[pixels, 2]`.
    pub curvatures: Vec<f32>,
}

impl ChromaInput<'_> {
    /// Runs the kernel.
    pub fn run(&self, gpu: &Gpu) -> Result<ChromaOutput, GpuError> {
        let agrees = self.weights.agreement > 0.0;
        let shader = if agrees {
            shaders::CHROMA_LOSS_AGREEING
        } else {
            shaders::CHROMA_LOSS
        };
        let kernel = Kernel::new(gpu, "chroma_loss", shader);
        let view = view(gpu, self.size)?;
        let weights = Buffer::uniform(gpu, "weights", &self.weights)?;
        let pixels = |values: &[f64]| Buffer::from_slice(gpu, "pixels", &narrow(values));
        let image = pixels(self.image.as_flattened())?;
        let coarser = pixels(self.coarser.as_flattened())?;
        let wanted: Vec<u32> = (self.wanted.iter())
            .map(|ab| pack_ab(ab.map(|v| v as f32)))
            .collect();
        let wanted = Buffer::from_slice(gpu, "wanted", &wanted)?;
        let pixel_weights = pixels(self.pixel_weights)?;
        let corrections = Buffer::from_slice(gpu, "corrections", self.corrections)?;
        let figures = Buffer::<f32>::zeros(gpu, "figures", 2 * image.len())?;
        let groups = groups_for(self.size[0] * self.size[1]);
        let loss = logged(gpu, self.size, groups as usize, |recorder, block_losses| {
            let mut buffers = vec![
                view.raw(),
                image.raw(),
                wanted.raw(),
                weights.raw(),
                block_losses.raw(),
                figures.raw(),
                pixel_weights.raw(),
                corrections.raw(),
            ];
            if agrees {
                buffers.push(coarser.raw());
            }
            recorder.dispatch(&kernel, &kernel.bind(gpu, &buffers), groups);
        })?;
        let figures = figures.read(gpu)?;
        let half = |first: usize| {
            let of_pixels = figures.chunks_exact(4);
            let of_pixels = of_pixels.flat_map(|figures| &figures[first..first + 2]);
            of_pixels.copied().collect()
        };
        Ok(ChromaOutput {
            loss,
            gradient: half(0),
            curvatures: half(2),
        })
    }
}

/// Rounded to what wanted a/b can be.
pub(super) fn in_steps(value: f64) -> f64 {
    (256.0 * value).round() / 256.0
}

/// Bilinear sample with half-pixel centers, as images are resized everywhere.
fn upsample(coarser: &[[f64; 2]], from: [usize; 2], to: [usize; 2]) -> Vec<[f64; 2]> {
    let taps = |index: usize, axis: usize| {
        let at = (index as f64 + 0.5) * from[axis] as f64 / to[axis] as f64 - 0.5;
        let at = at.clamp(0.0, from[axis] as f64 - 1.0);
        let low = at.floor();
        [
            (low as usize, 1.0 - (at - low)),
            ((low as usize + 1).min(from[axis] - 1), at - low),
        ]
    };
    (0..to[0] * to[1])
        .map(|p| {
            let mut sum = [0.0; 2];
            for (row, down) in taps(p / to[0], 1) {
                for (column, across) in taps(p % to[0], 0) {
                    let value = coarser[row * from[0] + column];
                    sum = [0, 1].map(|c| sum[c] + across * down * value[c]);
                }
            }
            sum
        })
        .collect()
}

/// Variant of the loss that a row measures.
#[derive(Clone, Copy)]
struct LossRequest {
    agreement: f64,
    decline: f64,
    /// True if pixels carry weights and the teacher is corrected.
    weighed: bool,
    /// True if a and b are judged together.
    joint: bool,
}

const PLAIN: LossRequest = LossRequest {
    agreement: 0.0,
    decline: 0.0,
    weighed: false,
    joint: false,
};

/// Weights that decide differently: unknown, half known, ordinary, painted.
const PIXEL_WEIGHTS: [f64; 5] = [0.0, 0.375, 1.0, 1.0, 50.0];

/// The third of them is the view's.
const CORRECTIONS: [Correction; 3] = [
    Correction::NONE,
    Correction {
        gain: [[0.5, 3.0], [2.0, -1.0]],
        offset: [90.0, -90.0],
        padding: [0.0; 2],
    },
    Correction {
        gain: [[1.25, -0.125], [0.0625, 0.75]],
        offset: [-3.0, 5.5],
        padding: [0.0; 2],
    },
];

/// Values, gradients and curvatures, the latter two by pixel.
fn measure(gpu: &Gpu, terms: LossRequest) -> Result<[Vec<Sample>; 3], GpuError> {
    let sizes = SIZES.into_iter().chain([MANY_BLOCKS]);
    by_quantity(sizes.enumerate().map(|(seed, size)| {
        let mut random = Random::new(seed as u64);
        let half = size.map(|side| side.div_ceil(2));
        let mut pixels = |[width, height]: [usize; 2], spread: f64| -> Vec<[f64; 2]> {
            (0..width * height)
                .map(|_| random.array(-spread, spread))
                .collect()
        };
        let (wanted, coarser) = (pixels(size, 60.0), pixels(half, 60.0));
        // As they wait for the kernel.
        let wanted = wanted.into_iter().map(|ab| ab.map(in_steps)).collect();
        let noise = pixels(size, 3.0);
        let count = size[0] * size[1];
        let mut teaching = AbTargets {
            weights: vec![1.0; count],
            gain: [[1.0, 0.0], [0.0, 1.0]],
            offset: [0.0; 2],
            decline: round(terms.decline),
            joint: terms.joint,
            wanted,
        };
        if terms.weighed {
            let weights = (0..count).map(|p| PIXEL_WEIGHTS[(p * 7 + seed) % PIXEL_WEIGHTS.len()]);
            teaching.weights = weights.collect();
            teaching.gain = CORRECTIONS[2].gain.map(|row| row.map(f64::from));
            teaching.offset = CORRECTIONS[2].offset.map(f64::from);
        }
        // About what is wanted after the correction, a painted pixel far from it.
        let image: Vec<[f64; 2]> = (teaching.wanted.iter().zip(&noise))
            .map(|(&[a, b], noise)| {
                let (gain, offset) = (teaching.gain, teaching.offset);
                [0, 1].map(|c| round(gain[c][0] * a + gain[c][1] * b + offset[c] + noise[c]))
            })
            .collect();
        let input = ChromaInput {
            size,
            image: &image,
            wanted: &teaching.wanted,
            coarser: &coarser,
            pixel_weights: if terms.weighed {
                &teaching.weights
            } else {
                &[0.0]
            },
            corrections: &CORRECTIONS,
            weights: ChromaLossWeights {
                coarser_size: half.map(|side| side as u32),
                teacher: TEACHER as f32,
                agreement: terms.agreement as f32,
                decline: terms.decline as f32,
                view_index: if terms.weighed { 2 } else { 0 },
                weighted: u32::from(terms.weighed),
                joint: u32::from(terms.joint),
            },
        };
        let output = input.run(gpu)?;

        let smooth = upsample(&coarser, half, size);
        let [slopes, curves] = teaching.slopes(&image);
        let drift = chroma_loss_gradient(&image, &smooth);
        let by_drift: Vec<[f64; 2]> = (image.iter().zip(&smooth))
            .map(|(x, s)| [0, 1].map(|c| curvature(x[c] - s[c], 0.0) / (2 * count) as f64))
            .collect();
        let scale = count as f64;
        let sum = |by_teacher: &[[f64; 2]], by_coarser: &[[f64; 2]]| -> Vec<f64> {
            let pairs = by_teacher.as_flattened().iter();
            (pairs.zip(by_coarser.as_flattened()))
                .map(|(t, c)| scale * (TEACHER * t + terms.agreement * c))
                .collect()
        };
        let loss = TEACHER * teaching.loss(&image) + terms.agreement * chroma_loss(&image, &smooth);
        let scaled = |values: &[f32]| widen(values).into_iter().map(|v| v * scale).collect();
        Ok([
            Sample::new(vec![output.loss], vec![loss]),
            Sample::new(scaled(&output.gradient), sum(&slopes, &drift)),
            Sample::new(scaled(&output.curvatures), sum(&curves, &by_drift)),
        ])
    }))
}

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let (gpu, allowed) = (&raster.gpu, Allowance::of(&raster.gpu));
    let agreeing = |terms| LossRequest {
        agreement: 0.5,
        ..terms
    };
    let solver = LossRequest {
        decline: 0.1,
        weighed: true,
        ..PLAIN
    };
    let joint = LossRequest {
        joint: true,
        ..solver
    };
    let solvers = ", weighed, corrected, declining";
    let mut rows = Vec::new();
    // The worst errors seen: of values, and of gradients and curvatures as a whole and of an
    // element.
    for (kind, terms, value, gradient, curvature) in [
        ("", PLAIN, 6.35e-8, [7.40e-8, 6.31e-8], None),
        (
            " with agreement",
            agreeing(PLAIN),
            1.24e-7,
            [1.53e-7, 1.88e-6],
            None,
        ),
        (
            solvers,
            solver,
            6.61e-7,
            [3.43e-7, 5.28e-6],
            Some([3.90e-7, 2.62e-6]),
        ),
        (
            ", a and b together",
            joint,
            1.12e-7,
            [2.17e-7, 4.42e-6],
            Some([1.34e-7, 1.86e-6]),
        ),
        (
            ", all terms",
            agreeing(joint),
            8.48e-8,
            [8.84e-8, 3.80e-6],
            Some([1.43e-7, 1.83e-6]),
        ),
    ] {
        let [values, gradients, curvatures] = measure(gpu, terms)?;
        let row = |what, [l2, worst]: [f64; 2], samples: &[Sample]| {
            let what = format!("{what} × pixels{kind}");
            allowed.gradients("chroma_loss", what, [l2, worst, 1.0], samples)
        };
        rows.push(allowed.values("chroma_loss", format!("value{kind}"), [value, 0.0], &values));
        rows.push(row("gradient", gradient, &gradients));
        rows.extend(curvature.map(|seen| row("curvature", seen, &curvatures)));
    }
    Ok(rows)
}
