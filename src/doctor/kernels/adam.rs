//! `adam`: many steps over planes with different learning rates.

use std::sync::Arc;

use crate::{
    compare::{narrow, widen},
    doctor::measured::{Allowance, Row, Sample, by_quantity},
    gpu::{Buffer, Gpu, GpuError, Recorder},
    oracle::{
        adam::{Moments, adam},
        random::Random,
    },
    raster::{Adam, AdamKernel, Raster, constants::*},
};

const STEPS: u32 = 20;

/// Planes and elements of a plane.
const SHAPES: [[usize; 2]; 4] = [[1, 1], [3, 257], [11, 100], [48, 37]];

fn rates(planes: usize) -> Vec<f32> {
    (0..planes)
        .map(|plane| 1e-3 * 1.1_f32.powi(plane as i32))
        .collect()
}

/// Typical size of the gradient of element `k`: all that trainings meet.
fn size(k: usize) -> f64 {
    10_f64.powi((k % 13) as i32 - 10)
}

/// Gradients of those sizes, and exact zeros.
fn gradient(random: &mut Random, len: usize) -> Vec<f32> {
    let value = |k: usize| {
        let value = (random.range(-1.0, 1.0) * size(k)) as f32;
        if k.is_multiple_of(29) { 0.0 } else { value }
    };
    (0..len).map(value).collect()
}

/// Values and moments after all steps.
fn run(gpu: &Gpu, [planes, count]: [usize; 2]) -> Result<[Sample; 3], GpuError> {
    let mut random = Random::new(planes as u64);
    let len = planes * count;
    let rates = rates(planes);
    let mut expected: Vec<f64> = (0..len).map(|_| random.range(-2.0, 2.0)).collect();
    let start = narrow(&expected);
    let mut moments = vec![
        Moments {
            first: 0.0,
            second: 0.0
        };
        len
    ];

    let kernel = AdamKernel::new(gpu);
    let values = Buffer::from_slice(gpu, "values", &start)?;
    let slope = Buffer::zeros(gpu, "gradient", len)?;
    let status = Buffer::zeros(gpu, "status", STATUS_WORDS)?;
    let optimizer = Adam::new(gpu, &kernel, &status, &slope, &values, count)?;
    for step in 1..=STEPS {
        let gradient = gradient(&mut random, len);
        slope.write(gpu, &gradient);
        let mut recorder = Recorder::new(gpu);
        optimizer.record(gpu, &kernel, &mut recorder, step, &rates);
        recorder.submit();
        for (k, (value, moments)) in expected.iter_mut().zip(&mut moments).enumerate() {
            let rate = f64::from(rates[k / count]);
            adam(value, moments, f64::from(gradient[k]), rate, step as i32);
        }
    }
    let read = |buffer: &Buffer<f32>| Ok(widen(&buffer.read(gpu)?));
    let (first, second) = moments.iter().map(|m| (m.first, m.second)).unzip();
    // In units of the gradient, or of its square.
    let by_size = |power: i32, actual: Vec<f64>, expected: Vec<f64>| {
        let scaled = |values: Vec<f64>| -> Vec<f64> {
            let values = values.into_iter().enumerate();
            values.map(|(k, v)| v / size(k).powi(power)).collect()
        };
        Sample::new(scaled(actual), scaled(expected))
    };
    Ok([
        Sample::new(read(&values)?, expected),
        by_size(1, read(&optimizer.moments.first)?, first),
        by_size(2, read(&optimizer.moments.second)?, second),
    ])
}

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let allowed = Allowance::of(&raster.gpu);
    let samples = by_quantity(SHAPES.map(|shape| run(&raster.gpu, shape)))?;
    let row = |k: usize, what, seen| allowed.values("adam", what, seen, &samples[k]);
    Ok(vec![
        row(0, "values after 20 steps", [2.5e-7, 1.0]),
        row(1, "first moment, in gradients", [6.6e-8, 1.0]),
        row(2, "second moment, in squared gradients", [5.2e-7, 0.0]),
    ])
}
