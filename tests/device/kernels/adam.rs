//! `adam` where it must not step.

use gs_chroma::{
    gpu::{Buffer, Recorder},
    raster::constants::*,
    raster::{Adam, AdamKernel},
};

use crate::kernels::harness::{bits, gpu};

#[test]
fn after_an_overflow_nothing_moves() {
    let kernel = AdamKernel::new(gpu());
    let values = Buffer::from_slice(gpu(), "values", &[1.0, 2.0]).unwrap();
    let slope = Buffer::from_slice(gpu(), "gradient", &[3.0, -4.0]).unwrap();
    let mut words = [0; STATUS_WORDS];
    words[STATUS_OVERFLOW] = 1;
    let status = Buffer::from_slice(gpu(), "status", &words).unwrap();
    let adam = Adam::new(gpu(), &kernel, &status, &slope, &values, 2).unwrap();
    let mut recorder = Recorder::new(gpu());
    adam.record(gpu(), &kernel, &mut recorder, 1, &[0.1]);
    recorder.submit();
    for (buffer, expected) in [
        (&values, [1.0, 2.0]),
        (&adam.moments.first, [0.0; 2]),
        (&adam.moments.second, [0.0; 2]),
    ] {
        assert_eq!(bits(&buffer.read(gpu()).unwrap()), bits(&expected));
    }
}

/// Gradients that are not a number, or have no finite square, are not applied and are counted.
#[test]
fn refused_gradients_are_counted() {
    let kernel = AdamKernel::new(gpu());
    let slopes = [3.0, f32::NAN, f32::INFINITY, -1e19, -4.0];
    let values = Buffer::from_slice(gpu(), "values", &[1.0; 5]).unwrap();
    let slope = Buffer::from_slice(gpu(), "gradient", &slopes).unwrap();
    let status = Buffer::from_slice(gpu(), "status", &[0; STATUS_WORDS]).unwrap();
    let adam = Adam::new(gpu(), &kernel, &status, &slope, &values, 5).unwrap();
    let mut recorder = Recorder::new(gpu());
    adam.record(gpu(), &kernel, &mut recorder, 1, &[0.1]);
    recorder.submit();
    assert_eq!(status.read(gpu()).unwrap()[STATUS_REFUSED], 3);
    let moved: Vec<_> = (values.read(gpu()).unwrap().iter())
        .map(|&v| v != 1.0)
        .collect();
    assert_eq!(moved, [true, false, false, false, true]);
    let second = adam.moments.second.read(gpu()).unwrap();
    assert!(second.iter().all(|v| v.is_finite()));
}
