//! `view_correction_sums` and `view_correction`.

use std::sync::Arc;

use super::{chroma_loss::in_steps, losses::view};
use crate::{
    chroma::{Correction, CorrectionKernels, Corrections, pack_ab},
    compare::narrow,
    doctor::measured::{Allowance, Row, Sample, by_quantity},
    gpu::{Buffer, Gpu, GpuError, Recorder},
    oracle::{
        random::{Random, round},
        view_correction::{Pixel, view_corrections},
    },
    raster::Raster,
};

/// One view's pixels.
struct TestView {
    size: [usize; 2],
    /// Weight (the mean over both channels), rendered and taught a/b.
    pixels: Vec<Pixel>,
    /// Weight of each pixel, unless all are alike.
    weights: Option<Vec<f64>>,
}

impl TestView {
    /// Colors of this spread about a mean, and a teacher that strays from them by gain,
    /// offset and noise.
    fn random(random: &mut Random, size: [usize; 2], spread: f64) -> Self {
        let center: [f64; 2] = random.array(-40.0, 40.0);
        let gain: [f64; 2] = random.array(0.6, 1.3);
        let (turn, offset) = (random.range(-0.2, 0.2), random.array::<2>(-8.0, 8.0));
        let pixels = (0..size[0] * size[1])
            .map(|k| {
                let x: [f64; 2] = random.array(-spread, spread);
                // Here and there nothing is drawn.
                let drawn = f64::from(u8::from(k % 11 != 3));
                let x = [0, 1].map(|c| drawn * round(x[c] + center[c]));
                let noise: [f64; 2] = random.array(-4.0, 4.0);
                let t = [0, 1]
                    .map(|c| in_steps(gain[c] * x[c] + turn * x[1 - c] + offset[c] + noise[c]));
                (random.range(1e-5, 1e-3), x, t)
            })
            .collect();
        Self {
            size,
            pixels,
            weights: None,
        }
    }

    /// Some pixels are unknown, some painted.
    fn weighed(mut self) -> Self {
        let weights = (0..self.pixels.len()).map(|p| [1.0, 0.5, 50.0, 0.0, 1.0][p % 5]);
        self.weights = Some(weights.collect());
        self
    }

    fn with_pixels(mut self, change: impl Fn(&mut Pixel)) -> Self {
        self.pixels.iter_mut().for_each(change);
        self
    }

    /// The pixels that the teacher colored.
    fn counted(&self) -> Vec<Pixel> {
        let weight = |p: usize| self.weights.as_ref().map_or(1.0, |weights| weights[p]);
        (self.pixels.iter().enumerate())
            .filter(|&(p, _)| weight(p) > 0.0 && weight(p) <= 1.0)
            .map(|(_, &pixel)| pixel)
            .collect()
    }
}

fn on_device(gpu: &Gpu, views: &[TestView]) -> Result<Vec<Correction>, GpuError> {
    let kernels = CorrectionKernels::new(gpu);
    let corrections = Corrections::new(gpu, &kernels, views.len())?;
    let buffer = |values: &[f64]| Buffer::from_slice(gpu, "pixels", &narrow(values));
    for (index, taught) in views.iter().enumerate() {
        let view = view(gpu, taught.size)?;
        let pixels = || taught.pixels.iter();
        // The channels differ; their mean is the weight.
        let curvatures = pixels().flat_map(|p| [[7.0, -7.0], [1.5 * p.0, 0.5 * p.0]]);
        let left = buffer(curvatures.collect::<Vec<_>>().as_flattened())?;
        let image = buffer(pixels().map(|p| p.1).collect::<Vec<_>>().as_flattened())?;
        let wanted: Vec<u32> = pixels().map(|p| pack_ab(p.2.map(|v| v as f32))).collect();
        let wanted = Buffer::from_slice(gpu, "wanted", &wanted)?;
        let weights = buffer(taught.weights.as_deref().unwrap_or(&[0.0]))?;
        let parameters = corrections.parameters(gpu, index, taught.weights.is_some())?;
        let inputs = [view.raw(), image.raw(), wanted.raw()];
        let bindings = corrections.bind(gpu, &kernels, &parameters, (inputs, &left, &weights));
        let mut recorder = Recorder::new(gpu);
        corrections.sum(&kernels, &bindings, &mut recorder);
        recorder.submit();
    }
    let mut recorder = Recorder::new(gpu);
    corrections.solve(&kernels, &mut recorder);
    recorder.submit();
    corrections.corrections.read(gpu)
}

