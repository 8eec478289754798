//! `luma_loss` with each of its effects, `luma_loss_backward` and `sum_loss`.

use std::sync::Arc;

use crate::{
    capture::Exposure,
    compare::widen,
    doctor::measured::{Allowance, Row, Sample, by_quantity},
    gpu::{Buffer, Gpu, GpuError, Kernel, Recorder},
    luma::{LossEffects, LumaLossParameters, SsimWindow},
    oracle::{
        luma_loss::{LumaEffects, luma_loss, luma_loss_gradient},
        random::Random,
    },
    raster::{LossLog, Raster, SumLossKernel, ViewUniform, constants::STATUS_WORDS},
};

/// Blocks cut short on either side, images smaller than the window, whole blocks.
pub(super) const SIZES: [[usize; 2]; 6] = [[5, 3], [1, 1], [16, 16], [17, 33], [40, 27], [61, 48]];

/// Adds up what a loss kernel left; `record` runs it.
pub(super) fn logged(
    gpu: &Gpu,
    sizes: [usize; 2],
    blocks: usize,
    record: impl FnOnce(&mut Recorder, &Buffer<f32>),
) -> Result<f64, GpuError> {
    let kernel = SumLossKernel::new(gpu);
    let status = Buffer::zeros(gpu, "status", STATUS_WORDS)?;
    let log = LossLog::new(gpu, &kernel, &status, blocks, 3)?;
    let mut recorder = Recorder::new(gpu);
    record(&mut recorder, &log.block_losses);
    // Iteration 7 of a ring of three stands at 1.
    let pixels = sizes[0] * sizes[1];
    log.record(gpu, &kernel, &mut recorder, blocks as u32, pixels, 7);
    recorder.submit();
    Ok(f64::from(log.read_later(gpu).wait(gpu)?[1]))
}

/// A view of which nothing but the size matters.
pub(super) fn view(gpu: &Gpu, size: [usize; 2]) -> Result<Buffer<ViewUniform>, GpuError> {
    let size = size.map(|side| side as u32);
    let uniform = ViewUniform {
        size,
        ..ViewUniform::default()
    };
    Buffer::uniform(gpu, "view", &uniform)
}

/// Gray level and how far pixels stray from it.
type Tone = (f64, f64);

const TONES: [Tone; 2] = [(0.5, 0.5), (0.4, 0.1)];

/// Tones at which the variances in SSIM cancel most.
const BRIGHT_AND_FLAT: [Tone; 1] = [(0.97, 0.005)];

/// A picture and a photo.
fn luma_images(seed: u64, pixels: usize, (level, spread): Tone) -> (Vec<f32>, Vec<u8>) {
    let mut random = Random::new(seed);
    let mut photo = Vec::new();
    let mut image = Vec::new();
    for _ in 0..pixels {
        let value = level + random.range(-spread, spread);
        photo.push((value * 255.0) as u8);
        image.push((value + random.range(-spread, spread)) as f32);
    }
    (image, photo)
}

/// A picture against a photo, with the effects that a test turns on.
struct Comparison {
    size: [usize; 2],
    image: Vec<f32>,
    photo: Vec<u8>,
    exposure: Option<Exposure>,
    mask: Option<Vec<u8>>,
    window: SsimWindow,
}

impl Comparison {
    /// A comparison without effects.
    fn plain(size: [usize; 2], (image, photo): (Vec<f32>, Vec<u8>)) -> Self {
        Self {
            size,
            image,
            photo,
            exposure: None,
            mask: None,
            window: SsimWindow::Eleven,
        }
    }

