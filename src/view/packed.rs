//! Gaussians as the page takes them: 28 bytes of geometry each, harmonics as halves, in arrays
//! that go to the browser's textures as they are. `assets/viewer/scene.js` reads it.
//!
//! A splat file would do, but is two times as large, and has to be taken apart number by number.

use half::f16;

use crate::{
    raster::RasterOptions,
    splats::{Splats, opacity, sh},
};

const MAGIC: &[u8; 4] = b"GSCV";

/// Raised when a page of before could not read it.
const VERSION: u32 = 1;

/// Steps between the least and the greatest logarithm of a scale: over e²⁰, one changes a size
/// by 0.03 %.
const STEPS: f32 = 65535.0;

/// Packs a scene, little endian: magic, version, count, degree, channels, whether it is drawn
/// antialiased, the least logarithm of a scale and the step of these; then `[N, 3]` centers in
/// f32; `[N, 4]` words of scales and opacity in 16 bits each, and the quaternion in four signed
/// 16-bit fractions; then `[N, (degree + 1)², channels]` harmonics in IEEE halves.
///
/// Gaussians with values that are not finite, or without a rotation, are left out, as they are
/// when drawn.
pub fn pack(splats: &Splats, drawn: RasterOptions) -> Vec<u8> {
    let shown: Vec<usize> = (0..splats.len()).filter(|&i| is_drawn(splats, i)).collect();
    let scales = shown.iter().flat_map(|&i| splats.log_scales[i]);
    let (low, high) = scales.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), scale| {
        (low.min(scale), high.max(scale))
    });
    let (low, high) = if shown.is_empty() {
        (0.0, 0.0)
    } else {
        (low, high)
    };
    let step = (high - low).max(1e-6) / STEPS;
    let (degree, channels) = (splats.sh.degree, splats.sh.channels);
    let stride = sh::coefficient_count(degree) * channels;

    let mut bytes = Vec::with_capacity(32 + shown.len() * (28 + 2 * stride));
    bytes.extend(MAGIC);
    let antialiased = u32::from(drawn.antialiased);
    for word in [
        VERSION,
        shown.len() as u32,
        degree,
        channels as u32,
        antialiased,
    ] {
        bytes.extend(word.to_le_bytes());
    }
    for value in [low, step] {
        bytes.extend(value.to_le_bytes());
    }
    for value in shown.iter().flat_map(|&i| splats.means[i]) {
        bytes.extend(value.to_le_bytes());
    }
    for &i in &shown {
        for word in shape(splats, i, low, step) {
            bytes.extend(word.to_le_bytes());
        }
    }
    for &i in &shown {
        for &value in &splats.sh.coefficients[i * stride..(i + 1) * stride] {
            let value = value.clamp(-f16::MAX.to_f32(), f16::MAX.to_f32());
            bytes.extend(f16::from_f32(value).to_le_bytes());
        }
    }
    bytes
}

fn is_drawn(splats: &Splats, i: usize) -> bool {
    let stride = sh::coefficient_count(splats.sh.degree) * splats.sh.channels;
    let colors = &splats.sh.coefficients[i * stride..(i + 1) * stride];
    let mut values = (splats.means[i].iter())
        .chain(&splats.quats[i])
        .chain(&splats.log_scales[i])
        .chain(colors)
        .chain([&splats.opacity_logits[i]]);
    let turned: f32 = splats.quats[i].iter().map(|q| q * q).sum();
    values.all(|value| value.is_finite()) && turned > 0.0
}

/// Scales and opacity in 16 bits, quaternion w x y z in signed ones.
fn shape(splats: &Splats, i: usize, low: f32, step: f32) -> [u32; 4] {
    let [x, y, z] = splats.log_scales[i].map(|scale| ((scale - low) / step).round() as u16);
    let opacity = (opacity(splats.opacity_logits[i]) * 65535.0).round() as u16;
    let quat = splats.quats[i];
    let length = quat.iter().map(|q| q * q).sum::<f32>().sqrt();
    let [qw, qx, qy, qz] = quat.map(|q| (q / length * 32767.0).round() as i16 as u16);
    [[x, y], [z, opacity], [qw, qx], [qy, qz]]
        .map(|[low, high]| u32::from(low) | u32::from(high) << 16)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::splats::ShField;

    #[test]
    fn what_is_packed_is_what_was_there() {
        let mut splats = Splats {
            means: vec![[1.0, -2.0, 3.5], [f32::NAN, 0.0, 0.0], [0.0; 3]],
            quats: vec![[2.0, 0.0, 0.0, 0.0], [1.0; 4], [0.0, 0.0, -1.0, 0.0]],
            log_scales: vec![[-3.0, -1.0, 1.0], [0.0; 3], [-2.0; 3]],
            opacity_logits: vec![0.0, 0.0, 100.0],
            sh: ShField::zeros(3, 1, 3),
        };
        splats.sh.coefficients[1] = 0.25;
        let bytes = pack(
            &splats,
            RasterOptions {
                antialiased: true,
                ..RasterOptions::default()
            },
        );
        let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap());
        let float = |at: usize| f32::from_bits(word(at));
        assert_eq!(&bytes[..4], MAGIC);
        assert_eq!([4, 8, 12, 16, 20].map(word), [VERSION, 2, 1, 3, 1]);
        assert_eq!(bytes.len(), 32 + 2 * (28 + 2 * 4 * 3));
        assert_eq!([32, 36, 40].map(float), [1.0, -2.0, 3.5]);
        let (low, step) = (float(24), float(28));
        let first = 32 + 24;
        let scale = |steps: u32| low + step * steps as f32;
        let scales = [
            word(first) & 0xffff,
            word(first) >> 16,
            word(first + 4) & 0xffff,
        ];
        for (steps, wanted) in scales.into_iter().zip([-3.0, -1.0, 1.0]) {
            assert!((scale(steps) - wanted).abs() <= step, "{wanted}");
        }
        assert_eq!(word(first + 4) >> 16, 32768);
        assert_eq!([word(first + 8), word(first + 12)], [32767, 0]);
        // The Gaussian that is not finite is left out.
        assert_eq!(word(first + 16 + 4) >> 16, 65535);
        assert_eq!(word(first + 16 + 12), u32::from((-32767_i16) as u16));
        let half = u16::from_le_bytes([bytes[first + 34], bytes[first + 35]]);
        assert_eq!(f16::from_bits(half).to_f32(), 0.25);
    }

    #[test]
    fn nothing_can_be_packed() {
        let bytes = pack(&Splats::default(), RasterOptions::default());
        assert_eq!(bytes.len(), 32);
    }
}
