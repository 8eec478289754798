//! From a file's values to 8-bit pixels.

use super::decode::DecodedImage;
use super::options::{Channel, Encoding, LoadOptions, Normalize};
use super::photo::{Pixels, Values};
use super::sample::{Depth, Header, Samples};
use crate::color::{gray_from_rgb, linear_to_srgb};

/// A photo's pixels, encoded sRGB of 8 bits. Those with a value that is not finite
/// count nothing and are black.
///
/// `options.normalize` must be decided; `Auto` is taken for `Off`.
pub(super) fn develop(picture: DecodedImage, options: &LoadOptions) -> Pixels {
    let DecodedImage {
        header, samples, ..
    } = picture;
    let mask = finite(&samples, header.channels, options.channel);
    let levels = Tone::of(header.depth, options.normalize, options).levels(&samples);
    drop(samples);
    let rgb = |step| levels.chunks_exact(step).map(|p| [p[0], p[1], p[2]]);
    let values = match (header.channels, options.channel) {
        (1, _) => Values::Gray(levels.as_chunks().0.to_vec()),
        (2, _) => Values::Gray(levels.chunks_exact(2).map(|p| [p[0]]).collect()),
        (step, Channel::Luma) if rgb(step).all(|[r, g, b]| r == g && g == b) => {
            Values::Gray(rgb(step).map(|[gray, ..]| [gray]).collect())
        }
        (step, Channel::Luma) => Values::Rgb(rgb(step).collect()),
        // The other channels are of another light; together they are no color.
        (step, channel) => {
            let at = channel.samples().start;
            Values::Gray(levels.chunks_exact(step).map(|p| [p[at]]).collect())
        }
    };
    let [width, height] = header.size;
    Pixels {
        width,
        height,
        values,
        mask,
    }
}

/// A photo's gray in 65,535ths of white, encoded sRGB, as [`develop`] has it, but with its own
/// range.
pub(super) fn gray(picture: &DecodedImage, range: Normalize, options: &LoadOptions) -> Vec<u16> {
    let DecodedImage {
        header, samples, ..
    } = picture;
    let shares = Tone::of(header.depth, range, options).shares(samples);
    let level = |share: f64| (f64::from(u16::MAX) * share).round() as u16;
    let pixels = shares.chunks_exact(header.channels);
    match (header.channels, options.channel) {
        (1 | 2, _) => pixels.map(|pixel| level(pixel[0].into())).collect(),
        (_, Channel::Luma) => pixels
            .map(|pixel| match *pixel {
                [r, g, b, ..] if r == g && g == b => level(r.into()),
                [r, g, b, ..] => level(gray_from_rgb([r, g, b].map(f64::from))),
                _ => 0,
            })
            .collect(),
        (_, channel) => {
            let at = channel.samples().start;
            pixels.map(|pixel| level(pixel[at].into())).collect()
        }
    }
}

/// The least and the greatest value in use that is finite, in the file's unit; `None` where there
/// is but one.
pub(super) fn extremes(picture: &DecodedImage, channel: Channel) -> Option<[f64; 2]> {
    let Header { size, channels, .. } = picture.header;
    let pixels = 0..size[0] as usize * size[1] as usize;
    let used = used(channels, channel);
    let [low, high] = pixels
        .flat_map(|pixel| used.clone().map(move |c| pixel * channels + c))
        .map(|i| value(&picture.samples, i))
        .filter(|v| v.is_finite())
        .fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], v| {
            [low.min(v), high.max(v)]
        });
    (low < high).then(|| [low, high].map(f64::from))
}

/// 255 where all values in use are finite, else 0; `None` where they are everywhere.
pub(super) fn finite(samples: &Samples, channels: usize, channel: Channel) -> Option<Vec<u8>> {
    let Samples::Float(values) = samples else {
        return None;
    };
    let used = used(channels, channel);
    if values.iter().all(|v| v.is_finite()) {
        return None;
    }
    let mask: Vec<u8> = values
        .chunks_exact(channels)
        .map(
            |pixel| match pixel[used.clone()].iter().all(|v| v.is_finite()) {
                true => u8::MAX,
                false => 0,
            },
        )
        .collect();
    mask.contains(&0).then_some(mask)
}

