//! `luma_loss`, `luma_loss_backward` and `sum_loss`.

use std::sync::Arc;

use crate::{
    compare::widen,
    doctor::measured::{Allowance, Row, Sample},
    gpu::{Buffer, Gpu, GpuError, Kernel, Recorder, shaders},
    optimize::{LossLog, SumLossKernel},
    oracle::{
        luma_loss::{luma_loss, luma_loss_gradient},
        random::Random,
    },
    raster::{Raster, ViewUniform, constants::STATUS_WORDS},
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

/// Where the variances in SSIM cancel most.
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

fn luma_on_device(
    gpu: &Gpu,
    size: [usize; 2],
    image: &[f32],
    photo: &[u8],
) -> Result<(f64, Vec<f32>), GpuError> {
    let pixels = image.len();
    let mut words = vec![0_u32; pixels.div_ceil(4)];
    for (p, &gray) in photo.iter().enumerate() {
        words[p / 4] |= u32::from(gray) << (8 * (p % 4));
    }
    let kernel = |name| Kernel::new(gpu, name, shaders::LUMA_LOSS);
    let (forward, backward) = (kernel("luma_loss"), kernel("luma_loss_backward"));
    let view = view(gpu, size)?;
    let image = Buffer::from_slice(gpu, "image", image)?;
    let photo = Buffer::from_slice(gpu, "photo", &words)?;
    let slopes = || Buffer::<f32>::zeros(gpu, "slopes", pixels);
    let slopes = [slopes()?, slopes()?, slopes()?];
    let gradient = Buffer::<f32>::zeros(gpu, "gradient", pixels)?;
    let [by_mean, by_square, by_product] = slopes.each_ref().map(Buffer::raw);
    let inputs = [
        view.raw(),
        image.raw(),
        photo.raw(),
        by_mean,
        by_square,
        by_product,
    ];
    let [x, y] = size.map(|side| side.div_ceil(16) as u32);
    let loss = logged(gpu, size, (x * y) as usize, |recorder, block_losses| {
        let mut numbered: Vec<_> = (0..).zip(inputs).collect();
        numbered.push((6, block_losses.raw()));
        recorder.dispatch_grid(&forward, &forward.bind_at(gpu, &numbered), x, y);
        numbered[6] = (7, gradient.raw());
        recorder.dispatch_grid(&backward, &backward.bind_at(gpu, &numbered), x, y);
    })?;
    Ok((loss, gradient.read(gpu)?))
}

fn luma(gpu: &Gpu, tones: &[Tone]) -> Result<[Vec<Sample>; 2], GpuError> {
    let (mut values, mut gradients) = (Vec::new(), Vec::new());
    for (k, size) in SIZES.into_iter().enumerate() {
        for &tone in tones {
            let [width, height] = size;
            let (image, photo) = luma_images(k as u64, width * height, tone);
            let (loss, gradient) = luma_on_device(gpu, size, &image, &photo)?;
            let x = widen(&image);
            let y: Vec<f64> = photo.iter().map(|&gray| f64::from(gray) / 255.0).collect();
            values.push(Sample::new(
                vec![loss],
                vec![luma_loss(&x, &y, width, height)],
            ));
            // By pixel, not by image: sizes are comparable.
            let scale = (width * height) as f64;
            let scaled = |values: Vec<f64>| values.into_iter().map(|v| v * scale).collect();
            let expected = luma_loss_gradient(&x, &y, width, height);
            gradients.push(Sample::new(scaled(widen(&gradient)), scaled(expected)));
        }
    }
    Ok([values, gradients])
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

/// Values and gradients (by pixel) of constant pictures.
fn constant(gpu: &Gpu) -> Result<[Vec<Sample>; 2], GpuError> {
    let size @ [width, height] = [17, 33];
    let pixels = width * height;
    let (mut values, mut gradients) = (Vec::new(), Vec::new());
    for (picture, photo) in CONSTANT {
        let (image, photos) = (vec![picture; pixels], vec![photo; pixels]);
        let (loss, gradient) = luma_on_device(gpu, size, &image, &photos)?;
        let x = vec![f64::from(picture); pixels];
        let y = vec![f64::from(photo) / 255.0; pixels];
        let by_pixel = |values: Vec<f64>| values.iter().map(|v| v * pixels as f64).collect();
        let expected = luma_loss_gradient(&x, &y, width, height);
        let loss_expected = luma_loss(&x, &y, width, height);
        values.push(Sample::new(vec![loss], vec![loss_expected]));
        gradients.push(Sample::new(by_pixel(widen(&gradient)), by_pixel(expected)));
    }
    Ok([values, gradients])
}

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let gpu = &raster.gpu;
    let allowed = Allowance::of(gpu);
    let value = |kernel, what, worst, samples: &[Sample]| {
        Row::elementwise(kernel, what, allowed.relative(worst, 0.0), samples)
    };
    let gradient = |kernel, what, l2, worst, samples: &[Sample]| {
        Row::gradient(
            kernel,
            what,
            allowed.gradient(l2, allowed.relative(worst, 1.0)),
            samples,
        )
    };
    let [luma_values, luma_gradients] = luma(gpu, &TONES)?;
    let [flat_values, flat_gradients] = luma(gpu, &BRIGHT_AND_FLAT)?;
    let [constant_values, constant_gradients] = constant(gpu)?;
    Ok(vec![
        value("luma_loss", "value", 2.86e-7, &luma_values),
        gradient(
            "luma_loss",
            "gradient × pixels",
            1.04e-6,
            6.18e-6,
            &luma_gradients,
        ),
        value("luma_loss", "value, bright and flat", 4.95e-4, &flat_values),
        gradient(
            "luma_loss",
            "gradient × pixels, bright and flat",
            5.94e-5,
            1.93e-4,
            &flat_gradients,
        ),
        Row::elementwise(
            "luma_loss",
            "value, constant pictures",
            allowed.relative(4.2e-7, 1.0),
            &constant_values,
        ),
        Row::elementwise(
            "luma_loss",
            "gradient × pixels, constant pictures",
            allowed.relative(1.38e-4, 1.0),
            &constant_gradients,
        ),
    ])
}
