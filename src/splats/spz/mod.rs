//! `.spz` files, Niantic's: version 3, one gzip stream, is written; 1, 2 and 4, six Zstandard
//! streams, are read, too.
//!
//! Header, little-endian, in versions 1 to 3 inside of the stream:
//!
//! | bytes | |
//! |---|---|
//! | 0–3 | `NGSP` |
//! | 4–7 | version, u32 |
//! | 8–11 | Gaussians, u32 |
//! | 12 | degree of the harmonics, 0 to 3 (4 is not read) |
//! | 13 | fractional bits of the centers |
//! | 14 | flags: 1 antialiased, 2 extensions |
//! | 15 | 0; in version 4 the number of streams |
//! | 16–31 | version 4 only: offset of the table of streams, u32; 12 zeros |
//!
//! The table of version 4 has two u64 for each stream, its bytes compressed and not; the streams
//! follow. They, or the parts of the one of the older versions, are:
//!
//! | part | bytes | |
//! |---|---|---|
//! | centers | 9 | three signed 24-bit numbers over 2^(fractional bits); version 1: three 16-bit floats |
//! | opacities | 1 | 255 is 1 |
//! | colors | 3 | 255 (0.15 c + ½), c the constant coefficient |
//! | scales | 3 | 16 (10 + logarithm) |
//! | rotations | 4 | from the highest bit: index 2 of the largest of x, y, z, w; the others 10 each: sign, then 511 is √½. Versions 1 and 2: x, y, z in 3 bytes, 127.5 (1 + value), w positive |
//! | harmonics | 9, 24, 45 | 128 + 128 value, channels next to each other |
//!
//! The reference writer rounds harmonics to 5 bits of degree 1 and 4 of the others, which
//! compresses better and can be seen; this one keeps all 8, see docs/experiments.md.
//!
//! **Axes.** The reference says right, up, back, and converts only where it is told from what.
//! splat-transform, SuperSplat, PlayCanvas and Spark take the numbers as those of a `.ply`; this
//! writer and reader do the same, so that a scene stands as its `.ply` does. Only where an
//! extension says which axes they are is a scene turned.
//!
//! **Extensions** stand behind the header of version 4, and in older ones behind the last part.
//! Each is a u32 that tells which, a u32 with its bytes, and these.
//!
//! Source: <https://github.com/nianticlabs/spz>, README and `load-spz.cc`.

mod read;
mod write;

pub(super) use read::read;
pub(super) use write::encode;

use super::sh::coefficient_count;
use super::shared::CHANNELS;

const MAGIC: [u8; 4] = *b"NGSP";

/// Header of versions 1 to 3, and the beginning of that of version 4.
const HEADER: usize = 16;

/// Header of version 4.
const LONG_HEADER: usize = 32;

/// Bytes of a row of version 4's table.
const TABLE_ROW: usize = 16;

/// The flag of scenes trained antialiased.
const ANTIALIASED: u8 = 1;

/// The flag of files with extensions.
const EXTENDED: u8 = 2;

/// The extension with the axes: a u32, one more than the place in [`SYSTEMS`]; 0 says nothing.
const AXES: u32 = 0xADBE_0003;

/// The extension with what a viewer's camera may do, which changes no picture.
const ORBIT: u32 = 0xADBE_0002;

/// Directions of the axes x, y and z: left or right, up or down, back or front.
const SYSTEMS: [&str; 16] = [
    "LDB", "RDB", "LUB", "RUB", "LDF", "RDF", "LUF", "RUF", "LFD", "RFD", "LFU", "RFU", "LBD",
    "RBD", "LBU", "RBU",
];

/// Share of a color's range per unit of the constant coefficient.
const COLOR_SCALE: f64 = 0.15;

/// Steps of a logarithm of a scale.
const SCALE_STEPS: f64 = 16.0;

/// The logarithm of the smallest scale.
const LOWEST_SCALE: f64 = -10.0;

/// Levels of a component of a quaternion, to either side of 0.
const ROTATION_LEVELS: u32 = 511;

/// Levels of a harmonic to either side of 0.
const SH_LEVELS: f64 = 128.0;

/// Bytes of a Gaussian in each part.
fn part_bytes(version: u32, degree: u32) -> [usize; 6] {
    let center = if version == 1 { 6 } else { 9 };
    let rotation = if version < 3 { 3 } else { 4 };
    let rest = (coefficient_count(degree) - 1) * CHANNELS;
    [center, 1, 3, 3, rotation, rest]
}

#[cfg(test)]
mod tests;
