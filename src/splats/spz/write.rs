//! Writing.

use std::io::Write;

use flate2::{Compression, write::GzEncoder};

use super::*;
use crate::splats::{
    SplatError, Splats, WriteOptions,
    quantize::{level, opacity_byte, smallest_three},
    shared::{FormatFidelity, middle},
};

/// Version of the files: more programs read it than 4, which is smaller by a few percent.
const VERSION: u32 = 3;

/// Most fractional bits that are written: readers shift a signed 32-bit 1 by them.
const MOST_BITS: u32 = 30;

/// Steps of a center in the middle scale of a small Gaussian: by them alone pictures of the
/// bundled garden differ by 70 dB, while all else leaves 52, and a bit more takes 0.3 bytes.
const STEPS_IN_SMALL: f64 = 256.0;

/// The share of the Gaussians that are smaller than a small one.
const SMALLER: f64 = 0.1;

/// The largest 24-bit number.
const LARGEST: f64 = 8_388_607.0;

/// The bytes of a file.
///
/// # Errors
/// [`SplatError`] where centers are too far apart for 24 bits, or Gaussians too many.
pub(in crate::splats) fn encode(
    splats: &Splats,
    options: &WriteOptions,
    fidelity: &mut FormatFidelity<'_>,
) -> Result<Vec<u8>, SplatError> {
    let degree = splats.sh.degree;
    let count = u32::try_from(splats.len()).map_err(|_| SplatError::NotWritten {
        path: fidelity.path.to_owned(),
        reason: format!("{} Gaussians are more than 2³²", splats.len()),
    })?;
    let farthest = (splats.means.as_flattened().iter()).fold(0.0_f64, |farthest, &value| {
        farthest.max(f64::from(value).abs())
    });
    let most = (LARGEST / farthest).log2().floor();
    let enough = (STEPS_IN_SMALL / small(splats)).log2().ceil();
    // None that are negative: then the scene is spoiled, which is found out next.
    let bits = enough.min(most).clamp(0.0, MOST_BITS.into()) as u32;
    let unit = f64::from(1_u32 << bits);
    let step = match farthest * unit > LARGEST {
        true => f64::INFINITY,
        false => 1.0 / unit,
    };
    fidelity.steps(|_| step)?;
    let log_scale = |byte: f64| (byte / SCALE_STEPS + LOWEST_SCALE) as f32;
    fidelity.log_scales([log_scale(-0.5), log_scale(255.5)]);
    let color = (0.5 / COLOR_SCALE) as f32;
    fidelity.harmonics(true, [-color, color]);
    fidelity.harmonics(false, [-1.0, 1.0]);

    let mut parts: [Vec<u8>; 6] = Default::default();
    for index in 0..splats.len() {
        for value in splats.means[index] {
            let fixed = (f64::from(value) * unit).round() as i32;
            parts[0].extend(&fixed.to_le_bytes()[..3]);
        }
        parts[1].push(opacity_byte(splats.opacity_logits[index]));
        let (constant, above) = splats.sh.of(index).split_at(CHANNELS);
        parts[2].extend((constant.iter()).map(|&value| {
            let share = f64::from(value) * COLOR_SCALE + 0.5;
            level(share, 255) as u8
        }));
        parts[3].extend(splats.log_scales[index].map(|value| {
            // Saturates.
            ((f64::from(value) - LOWEST_SCALE) * SCALE_STEPS).round() as u8
        }));
        parts[4].extend(rotation(splats.quats[index]).to_le_bytes());
        parts[5].extend(above.iter().map(|&value| {
            // Saturates.
            (f64::from(value) * SH_LEVELS + SH_LEVELS).round() as u8
        }));
    }

    let mut header = MAGIC.to_vec();
    header.extend(VERSION.to_le_bytes());
    header.extend(count.to_le_bytes());
    let flags = if options.antialiased { ANTIALIASED } else { 0 };
    header.extend([degree as u8, bits as u8, flags, 0]);
    gzip(&header, &parts).map_err(SplatError::io(fidelity.path))
}

/// The middle scale of a small Gaussian, in world units.
fn small(splats: &Splats) -> f64 {
    let middles = splats.log_scales.iter().map(|&scales| middle(scales));
    let mut middles: Vec<f32> = middles.collect();
    if middles.is_empty() {
        return 1.0;
    }
    let place = (middles.len() as f64 * SMALLER) as usize;
    f64::from(*middles.select_nth_unstable_by(place, f32::total_cmp).1).exp()
}

fn gzip(header: &[u8], parts: &[Vec<u8>]) -> std::io::Result<Vec<u8>> {
    let mut stream = GzEncoder::new(Vec::new(), Compression::best());
    stream.write_all(header)?;
    for part in parts {
        stream.write_all(part)?;
    }
    stream.finish()
}

fn rotation([w, x, y, z]: [f32; 4]) -> u32 {
    let (largest, small) = smallest_three([x, y, z, w]);
    small.iter().fold(largest as u32, |word, &value| {
        let sign = u32::from(value < 0.0);
        word << 10 | sign << 9 | level(value.abs(), ROTATION_LEVELS)
    })
}
