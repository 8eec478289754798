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

/// Values of every size that gradients have, and exact zeros.
fn gradient(random: &mut Random, len: usize) -> Vec<f32> {
    (0..len)
        .map(|i| {
            let size = 10_f64.powi((i % 13) as i32 - 10);
            if i % 29 == 0 {
                0.0
            } else {
                (random.range(-1.0, 1.0) * size) as f32
            }
        })
        .collect()
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
    [
        Sample::new(read(&values), expected),
        Sample::new(
            read(&state.first),
            moments.iter().map(|m| m.first).collect(),
        ),
        Sample::new(
            read(&state.second),
            moments.iter().map(|m| m.second).collect(),
        ),
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
        row(0, "values after 20 steps", relative(1e-9, 1.0)),
        row(1, "first moment", relative(1e-9, 1e-9)),
        row(2, "second moment", relative(1e-9, 1e-18)),
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
