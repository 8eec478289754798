//! Harmonics as NumPy arrays: what a splat file has no place for.

use std::io;

use npyz::{WriteOptions, WriterBuilder};

use super::ShField;
use super::sh::{MAX_DEGREE, coefficient_count};

/// What every `.npy` file of version 1.0 begins with.
const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";

/// The bytes of a `.npy` file, f32 `[N, (degree + 1)², channels]`.
///
/// # Errors
/// Whatever the encoder says; writing to memory does not fail.
pub fn encode(field: &ShField) -> io::Result<Vec<u8>> {
    let terms = coefficient_count(field.degree);
    let count = field.coefficients.len() / (terms * field.channels).max(1);
    let mut bytes = Vec::new();
    let mut writer = WriteOptions::<f32>::new()
        .default_dtype()
        .shape(&[count as u64, terms as u64, field.channels as u64])
        .writer(&mut bytes)
        .begin_nd()?;
    writer.extend(field.coefficients.iter().copied())?;
    writer.finish()?;
    Ok(bytes)
}

/// Reads a field of `channels` channels for `count` Gaussians, of any degree.
///
/// Little-endian f32 in C order, as [`encode`] and `numpy.save` write it.
///
/// # Errors
/// In words: no such array, another shape, cut off, or a value that is not finite.
pub fn decode(bytes: &[u8], count: usize, channels: usize) -> Result<ShField, String> {
    let (header, values) = split_header(bytes).ok_or("no .npy file of version 1.0")?;
    let header: String = header.chars().filter(|c| !c.is_whitespace()).collect();
    // Writers differ in whether a tuple ends with a comma.
    let header = header.replace(",)", ")");
    let of_degree = |degree: &u32| {
        let terms = coefficient_count(*degree);
        header
            == format!(
                "{{'descr':'<f4','fortran_order':False,'shape':({count},{terms},{channels}),}}"
            )
    };
    let degree = (0..=MAX_DEGREE).find(of_degree).ok_or_else(|| {
        format!("holds {header}, not '<f4' of shape ({count}, 1, 4, 9 or 16, {channels})")
    })?;
    let expected = count * coefficient_count(degree) * channels;
    let (values, rest) = values.as_chunks();
    if values.len() != expected || !rest.is_empty() {
        return Err(format!(
            "holds {} bytes of values instead of {}",
            4 * values.len() + rest.len(),
            4 * expected
        ));
    }
    let coefficients: Vec<f32> = values
        .iter()
        .map(|&four| f32::from_le_bytes(four))
        .collect();
    match coefficients.iter().find(|value| !value.is_finite()) {
        Some(value) => Err(format!("contains {value}")),
        None => Ok(ShField {
            degree,
            channels,
            coefficients,
        }),
    }
}

/// The header's text and what follows it.
fn split_header(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let (&length, rest) = bytes.strip_prefix(MAGIC)?.split_first_chunk()?;
    let (header, values) = rest.split_at_checked(u16::from_le_bytes(length).into())?;
    Some((std::str::from_utf8(header).ok()?, values))
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
        let bytes = encode(&field()).unwrap();
        assert_eq!(decode(&bytes, 3, 2).unwrap(), field());
    }

    #[test]
    fn a_file_of_numpy_is_read() {
        // numpy.save of numpy.array([[[1, -2]]], "<f4").
        let text = "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1, 2), }";
        let mut bytes = MAGIC.to_vec();
        bytes.extend(118_u16.to_le_bytes());
        bytes.extend(format!("{text:<117}\n").bytes());
        bytes.extend([1.0_f32, -2.0].iter().flat_map(|v| v.to_le_bytes()));
        let read = decode(&bytes, 1, 2).unwrap();
        assert_eq!((read.degree, read.coefficients), (0, vec![1.0, -2.0]));
    }

    #[test]
    fn other_files_are_refused_with_the_reason() {
        let good = encode(&field()).unwrap();
        let refused = |bytes: &[u8], part: &str| {
            let error = decode(bytes, 3, 2).unwrap_err();
            assert!(error.contains(part), "{error}");
        };
        refused(b"", "no .npy");
        refused(&good[..9], "no .npy");
        refused(b"\x93NUMPY\x01\x00\xff\xffab", "no .npy");
        refused(&good[..good.len() - 1], "95 bytes");
        refused(&[&good[..], &[0]].concat(), "97 bytes");
        let mut poisoned = good.clone();
        let last = good.len() - 4;
        poisoned[last..].copy_from_slice(&f32::NAN.to_le_bytes());
        refused(&poisoned, "NaN");
        // Another number of Gaussians, another kind of field.
        assert!(decode(&good, 2, 2).unwrap_err().contains("(3,4,2)"));
        assert!(decode(&good, 3, 3).is_err());
    }
}