/// Gains and offsets of each set of views.
fn measure(gpu: &Gpu, sets: &[Vec<TestView>]) -> Result<[Vec<Sample>; 2], GpuError> {
    by_quantity(sets.iter().map(|views| {
        let actual = on_device(gpu, views)?;
        let pixels: Vec<_> = views.iter().map(TestView::counted).collect();
        let expected = view_corrections(&pixels);
        let gains = actual.iter().flat_map(|c| c.gain).flatten();
        let expected_gains = expected.iter().flat_map(|c| c.gain).flatten();
        let offsets = actual.iter().flat_map(|c| c.offset);
        let expected_offsets = expected.iter().flat_map(|c| c.offset);
        Ok([
            Sample::new(gains.map(f64::from).collect(), expected_gains.collect()),
            Sample::new(offsets.map(f64::from).collect(), expected_offsets.collect()),
        ])
    }))
}

/// Sets of views as captures have them.
fn ordinary(random: &mut Random) -> Vec<Vec<TestView>> {
    let mut view = |size, spread| TestView::random(random, size, spread);
    vec![
        // More pixels than the workgroups of a view take at once; some to leave out.
        vec![
            view([190, 110], 30.0),
            view([61, 48], 20.0).weighed(),
            view([17, 33], 50.0),
            view([40, 27], 10.0).weighed(),
        ],
        // More views than a workgroup has threads.
        (0..300).map(|_| view([9, 7], 30.0)).collect(),
    ]
}

/// Views that say little or nothing.
fn hard(random: &mut Random) -> Vec<Vec<TestView>> {
    let mut view = |spread| TestView::random(random, [21, 16], spread);
    vec![
        // One view: its mean is all there is, and nothing is corrected.
        vec![view(30.0)],
        // No weight in one of them, nor anywhere.
        vec![
            view(30.0),
            view(30.0).with_pixels(|p| p.0 = 0.0),
            view(20.0),
        ],
        vec![view(30.0).with_pixels(|p| p.0 = 0.0)],
        // A picture of one color: no variance, far from the origin.
        vec![
            view(30.0),
            view(0.0).with_pixels(|p| p.1 = [59.0, -43.0]),
            view(0.0).with_pixels(|p| (p.1, p.2) = ([0.0; 2], [0.0; 2])),
        ],
        // Both channels the same: no variance across.
        vec![view(30.0), view(30.0).with_pixels(|p| p.1[1] = p.1[0])],
        // A teacher without color, whose gain cannot be undone.
        vec![
            view(60.0),
            view(60.0),
            view(60.0).with_pixels(|p| p.2 = [0.0; 2]),
        ],
        // Weights as small and as large as they come.
        vec![
            view(30.0).with_pixels(|p| p.0 = round(p.0 * 1e-12)),
            view(30.0).with_pixels(|p| p.0 = round(p.0 * 1e9)),
        ],
    ]
}

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let (gpu, allowed) = (&raster.gpu, Allowance::of(&raster.gpu));
    let mut random = Random::new(11);
    let [gains, offsets] = measure(gpu, &ordinary(&mut random))?;
    let [hard_gains, hard_offsets] = measure(gpu, &hard(&mut random))?;
    let row = |what, worst, samples: &[Sample]| {
        allowed.values("view_correction", what, [worst, 1.0], samples)
    };
    Ok(vec![
        row("gain", 1.20e-6, &gains),
        row("offset, in CIELAB units", 3.54e-5, &offsets),
        row("gain, views that say little", 9.42e-5, &hard_gains),
        row("offset, views that say little", 3.57e-4, &hard_offsets),
    ])
}