/// Weight of each pixel by its transparency, 0 to 255; `None` if all are opaque.
pub(super) fn alpha(picture: &DecodedImage) -> Option<Vec<u8>> {
    let channels = picture.header.channels;
    if !picture.header.has_alpha() {
        return None;
    }
    let at = |i: usize| match &picture.samples {
        Samples::Eight(values) => values[i],
        Samples::Sixteen(values) => ((u32::from(values[i]) + 128) / 257) as u8,
        // Not a number counts nothing.
        Samples::Float(values) => (255.0 * values[i].clamp(0.0, 1.0)).round() as u8,
    };
    let [width, height] = picture.header.size.map(|side| side as usize);
    let pixels = 0..width * height;
    let mask: Vec<u8> = pixels.map(|pixel| at((pixel + 1) * channels - 1)).collect();
    mask.iter().any(|&count| count < u8::MAX).then_some(mask)
}

/// The samples of a pixel of so many channels that say something.
fn used(channels: usize, channel: Channel) -> std::ops::Range<usize> {
    if channels < 3 {
        0..1
    } else {
        channel.samples()
    }
}

/// Values of pixels on an even grid of at most about `most`, in the file's unit: of a
/// color photo those of every channel in use. Values that are not finite and pixels
/// that count nothing are left out.
pub(super) fn sample(
    picture: &DecodedImage,
    mask: Option<&[u8]>,
    channel: Channel,
    most: usize,
) -> Vec<f32> {
    let Header {
        size: [width, height],
        channels,
        ..
    } = picture.header;
    let (width, height) = (width as usize, height as usize);
    let step = (((width * height) as f64 / most as f64).sqrt().ceil() as usize).max(1);
    let used = used(channels, channel);
    // From the middle of the steps, so that no border is preferred; small photos have no middle.
    let along = |length: usize| (step / 2).min(length.saturating_sub(1));
    (along(height)..height)
        .step_by(step)
        .flat_map(|y| {
            (along(width)..width)
                .step_by(step)
                .map(move |x| y * width + x)
        })
        .filter(|&pixel| mask.is_none_or(|mask| mask[pixel] > 0))
        .flat_map(|pixel| used.clone().map(move |c| pixel * channels + c))
        .map(|i| value(&picture.samples, i))
        .filter(|v| v.is_finite())
        .collect()
}

/// A sample in the file's unit.
fn value(samples: &Samples, i: usize) -> f32 {
    match samples {
        Samples::Eight(values) => f32::from(values[i]),
        Samples::Sixteen(values) => f32::from(values[i]),
        Samples::Float(values) => values[i],
    }
}

/// Tone curve from a file's value to an encoded one.
struct Tone {
    low: f64,
    high: f64,
    linear: bool,
}

impl Tone {
    fn of(depth: Depth, range: Normalize, options: &LoadOptions) -> Self {
        let [low, high] = match range {
            Normalize::Range(range) => range,
            Normalize::Auto | Normalize::Off => [0.0, depth.white()],
        };
        Self {
            low,
            high,
            linear: match options.encoding {
                Encoding::Auto => depth == Depth::Float,
                Encoding::Srgb => false,
                Encoding::Linear => true,
            },
        }
    }

    /// The encoded value, 0 to 1. NaN stays NaN.
    fn share(&self, value: f64) -> f64 {
        let share = ((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0);
        if self.linear {
            linear_to_srgb(share)
        } else {
            share
        }
    }

    /// Result of `of` for every sample's encoded value, by a table where there are few values.
    fn all<T: Copy>(&self, samples: &Samples, of: impl Fn(f64) -> T) -> Vec<T> {
        let one = |value: f64| of(self.share(value));
        let table = |count: u32| (0..count).map(|v| one(v.into())).collect::<Vec<T>>();
        match samples {
            Samples::Eight(values) => {
                let table = table(1 << 8);
                values.iter().map(|&v| table[usize::from(v)]).collect()
            }
            Samples::Sixteen(values) => {
                let table = table(1 << 16);
                values.iter().map(|&v| table[usize::from(v)]).collect()
            }
            Samples::Float(values) => values.iter().map(|&v| one(v.into())).collect(),
        }
    }

    /// [`Self::share`] of every sample, 0 for NaN.
    fn shares(&self, samples: &Samples) -> Vec<f32> {
        self.all(
            samples,
            |share| if share.is_nan() { 0.0 } else { share as f32 },
        )
    }

    /// The encoded level of every sample. NaN is black.
    fn levels(&self, samples: &Samples) -> Vec<u8> {
        self.all(samples, |share| (255.0 * share).round() as u8)
    }
}
