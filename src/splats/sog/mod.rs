//! `.sog` files: PlayCanvas' Spatially Ordered Gaussians, version 2, as one zip archive.
//!
//! `meta.json` names the textures, lossless WebP pictures in which pixel i, row after row,
//! belongs to Gaussian i:
//!
//! | texture | channels |
//! |---|---|
//! | `means` (two) | red, green, blue: lower and upper bytes of x, y, z, shares in 65535ths of `mins` to `maxs`, which are sign(x) ln(1 + \|x\|) |
//! | `scales` | indices of `codebook`, the logarithms' 256 values |
//! | `quats` | alpha 252 + the index of the largest of w, x, y, z; the others in red, green, blue, 0 to 255 for -√½ to √½ |
//! | `sh0` | red, green, blue: indices of `codebook`, of the constant coefficients; alpha the opacity |
//! | `shN` labels | red and green: the lower and the upper byte of an index into the palette |
//! | `shN` centroids | the palette: 64 entries a row, each 3, 8 or 15 pixels, whose red, green, blue are indices of `codebook` |
//!
//! Whether a scene is drawn antialiased is `antialias`, as the specification has it, and
//! `model: "antialiased"`, as splat-transform has it; both are written and either is read.
//!
//! **Axes.** The specification says right, up, back; splat-transform, SuperSplat and PlayCanvas
//! write and take the numbers of a `.ply`, and so does this.
//!
//! Source: <https://developer.playcanvas.com/user-manual/gaussian-splatting/formats/sog/>, and
//! the writer of <https://github.com/playcanvas/splat-transform>, which the specification follows
//! where they differ (order of a quaternion's components, logarithms of scales).

mod codebook;
mod palette;
mod read;
mod texture;
mod write;

pub(super) use read::read;
pub(super) use write::encode;

use serde::{Deserialize, Serialize};

use super::{sh::coefficient_count, shared::CHANNELS};

const META: &str = "meta.json";

const VERSION: u32 = 2;

/// Value of `model` for scenes trained antialiased.
const ANTIALIASED: &str = "antialiased";

/// The alpha of a quaternion whose first component is largest.
const QUATERNION: u8 = 252;

/// Entries of the palette in a row of its texture.
const ENTRIES_PER_ROW: usize = 64;

/// The most entries that 16 bits tell apart.
const MOST_ENTRIES: usize = 1 << 16;

/// Content of `meta.json`.
#[derive(Serialize, Deserialize)]
struct Meta {
    #[serde(default)]
    version: u32,
    #[serde(default)]
    asset: Asset,
    count: usize,
    #[serde(default)]
    antialias: bool,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    model: Option<String>,
    means: Means,
    scales: Coded,
    quats: Plain,
    sh0: Coded,
    #[serde(default, rename = "shN", skip_serializing_if = "Option::is_none")]
    sh_n: Option<Harmonics>,
}

/// Program that wrote the file, and the offset subtracted from the coordinates.
#[derive(Default, Serialize, Deserialize)]
struct Asset {
    #[serde(default)]
    generator: String,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    offset: Option<[f64; 3]>,
}

#[derive(Serialize, Deserialize)]
struct Means {
    mins: [f64; 3],
    maxs: [f64; 3],
    files: [String; 2],
}

#[derive(Serialize, Deserialize)]
struct Coded {
    codebook: Vec<f32>,
    files: [String; 1],
}

#[derive(Serialize, Deserialize)]
struct Plain {
    files: [String; 1],
}

#[derive(Serialize, Deserialize)]
struct Harmonics {
    count: usize,
    bands: u32,
    codebook: Vec<f32>,
    files: [String; 2],
}

/// sign(x) ln(1 + |x|).
fn logarithm(coordinate: f64) -> f64 {
    coordinate.abs().ln_1p().copysign(coordinate)
}

/// The coordinate of a [`logarithm`].
fn coordinate(logarithm: f64) -> f64 {
    logarithm.abs().exp_m1().copysign(logarithm)
}

#[cfg(test)]
mod tests;
