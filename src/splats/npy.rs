//! Harmonics as NumPy arrays: what a splat file has no place for.

use super::{
    ShField,
    sh::{MAX_DEGREE, coefficient_count},
};
use crate::npy;

/// The bytes of a `.npy` file, f32 `[N, (degree + 1)², channels]`.
pub fn encode(field: &ShField) -> Vec<u8> {
    let terms = coefficient_count(field.degree);
    let count = field.coefficients.len() / (terms * field.channels).max(1);
    let shape = [count, terms, field.channels];
    npy::encode(&shape, field.coefficients.iter().copied())
}

/// Reads a field of `channels` channels for `count` Gaussians, of any degree, as [`encode`]
/// and `numpy.save` write it.
///
/// # Errors
/// In words: no such array, another shape, cut off, or a value that is not finite.
pub fn decode(bytes: &[u8], count: usize, channels: usize) -> Result<ShField, String> {
    let (shape, coefficients) = npy::decode(bytes)?;
    let of_degree = |&degree: &u32| shape == [count, coefficient_count(degree), channels];
    let degree = (0..=MAX_DEGREE).find(of_degree).ok_or_else(|| {
        format!("has the shape {shape:?}, not [{count}, 1, 4, 9 or 16, {channels}]")
    })?;
    match coefficients.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(format!("contains {value}")),
        None => Ok(ShField {
            degree,
            channels,
            coefficients,
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field() -> ShField {
        ShField {
            degree: 1,
            channels: 2,
            coefficients: (0..24).map(|i| i as f32 - 7.5).collect(),
        }
    }

    #[test]
    fn a_field_comes_back() {
        let bytes = encode(&field());
        assert_eq!(decode(&bytes, 3, 2).unwrap(), field());
    }

    #[test]
    fn other_files_are_refused_with_the_reason() {
        let good = encode(&field());
        let refused = |bytes: &[u8], part: &str| {
            let error = decode(bytes, 3, 2).unwrap_err();
            assert!(error.contains(part), "{error}");
        };
        refused(b"", "no .npy");
        refused(&good[..good.len() - 1], "95 bytes");
        let mut poisoned = good.clone();
        let last = good.len() - 4;
        poisoned[last..].copy_from_slice(&f32::NAN.to_le_bytes());
        refused(&poisoned, "NaN");
        // Another number of Gaussians, another kind of field.
        assert!(decode(&good, 2, 2).unwrap_err().contains("[3, 4, 2]"));
        assert!(decode(&good, 3, 3).is_err());
    }
}
