//! `adam`: many steps over planes with different learning rates.

use std::sync::LazyLock;

use gs_chroma::{
    gpu::{Buffer, Recorder},
    optimize::{Adam, AdamKernel},
    raster::constants::*,
};

use crate::{
    compare::widen,
    errors::{Row, Sample, assert_all, relative},
    harness::{bits, gpu},
    oracle::{
        adam::{Moments, adam},
        random::Random,
    },
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
fn run([planes, count]: [usize; 2]) -> [Sample; 3] {
    let mut random = Random::new(planes as u64);
    let len = planes * count;
    let rates = rates(planes);
    let mut expected: Vec<f64> = (0..len).map(|_| random.range(-2.0, 2.0)).collect();
    let start: Vec<f32> = expected.iter().map(|&v| v as f32).collect();
    let mut moments = vec![
        Moments {
            first: 0.0,
            second: 0.0
        };
        len
    ];

    let kernel = AdamKernel::new(gpu());
    let values = Buffer::from_slice(gpu(), "values", &start).unwrap();
    let slope = Buffer::zeros(gpu(), "gradient", len).unwrap();
    let status = Buffer::zeros(gpu(), "status", STATUS_WORDS).unwrap();
    let state = Adam::new(gpu(), &kernel, &status, &slope, &values, count, None).unwrap();
    for step in 1..=STEPS {
        let gradient = gradient(&mut random, len);
        slope.write(gpu(), &gradient);
        let mut recorder = Recorder::new(gpu());
        state.record(gpu(), &kernel, &mut recorder, step, &rates);
        recorder.submit();
        for (k, (value, moments)) in expected.iter_mut().zip(&mut moments).enumerate() {
            let rate = f64::from(rates[k / count]);
            adam(value, moments, f64::from(gradient[k]), rate, step as i32);
        }
    }
    let read = |buffer: &Buffer<f32>| widen(&buffer.read(gpu()).unwrap());
    let (first, second) = moments.iter().map(|m| (m.first, m.second)).unzip();
    // In units of the gradient, or of its square.
    let by_size = |power: i32, actual: Vec<f64>, expected: Vec<f64>| {
        let scaled = |values: Vec<f64>| -> Vec<f64> {
            let values = values.into_iter().enumerate();
            values.map(|(k, v)| v / size(k).powi(power)).collect()
        };
        Sample::new(scaled(actual), scaled(expected))
    };
    [
        Sample::new(read(&values), expected),
        by_size(1, read(&state.first), first),
        by_size(2, read(&state.second), second),
    ]
}

pub static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| {
    let mut samples: [Vec<Sample>; 3] = Default::default();
    for shape in SHAPES {
        for (list, sample) in samples.iter_mut().zip(run(shape)) {
            list.push(sample);
        }
    }
    let row = |k: usize, what, bound| Row::elementwise("adam", what, bound, &samples[k]);
    vec![
        row(0, "values after 20 steps", relative(2.5e-7, 1.0)),
        row(1, "first moment, in gradients", relative(6.6e-8, 1.0)),
        row(
            2,
            "second moment, in squared gradients",
            relative(5.2e-7, 0.0),
        ),
    ]
});

#[test]
fn steps_are_those_of_the_oracle() {
    assert_all(&ROWS);
}

#[test]
fn after_an_overflow_nothing_moves() {
    let kernel = AdamKernel::new(gpu());
    let values = Buffer::from_slice(gpu(), "values", &[1.0, 2.0]).unwrap();
    let slope = Buffer::from_slice(gpu(), "gradient", &[3.0, -4.0]).unwrap();
    let mut words = [0; STATUS_WORDS];
    words[STATUS_OVERFLOW] = 1;
    let status = Buffer::from_slice(gpu(), "status", &words).unwrap();
    let state = Adam::new(gpu(), &kernel, &status, &slope, &values, 2, None).unwrap();
    let mut recorder = Recorder::new(gpu());
    state.record(gpu(), &kernel, &mut recorder, 1, &[0.1]);
    recorder.submit();
    for (buffer, expected) in [
        (&values, [1.0, 2.0]),
        (&state.first, [0.0; 2]),
        (&state.second, [0.0; 2]),
    ] {
        assert_eq!(bits(&buffer.read(gpu()).unwrap()), bits(&expected));
    }
}

/// What is no number, or has no square, moves nothing and is counted.
#[test]
fn refused_gradients_are_counted() {
    let kernel = AdamKernel::new(gpu());
    let slopes = [3.0, f32::NAN, f32::INFINITY, -1e19, -4.0];
    let values = Buffer::from_slice(gpu(), "values", &[1.0; 5]).unwrap();
    let slope = Buffer::from_slice(gpu(), "gradient", &slopes).unwrap();
    let status = Buffer::from_slice(gpu(), "status", &[0; STATUS_WORDS]).unwrap();
    let state = Adam::new(gpu(), &kernel, &status, &slope, &values, 5, None).unwrap();
    let mut recorder = Recorder::new(gpu());
    state.record(gpu(), &kernel, &mut recorder, 1, &[0.1]);
    recorder.submit();
    assert_eq!(status.read(gpu()).unwrap()[STATUS_REFUSED], 3);
    let moved: Vec<_> = (values.read(gpu()).unwrap().iter())
        .map(|&v| v != 1.0)
        .collect();
    assert_eq!(moved, [true, false, false, false, true]);
    let second = state.second.read(gpu()).unwrap();
    assert!(second.iter().all(|v| v.is_finite()));
}
