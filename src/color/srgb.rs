//! The sRGB transfer function (IEC 61966-2-1).

/// Decodes an sRGB value to linear light.
///
/// `[0, 1]` maps to `[0, 1]`. Outside, the linear segment continues below zero
/// and the power above one, so that the function stays monotone and invertible.
pub fn srgb_to_linear(encoded: f64) -> f64 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// Encodes linear light as sRGB: the inverse of [`srgb_to_linear`].
///
/// The standard's rounded constants leave a step of 3e-8 where the two
/// segments meet; elsewhere the pair inverts to machine precision.
pub fn linear_to_srgb(linear: f64) -> f64 {
    if linear <= 0.003_130_8 {
        linear * 12.92
    } else {
        1.055 * linear.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        for (encoded, linear) in [
            (0.0, 0.0),
            (1.0, 1.0),
            (0.5, 0.214_041_140_482_232_55),
            (0.04, 0.04 / 12.92),
        ] {
            assert!((srgb_to_linear(encoded) - linear).abs() < 1e-15);
            assert!((linear_to_srgb(linear) - encoded).abs() < 1e-15);
        }
    }

    #[test]
    fn the_pair_inverts_and_rises_beyond_the_unit_interval() {
        let mut before = f64::NEG_INFINITY;
        for i in -500..=1500 {
            let encoded = f64::from(i) / 1000.0;
            let linear = srgb_to_linear(encoded);
            assert!((linear_to_srgb(linear) - encoded).abs() < 1e-12);
            assert!(linear > before);
            before = linear;
        }
    }

    #[test]
    fn not_a_number_stays_so() {
        assert!(srgb_to_linear(f64::NAN).is_nan());
        assert!(linear_to_srgb(f64::NAN).is_nan());
    }
}