    /// Value and gradient by the device.
    fn on_device(&self, gpu: &Gpu) -> Result<(f64, Vec<f32>), GpuError> {
        let effects = LossEffects {
            exposed: self.exposure.is_some(),
            masked: self.mask.is_some(),
        };
        let kernel = |name| Kernel::new(gpu, name, effects.shader(self.window));
        let (forward, backward) = (kernel("luma_loss"), kernel("luma_loss_backward"));
        let bytes = |label, bytes: &[u8]| {
            let mut words = vec![0_u32; bytes.len().div_ceil(4)];
            for (p, &byte) in bytes.iter().enumerate() {
                words[p / 4] |= u32::from(byte) << (8 * (p % 4));
            }
            Buffer::from_slice(gpu, label, &words)
        };
        let pixels = self.image.len();
        let view = view(gpu, self.size)?;
        let image = Buffer::from_slice(gpu, "image", &self.image)?;
        let photo = bytes("photo", &self.photo)?;
        let slopes = || Buffer::<f32>::zeros(gpu, "slopes", pixels);
        let slopes = [slopes()?, slopes()?, slopes()?];
        let gradient = Buffer::<f32>::zeros(gpu, "gradient", pixels)?;
        let mask = self.mask.as_deref().map(|mask| bytes("mask", mask));
        let mask = mask.transpose()?;
        let exposure = self.exposure.unwrap_or(Exposure::NONE);
        let parameters = LumaLossParameters::from(exposure);
        let parameters = Buffer::uniform(gpu, "loss parameters", &parameters)?;
        let [by_mean, by_square, by_product] = slopes.each_ref().map(Buffer::raw);
        let inputs = [
            view.raw(),
            image.raw(),
            photo.raw(),
            by_mean,
            by_square,
            by_product,
        ];
        let [x, y] = self.size.map(|side| side.div_ceil(16) as u32);
        let loss = logged(
            gpu,
            self.size,
            (x * y) as usize,
            |recorder, block_losses| {
                let mut numbered: Vec<_> = (0..).zip(inputs).collect();
                numbered.push((6, block_losses.raw()));
                numbered.extend(mask.as_ref().map(|mask| (8, mask.raw())));
                numbered.extend(effects.exposed.then(|| (9, parameters.raw())));
                recorder.dispatch_grid(&forward, &forward.bind_at(gpu, &numbered), x, y);
                numbered[6] = (7, gradient.raw());
                recorder.dispatch_grid(&backward, &backward.bind_at(gpu, &numbered), x, y);
            },
        )?;
        Ok((loss, gradient.read(gpu)?))
    }

    /// Value, and gradient times pixels, beside the oracle's: sizes are comparable then.
    fn samples(&self, gpu: &Gpu) -> Result<[Sample; 2], GpuError> {
        let (loss, gradient) = self.on_device(gpu)?;
        let [width, height] = self.size;
        let unit = |bytes: &[u8]| -> Vec<f64> {
            bytes.iter().map(|&byte| f64::from(byte) / 255.0).collect()
        };
        let mask = self.mask.as_deref().map(unit);
        let effects = LumaEffects {
            ssim_window: u32::from(self.window) as usize,
            exposure: self.exposure.map(|e| [e.gain, e.offset]),
            mask: mask.as_deref(),
        };
        let (x, y) = (widen(&self.image), unit(&self.photo));
        let scale = (width * height) as f64;
        let scaled = |values: Vec<f64>| values.into_iter().map(|v| v * scale).collect();
        let expected = luma_loss_gradient(&x, &y, width, height, &effects);
        let value = luma_loss(&x, &y, width, height, &effects);
        Ok([
            Sample::new(vec![loss], vec![value]),
            Sample::new(scaled(widen(&gradient)), scaled(expected)),
        ])
    }
}

/// Samples of values and of gradients.
fn sampled(
    gpu: &Gpu,
    comparisons: impl Iterator<Item = Comparison>,
) -> Result<[Vec<Sample>; 2], GpuError> {
    by_quantity(comparisons.map(|comparison| comparison.samples(gpu)))
}

fn random(tones: &[Tone]) -> impl Iterator<Item = Comparison> {
    (0..)
        .zip(SIZES)
        .flat_map(move |(k, size @ [width, height])| {
            (tones.iter())
                .map(move |&tone| Comparison::plain(size, luma_images(k, width * height, tone)))
        })
}

