//! NumPy's files of 32-bit floats: version 1.0, little-endian, in C order.
//!
//! Only the header that NumPy itself writes is read. A general reader takes any Python
//! literal there, and does not end with one that nests deeply (docs/decisions/platform.md).
//!
//! Format: <https://numpy.org/doc/stable/reference/generated/numpy.lib.format.html>.

/// Magic bytes of version 1.0.
const MAGIC: &[u8] = b"\x93NUMPY\x01\x00";

/// Values begin at a multiple of so many bytes.
const ALIGNMENT: usize = 64;

/// The header's text around its shape.
const BEFORE_SHAPE: &str = "{'descr':'<f4','fortran_order':False,'shape':(";
const AFTER_SHAPE: &str = "),}";

/// The bytes of a file.
pub(crate) fn encode(shape: &[usize], values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    let sides: Vec<String> = shape.iter().map(usize::to_string).collect();
    // A tuple of one ends with a comma.
    let comma = if sides.len() == 1 { "," } else { "" };
    let shape = sides.join(", ") + comma;
    let text = format!("{{'descr': '<f4', 'fortran_order': False, 'shape': ({shape}), }}");
    let start = MAGIC.len() + size_of::<u16>();
    let end = (start + text.len() + 1).next_multiple_of(ALIGNMENT);
    let width = end - start - 1;
    let mut bytes = MAGIC.to_vec();
    bytes.extend((width as u16 + 1).to_le_bytes());
    bytes.extend(format!("{text:<width$}\n").bytes());
    bytes.extend(values.into_iter().flat_map(f32::to_le_bytes));
    bytes
}

/// Shape and values of a file.
///
/// # Errors
/// In words: no such array, or not as many values as its shape says.
pub(crate) fn decode(bytes: &[u8]) -> Result<(Vec<usize>, Vec<f32>), String> {
    let (header, values) = split_header(bytes).ok_or("no .npy file of version 1.0")?;
    let header: String = (header.chars().filter(|c| !c.is_ascii_whitespace())).collect();
    let other = || format!("holds {header}, no '<f4' in C order");
    let shape = (header.strip_prefix(BEFORE_SHAPE))
        .and_then(|rest| rest.strip_suffix(AFTER_SHAPE))
        .ok_or_else(other)?;
    let sides = shape.strip_suffix(',').unwrap_or(shape).split(',');
    let shape: Vec<usize> =
        (sides.map(str::parse).collect::<Result<_, _>>()).map_err(|_| other())?;
    let expected = (shape.iter())
        .try_fold(size_of::<f32>(), |bytes, &side| bytes.checked_mul(side))
        .ok_or_else(other)?;
    if values.len() != expected {
        return Err(format!(
            "holds {} bytes of values instead of {expected}",
            values.len()
        ));
    }
    let values = values.as_chunks().0.iter();
    Ok((
        shape,
        values.map(|&four| f32::from_le_bytes(four)).collect(),
    ))
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

    #[test]
    fn an_array_comes_back() {
        for shape in [vec![6], vec![2, 3], vec![1, 2, 3], vec![0, 5]] {
            let count = shape.iter().product();
            let values: Vec<f32> = (0..count).map(|i| i as f32 - 1.5).collect();
            let bytes = encode(&shape, values.iter().copied());
            assert_eq!((bytes.len() - 4 * count) % ALIGNMENT, 0);
            assert_eq!(decode(&bytes), Ok((shape, values)));
        }
    }

    #[test]
    fn a_file_of_numpy_is_read() {
        // numpy.save of numpy.array([[[1, -2]]], "<f4").
        let text = "{'descr': '<f4', 'fortran_order': False, 'shape': (1, 1, 2), }";
        let mut bytes = MAGIC.to_vec();
        bytes.extend(118_u16.to_le_bytes());
        bytes.extend(format!("{text:<117}\n").bytes());
        bytes.extend([1.0_f32, -2.0].iter().flat_map(|v| v.to_le_bytes()));
        assert_eq!(decode(&bytes), Ok((vec![1, 1, 2], vec![1.0, -2.0])));
    }

    #[test]
    fn other_files_are_refused_with_the_reason() {
        let good = encode(&[3, 2], [0.0; 6]);
        let refused = |bytes: &[u8], part: &str| {
            let error = decode(bytes).unwrap_err();
            assert!(error.contains(part), "{error}");
        };
        refused(b"", "no .npy");
        refused(&good[..9], "no .npy");
        refused(b"\x93NUMPY\x01\x00\xff\xffab", "no .npy");
        refused(&good[..good.len() - 1], "23 bytes");
        refused(&[&good[..], &[0]].concat(), "25 bytes");
        let with = |from: &str, to: &str| {
            let text = String::from_utf8_lossy(&good[MAGIC.len()..]).replace(from, to);
            [MAGIC, text.as_bytes()].concat()
        };
        refused(&with("<f4", "<f8"), "<f8");
        refused(&with("False", "True "), "True");
        refused(&with("3, 2", "3,-2"), "(3,-2)");
        // More bytes than there can be.
        let many = encode(&[usize::MAX, usize::MAX], []);
        refused(&many, "no '<f4'");
    }
}
