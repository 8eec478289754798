//! Optical flow in Middlebury's `.flo` files.
//!
//! S. Baker et al., *A Database and Evaluation Methodology for Optical Flow*, IJCV
//! 2011: the f32 202021.25 ("PIEH"), width and height as i32, then u and v of each
//! pixel as f32, row by row, all little-endian.

use super::Flow;

/// Magic bytes of a `.flo` file.
const TAG: &[u8; 4] = b"PIEH";

/// Values of at least this size say that the flow is not known.
const UNKNOWN: f32 = 1e9;

/// Reads a flow that must have a picture's width and height.
///
/// # Errors
/// In words: no `.flo` file, another size, or cut off.
pub fn decode_flo(bytes: &[u8], width: usize, height: usize) -> Result<Flow, String> {
    let (words, rest) = bytes.as_chunks::<4>();
    let (&[tag, w, h], values) = words.split_first_chunk().ok_or("no .flo file")?;
    if &tag != TAG {
        return Err("no .flo file".to_owned());
    }
    let found = [w, h].map(i32::from_le_bytes);
    if found != [width as i32, height as i32] {
        return Err(format!(
            "is {}×{} pixels, the pictures {width}×{height}",
            found[0], found[1]
        ));
    }
    if values.len() != 2 * width * height || !rest.is_empty() {
        return Err(format!(
            "holds {} bytes of flow instead of {}",
            4 * values.len() + rest.len(),
            8 * width * height
        ));
    }
    let vectors = values
        .as_chunks::<2>()
        .0
        .iter()
        .map(|pair| {
            let vector = pair.map(f32::from_le_bytes);
            // Infinity is unknown too, and NaN stays what it is.
            if vector.iter().any(|v| v.abs() >= UNKNOWN) {
                [f32::NAN; 2]
            } else {
                vector
            }
        })
        .collect();
    Ok(Flow {
        width,
        height,
        vectors,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(values: &[f32]) -> Vec<u8> {
        let mut bytes = TAG.to_vec();
        bytes.extend([2_i32, 1].iter().flat_map(|v| v.to_le_bytes()));
        bytes.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        bytes
    }

    #[test]
    fn a_file_byte_by_byte() {
        assert_eq!(TAG, &202_021.25_f32.to_le_bytes());
        let flow = decode_flo(&file(&[1.5, -2.0, 0.0, 1e10]), 2, 1).unwrap();
        assert_eq!((flow.width, flow.height), (2, 1));
        assert_eq!(flow.vectors[0], [1.5, -2.0]);
        assert!(flow.vectors[1].iter().all(|v| v.is_nan()));
    }

    #[test]
    fn other_files_are_refused() {
        let good = file(&[0.0; 4]);
        let refused = |bytes: &[u8], size: [usize; 2], part: &str| {
            let error = decode_flo(bytes, size[0], size[1]).unwrap_err();
            assert!(error.contains(part), "{error}");
        };
        refused(&[], [2, 1], "no .flo");
        refused(b"PNG, or so", [2, 1], "no .flo");
        refused(&good, [1, 2], "2×1");
        refused(&good[..25], [2, 1], "13 bytes");
        refused(&[&good[..], &[0; 8]].concat(), [2, 1], "24 bytes");
    }
}