/// Random pictures with an exposure, a mask, and both: pixels
/// that count half, blocks that do not count at all, photos that the exposure clips.
fn with_effects(which: usize) -> impl Iterator<Item = Comparison> {
    // Every other size: the oracle takes its time.
    random(&TONES[..1]).step_by(2).map(move |mut comparison| {
        let mut random = Random::new(90);
        if which != 1 {
            comparison.exposure = Some(Exposure {
                gain: 1.3,
                offset: -0.12,
            });
        }
        if which != 0 {
            let [width, _] = comparison.size;
            let mask = (0..comparison.photo.len()).map(|p| match p % width {
                20..=33 => 0,
                column if column % 5 == 1 => random.range(0.0, 256.0) as u8,
                _ => 255,
            });
            comparison.mask = Some(mask.collect());
        }
        comparison
    })
}

/// Constant picture and photo: no variance at all, equal or as far apart as can
/// be, and pictures that no screen can show.
const CONSTANT: [(f32, u8); 7] = [
    (0.0, 0),
    (1.0, 255),
    (0.25, 128),
    (0.0, 255),
    (1.0, 0),
    (3.0, 0),
    (-2.0, 255),
];

fn constant() -> impl Iterator<Item = Comparison> {
    CONSTANT.into_iter().map(|(picture, photo)| {
        let (size, pixels) = ([17, 33], 17 * 33);
        Comparison::plain(size, (vec![picture; pixels], vec![photo; pixels]))
    })
}

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let (gpu, allowed) = (&raster.gpu, Allowance::of(&raster.gpu));
    // The worst errors seen of values, and of gradients as a whole and of an element.
    let both = |kind, [value, l2, worst]: [f64; 3], [values, gradients]: [Vec<Sample>; 2]| {
        let what = format!("gradient × pixels{kind}");
        [
            allowed.values("luma_loss", format!("value{kind}"), [value, 0.0], &values),
            allowed.gradients("luma_loss", what, [l2, worst, 1.0], &gradients),
        ]
    };
    let mut rows = Vec::new();
    rows.extend(both(
        "",
        [2.86e-7, 1.04e-6, 6.18e-6],
        sampled(gpu, random(&TONES))?,
    ));
    let flat = sampled(gpu, random(&BRIGHT_AND_FLAT))?;
    rows.extend(both(", bright and flat", [4.95e-4, 5.94e-5, 1.93e-4], flat));
    let constant = sampled(gpu, constant())?;
    for (what, worst, samples) in [
        ("value, constant pictures", 4.2e-7, &constant[0]),
        (
            "gradient × pixels, constant pictures",
            1.38e-4,
            &constant[1],
        ),
    ] {
        rows.push(allowed.values("luma_loss", what, [worst, 1.0], samples));
    }
    for (which, kind) in [", exposed", ", masked", ", both"].into_iter().enumerate() {
        let samples = sampled(gpu, with_effects(which))?;
        rows.extend(both(kind, [1e-6, 1e-6, 1e-5], samples));
    }
    let mut flat: [Vec<Sample>; 2] = Default::default();
    for (window, kind) in [
        (SsimWindow::Seven, ", 7 × 7"),
        (SsimWindow::Five, ", 5 × 5"),
    ] {
        let windowed = |comparison| Comparison {
            window,
            ..comparison
        };
        // Without effects, with an exposure, with a mask, with both.
        let effects = (0..3).flat_map(with_effects);
        let all = random(&TONES).chain(effects).map(windowed);
        rows.extend(both(kind, [1e-6, 1e-6, 1e-5], sampled(gpu, all)?));
        let samples = sampled(gpu, random(&BRIGHT_AND_FLAT).map(windowed))?;
        flat.iter_mut()
            .zip(samples)
            .for_each(|(all, more)| all.extend(more));
    }
    let kind = ", smaller windows, bright and flat";
    rows.extend(both(kind, [1.13e-3, 4.63e-5, 3.8e-4], flat));
    Ok(rows)
}
