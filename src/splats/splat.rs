//! `.splat` files: 32 bytes a Gaussian, and nothing else.
//!
//! | bytes | |
//! |---|---|
//! | 0–11 | center: x, y, z, f32 |
//! | 12–23 | scales along the rotated axes, f32, not logarithms |
//! | 24–27 | red, green, blue, opacity: 255 is 1 |
//! | 28–31 | quaternion w, x, y, z: 128 is 0, and 0 is -1 |
//!
//! All numbers are little-endian. There is no place for harmonics above the constant one, for
//! antialiasing or for an offset. What a byte of a quaternion means readers do not agree on:
//! (byte - 128) / 128 or byte / 127.5 - 1, normalized or not. To both 0 is -1, and 255 to one of
//! them 0.992: so the largest component is written as a negative one.
//!
//! Source: <https://github.com/antimatter15/splat>, `convert.py` and `main.js`.

use std::path::Path;

use super::{
    ReadSplats, SplatError, Splats,
    quantize::{FLAT, level, logit, opacity_byte, smallest_three},
    sh::C0,
    shared::{CHANNELS, SplatBuilder},
};

/// Bytes of a Gaussian.
const ROW: usize = 32;

/// Reads a file.
///
/// # Errors
/// [`SplatError::Damaged`] where it does not consist of whole Gaussians.
pub(super) fn read(path: &Path, bytes: &[u8]) -> Result<ReadSplats, SplatError> {
    let (rows, rest) = bytes.as_chunks::<ROW>();
    if !rest.is_empty() {
        return Err(SplatError::damaged(
            path,
            "size",
            format!(
                "{} bytes are no multiple of {ROW}; it is cut off or damaged",
                bytes.len()
            ),
        ));
    }
    let mut gathered = SplatBuilder::new(rows.len(), 0);
    for row in rows {
        let float =
            |at: usize| f32::from_le_bytes([row[at], row[at + 1], row[at + 2], row[at + 3]]);
        let scale = |k: usize| match float(12 + 4 * k) {
            0.0 => FLAT,
            // Of a negative one it is not a number.
            scale => scale.ln(),
        };
        let shown = |k: usize| f64::from(row[24 + k]) / 255.0;
        gathered.push(
            [0, 1, 2].map(|k| float(4 * k)),
            [0, 1, 2, 3].map(|k| (f32::from(row[28 + k]) - 128.0) / 128.0),
            [0, 1, 2].map(scale),
            logit(shown(3)),
            &[0, 1, 2].map(|k| ((shown(k) - 0.5) / C0) as f32),
        );
    }
    Ok(gathered.finish())
}

/// The bytes of a file.
pub(super) fn encode(splats: &Splats) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(splats.len() * ROW);
    for index in 0..splats.len() {
        let scales = splats.log_scales[index].map(f32::exp);
        let floats = splats.means[index].into_iter().chain(scales);
        bytes.extend(floats.flat_map(f32::to_le_bytes));
        let constant = &splats.sh.of(index)[..CHANNELS];
        bytes.extend(constant.iter().map(|&value| shown_byte(value)));
        bytes.push(opacity_byte(splats.opacity_logits[index]));
        let quaternion = splats.quats[index];
        let (largest, _) = smallest_three(quaternion);
        let sign = -(1.0_f32.copysign(quaternion[largest]));
        bytes.extend(quaternion.map(|value| {
            // Saturates.
            (sign * value * 128.0 + 128.0).round() as u8
        }));
    }
    bytes
}

/// The color of a constant coefficient, 0 to 255.
pub(super) fn shown_byte(coefficient: f32) -> u8 {
    level(0.5 + C0 * f64::from(coefficient), 255) as u8
}
