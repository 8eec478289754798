//! Quantization shared by the formats: bytes of opacities, levels between two bounds, quaternions
//! by their smallest three components.

use super::opacity;

/// The logit that stands for an opacity of 1: 3e-7 below it, which is opaque, and which f32
/// still tells from it, so that training can move it.
pub(super) const OPAQUE: f32 = 15.0;

/// The logarithm that stands for that of 0: a scale of 2e-9 is flat in any unit that a scene
/// has, and its square is an f32.
pub(super) const FLAT: f32 = -20.0;

/// The largest magnitude that a component of a unit quaternion has beside a larger one: √½.
const LARGEST_SMALL: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// A logit as a byte: its opacity times 255, rounded.
pub(super) fn opacity_byte(logit: f32) -> u8 {
    level(opacity(logit), 255) as u8
}

/// The logit of an opacity in [0, 1]; 0 and 1 become finite.
pub(super) fn logit(opacity: f64) -> f32 {
    let logit = (opacity / (1.0 - opacity)).ln() as f32;
    // The first is NaN's side, too.
    if logit > -OPAQUE {
        logit.min(OPAQUE)
    } else {
        -OPAQUE
    }
}

/// The nearest of the levels 0 to `highest` for a share of it; shares outside [0, 1] are clipped.
pub(super) fn level(share: f64, highest: u32) -> u32 {
    // A cast saturates, and makes 0 of NaN.
    ((share * f64::from(highest)).round() as u32).min(highest)
}

/// Position of a value between two bounds, 0 to 1; 0 where the bounds are equal.
pub(super) fn share(value: f64, low: f64, high: f64) -> f64 {
    match high > low {
        true => ((value - low) / (high - low)).clamp(0.0, 1.0),
        false => 0.0,
    }
}

/// The value at a share of the way between two bounds.
pub(super) fn between(low: f64, high: f64, share: f64) -> f64 {
    low + (high - low) * share
}

/// Index of the largest component of a unit quaternion, and the others in order as shares of √½, in
/// [-1, 1], signed so that the largest is positive.
pub(super) fn smallest_three(quaternion: [f32; 4]) -> (usize, [f64; 3]) {
    let largest = (1..4).fold(0, |best, k| {
        match quaternion[k].abs() > quaternion[best].abs() {
            true => k,
            false => best,
        }
    });
    let sign = 1.0_f64.copysign(quaternion[largest].into());
    let mut others = (0..4).filter(|&k| k != largest);
    let small = [(); 3].map(|()| {
        let k = others.next().unwrap_or(largest);
        sign * f64::from(quaternion[k]) / LARGEST_SMALL
    });
    (largest, small)
}

/// The unit quaternion that [`smallest_three`] takes apart.
pub(super) fn of_smallest_three(largest: usize, small: [f64; 3]) -> [f32; 4] {
    let small = small.map(|value| value * LARGEST_SMALL);
    let rest = 1.0 - small.iter().map(|value| value * value).sum::<f64>();
    let mut quaternion = [0.0; 4];
    let others = (0..4).filter(|&k| k != largest);
    for (k, value) in others.zip(small) {
        quaternion[k] = value as f32;
    }
    quaternion[largest] = rest.max(0.0).sqrt() as f32;
    quaternion
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opacities_are_within_half_a_level() {
        for step in -120..=120 {
            let wanted = step as f32 / 10.0;
            let byte = opacity_byte(wanted);
            let found = logit(f64::from(byte) / 255.0);
            assert!((opacity(found) - opacity(wanted)).abs() <= 0.5 / 255.0 + 1e-6);
            assert_eq!(opacity_byte(found), byte);
        }
        assert_eq!([logit(0.0), logit(1.0)], [-OPAQUE, OPAQUE]);
        assert_eq!(logit(f64::NAN), -OPAQUE);
    }

    #[test]
    fn quaternions_come_back_up_to_their_sign() {
        let quats = [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, -1.0, 0.0, 0.0],
            [0.5, -0.5, 0.5, -0.5],
            [0.1, 0.2, -0.9, 0.374_165_74],
        ];
        for quaternion in quats {
            let (largest, small) = smallest_three(quaternion);
            assert!(small.iter().all(|value| value.abs() <= 1.0 + 1e-6));
            let found = of_smallest_three(largest, small);
            let dot: f32 = (0..4).map(|k| found[k] * quaternion[k]).sum();
            assert!((dot.abs() - 1.0).abs() < 1e-6, "{quaternion:?} {found:?}");
            assert!(found[largest] > 0.0);
        }
    }

    #[test]
    fn levels_are_the_nearest_and_stay_inside() {
        assert_eq!([0.0, 0.499, 0.501, 1.0].map(|s| level(s, 1)), [0, 0, 1, 1]);
        assert_eq!([-3.0, 7.0, f64::NAN].map(|s| level(s, 255)), [0, 255, 0]);
        assert_eq!(share(2.0, 2.0, 2.0), 0.0);
        assert_eq!(between(-1.0, 3.0, share(0.5, -1.0, 3.0)), 0.5);
    }
}
