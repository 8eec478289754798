//! Writing splat files that every viewer accepts.

use super::{CENTER, CHANNELS, NORMALS, SHAPE, SplatError, rest_count, sh_names, sh_position};
use crate::disk;
use crate::splats::{Splats, sh};
use glam::DVec3;
use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

/// Longest header that is written: some readers give up at 10 KiB.
const MAX_HEADER_BYTES: usize = 8 * 1024;

/// Gaussians that are encoded before they are handed to the file.
const CHUNK_ROWS: usize = 4096;

/// Writes Gaussians as a binary little-endian 3D Gaussian Splatting `.ply` file
/// that viewers read as it is: every property a `float` in the reference's
/// order, unit quaternions, finite numbers.
///
/// A field with one channel is written as gray RGB. `offset` is added to the
/// centers in f64 before they are rounded to f32. `comments` become comment
/// lines (line breaks become spaces); those that would make the header longer
/// than 8 KiB are left out because some readers give up on long headers.
///
/// The file appears under its name when it is complete; one that was there is
/// replaced.
///
/// # Errors
/// [`SplatError::BadValue`] where a number is not finite or a quaternion zero,
/// [`SplatError::NotWritten`] where the arrays have different lengths, the degree
/// is above 3 or the channels are neither 1 nor 3, [`SplatError::Io`].
pub fn write_ply(
    path: &Path,
    splats: &Splats,
    offset: DVec3,
    comments: &[String],
) -> Result<(), SplatError> {
    check_arrays(path, splats)?;
    let mut file = disk::create(path).map_err(SplatError::io(path))?;

    let header = header(splats.len(), splats.sh.degree, comments);
    let io_error = SplatError::io;
    file.write_all(header.as_bytes()).map_err(io_error(path))?;
    let mut values = Vec::with_capacity(CHUNK_ROWS * 62);
    for start in (0..splats.len()).step_by(CHUNK_ROWS) {
        values.clear();
        for index in start..(start + CHUNK_ROWS).min(splats.len()) {
            push_row(&mut values, splats, index, offset).map_err(bad_value(path, index))?;
        }
        let little_endian: &[u8] = bytemuck::cast_slice(&values);
        file.write_all(little_endian).map_err(io_error(path))?;
    }
    file.persist(path).map_err(io_error(path))
}

/// Checks that Gaussians can be written to a file of any format, `offset` added to their centers.
pub(in crate::splats) fn check(
    path: &Path,
    splats: &Splats,
    offset: DVec3,
) -> Result<(), SplatError> {
    check_arrays(path, splats)?;
    let mut row = Vec::new();
    for index in 0..splats.len() {
        row.clear();
        push_row(&mut row, splats, index, offset).map_err(bad_value(path, index))?;
    }
    Ok(())
}

fn bad_value(path: &Path, index: usize) -> impl FnOnce((&'static str, f64)) -> SplatError {
    move |(property, value)| SplatError::BadValue {
        path: path.to_path_buf(),
        index,
        property,
        value,
    }
}

fn check_arrays(path: &Path, splats: &Splats) -> Result<(), SplatError> {
    let field = &splats.sh;
    let reason = if field.degree > sh::MAX_DEGREE {
        format!("SH degree {} is above {}", field.degree, sh::MAX_DEGREE)
    } else if field.channels != 1 && field.channels != CHANNELS {
        format!("a field of {} channels has no color", field.channels)
    } else {
        let stride = sh::coefficient_count(field.degree) * field.channels;
        let lengths = [
            splats.quats.len(),
            splats.log_scales.len(),
            splats.opacity_logits.len(),
            field.coefficients.len() / stride,
        ];
        if lengths == [splats.len(); 4] && field.coefficients.len().is_multiple_of(stride) {
            return Ok(());
        }
        format!(
            "{} centers, but other arrays hold {lengths:?}",
            splats.len()
        )
    };
    Err(SplatError::NotWritten {
        path: path.to_path_buf(),
        reason,
    })
}

fn header(count: usize, degree: u32, comments: &[String]) -> String {
    let mut properties = String::new();
    let names = CENTER.into_iter().chain(NORMALS).map(String::from);
    let names = names.chain(sh_names(degree));
    for name in names.chain(SHAPE.into_iter().map(String::from)) {
        // Writing to a string cannot fail.
        let _ = writeln!(properties, "property float {name}");
    }
    let mut header = String::from("ply\nformat binary_little_endian 1.0\n");
    for comment in comments {
        // Readers look for the header's end as a piece of text anywhere.
        let line = comment.replace(char::is_control, " ");
        let line = line.replace("end_header", "end-header");
        if header.len() + properties.len() + line.len() < MAX_HEADER_BYTES {
            let _ = writeln!(header, "comment {line}");
        }
    }
    let _ = writeln!(header, "element vertex {count}");
    header + &properties + "end_header\n"
}

/// Appends one Gaussian as the bits of little-endian floats.
///
/// Fails with the property and the value that has no place in a file.
fn push_row(
    row: &mut Vec<u32>,
    splats: &Splats,
    index: usize,
    offset: DVec3,
) -> Result<(), (&'static str, f64)> {
    let mut push = |property: &'static str, value: f64| {
        let rounded = value as f32;
        if !rounded.is_finite() {
            return Err((property, value));
        }
        row.push(rounded.to_bits().to_le());
        Ok(())
    };
    let center = splats.means[index].map(f64::from);
    for (value, offset) in center.into_iter().zip(offset.to_array()) {
        push("the center", value + offset)?;
    }
    for _ in NORMALS {
        push("the normal", 0.0)?;
    }

    let degree = splats.sh.degree;
    let coefficients = splats.sh.of(index);
    let channels = splats.sh.channels;
    let mut ordered = [0.0; 48];
    for k in 0..sh::coefficient_count(degree) {
        for channel in 0..CHANNELS {
            // The only channel of luma stands for all three.
            let source = k * channels + channel.min(channels - 1);
            ordered[sh_position(degree, k, channel)] = f64::from(coefficients[source]);
        }
    }
    for &value in &ordered[..CHANNELS + rest_count(degree)] {
        push("the SH field", value)?;
    }

    push("the opacity", f64::from(splats.opacity_logits[index]))?;
    for value in splats.log_scales[index] {
        push("the scale", f64::from(value))?;
    }
    let quaternion = splats.quats[index].map(f64::from);
    let norm = quaternion.iter().map(|q| q * q).sum::<f64>().sqrt();
    if norm == 0.0 {
        return Err(("the quaternion", 0.0));
    }
    for value in quaternion {
        push("the quaternion", value / norm)?;
    }
    Ok(())
}
