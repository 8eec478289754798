//! Spark's default encoding of a Gaussian: 16 bytes, and harmonics in 5 to 8 bits. Read in its
//! source, version 2.2 (`setPackedSplat`, `encodeSh1Rgb` and on).

use half::f16;

use crate::splats::{Splats, sh};

/// Log-scales from here, in so many steps, to there.
const LOG_SCALES: [f32; 2] = [-12.0, 9.0];
const LOG_SCALE_STEPS: f32 = 254.0;

/// Steps of opacities and constant colors between 0 and 1, of a rotation's angle between 0 and
/// π, and of its axis.
const BYTE: f32 = 255.0;

/// Steps of harmonics between 0 and 1 by their degree; farther ones end at 1.
const HARMONIC_STEPS: [f32; 4] = [BYTE, 63.0, 127.0, 31.0];

/// No opacity is nearer to 0 or 1, where a logit ends.
const LOGIT_MARGIN: f32 = 1e-6;

/// A rotation's axis is x where its sine is less.
const SMALLEST_SINE: f32 = 1e-6;

/// An RGB scene as Spark keeps it.
pub fn packed(splats: &Splats) -> Splats {
    let mut kept = placed(splats);
    for scale in kept.log_scales.as_flattened_mut() {
        *scale = log_scale(*scale);
    }
    for logit in &mut kept.opacity_logits {
        let opacity = (byte(1.0 / (1.0 + (-*logit).exp()))).clamp(LOGIT_MARGIN, 1.0 - LOGIT_MARGIN);
        *logit = (opacity / (1.0 - opacity)).ln();
    }
    let c0 = sh::C0 as f32;
    let terms = sh::coefficient_count(kept.sh.degree);
    for of_splat in kept.sh.coefficients.chunks_exact_mut(3 * terms) {
        for (k, values) in of_splat.chunks_exact_mut(3).enumerate() {
            let steps = HARMONIC_STEPS[k.isqrt()];
            for value in values {
                *value = match k {
                    0 => (byte(0.5 + c0 * *value) - 0.5) / c0,
                    _ => (value.clamp(-1.0, 1.0) * steps).round() / steps,
                };
            }
        }
    }
    kept
}

/// A scene with centers and rotations as Spark keeps them.
pub fn placed(splats: &Splats) -> Splats {
    let mut kept = splats.clone();
    for mean in kept.means.as_flattened_mut() {
        // Beyond there is no half float.
        let most = f16::MAX.to_f32();
        *mean = f16::from_f32(mean.clamp(-most, most)).to_f32();
    }
    for quat in &mut kept.quats {
        *quat = rotation(*quat);
    }
    kept
}

/// A log-scale in steps of 8 %.
pub fn log_scale(value: f32) -> f32 {
    let [low, high] = LOG_SCALES;
    let step = (high - low) / LOG_SCALE_STEPS;
    low + step * ((value.clamp(low, high) - low) / step).round()
}

/// A number from 0 to 1 in a byte.
fn byte(value: f32) -> f32 {
    (value.clamp(0.0, 1.0) * BYTE).round() / BYTE
}

/// A rotation (w, x, y, z) as its axis, on an octahedron, and its angle, a byte each.
fn rotation(quat: [f32; 4]) -> [f32; 4] {
    let length = quat.iter().map(|v| v * v).sum::<f32>().sqrt();
    let sign = if quat[0] < 0.0 { -1.0 } else { 1.0 };
    let [w, x, y, z] = quat.map(|v| sign * v / length);
    let sine = (x * x + y * y + z * z).sqrt();
    let axis = match sine < SMALLEST_SINE {
        true => [1.0, 0.0, 0.0],
        false => [x, y, z].map(|v| v / sine),
    };
    let sum: f32 = axis.iter().map(|v| v.abs()).sum();
    let [u, v] = folded([axis[0] / sum, axis[1] / sum], axis[2] < 0.0);
    let [u, v] = [u, v].map(|v| 2.0 * byte(0.5 + 0.5 * v) - 1.0);
    let above = 1.0 - u.abs() - v.abs();
    let [x, y] = folded([u, v], above < 0.0);
    let length = (x * x + y * y + above * above).sqrt();
    let pi = std::f32::consts::PI;
    let half = 0.5 * pi * byte(2.0 * w.min(1.0).acos() / pi);
    let [x, y, z] = [x, y, above].map(|v| half.sin() * v / length);
    [half.cos(), x, y, z]
}

/// The lower half of an octahedron folded over the upper one's corners, and back.
fn folded([u, v]: [f32; 2], below: bool) -> [f32; 2] {
    let sign = |of: f32| if of >= 0.0 { 1.0 } else { -1.0 };
    match below {
        true => [(1.0 - v.abs()) * sign(u), (1.0 - u.abs()) * sign(v)],
        false => [u, v],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::splats::fixtures::scattered;

    #[test]
    fn what_is_kept_is_near_and_kept_again() {
        let splats = scattered(500, 3);
        let kept = packed(&splats);
        for (quat, kept) in splats.quats.iter().zip(&kept.quats) {
            let length = quat.iter().map(|v| v * v).sum::<f32>().sqrt();
            let dot: f32 = quat.iter().zip(kept).map(|(a, b)| a * b / length).sum();
            // Within a byte of the axis and of the angle.
            assert!(dot.abs() > 0.9995, "{quat:?} {kept:?}");
        }
        let apart = |a: &[f32], b: &[f32]| -> f32 {
            let each = a.iter().zip(b).map(|(a, b)| (a - b).abs());
            each.fold(0.0, f32::max)
        };
        let flat = |splats: &Splats| splats.log_scales.as_flattened().to_vec();
        assert!(apart(&flat(&splats), &flat(&kept)) <= 0.5 * 21.0 / 254.0 + 1e-6);
        let again = packed(&kept);
        assert_eq!(again.means, kept.means);
        assert!(apart(&flat(&again), &flat(&kept)) < 1e-6);
        assert!(apart(&again.opacity_logits, &kept.opacity_logits) < 1e-3);
        assert!(apart(&again.sh.coefficients, &kept.sh.coefficients) < 1e-6);
    }

    #[test]
    fn rotations_on_the_grid_stay() {
        let s = std::f32::consts::FRAC_1_SQRT_2;
        let near = |a: [f32; 4], b: [f32; 4]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 0.01);
        for quat in [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 1.0],
            [0.0, 0.0, 0.0, -1.0],
            [s, -s, 0.0, 0.0],
            [s, 0.0, 0.0, -s],
        ] {
            assert!(near(rotation(quat), quat), "{quat:?}");
            // The opposite quaternion is the same rotation, half turns apart.
            if quat[0] > 0.0 {
                assert!(near(rotation(quat.map(|v| -v)), quat), "{quat:?}");
            }
        }
    }

    #[test]
    fn constant_colors_end_at_black_and_white() {
        let mut splats = scattered(1, 1);
        let white = (0.5 / sh::C0) as f32;
        splats.sh.coefficients[..3].copy_from_slice(&[3.0, -3.0, 0.0]);
        splats.sh.coefficients[3] = 1.5;
        let kept = packed(&splats).sh.coefficients;
        assert!((kept[0] - white).abs() < 1e-6 && (kept[1] + white).abs() < 1e-6);
        // Gray is 127.5 in bytes.
        assert!(kept[2].abs() < 1.0 / 255.0 / sh::C0 as f32);
        assert_eq!(kept[3], 1.0);
    }
}
