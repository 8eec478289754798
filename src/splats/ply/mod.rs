//! Splat files: the `.ply` layout of the 3D Gaussian Splatting reference
//! implementation, which every viewer reads.
//!
//! A vertex is a Gaussian: `x y z` (center), `f_dc_0..2` and `f_rest_*` (SH of
//! red, green, blue), `opacity` (logit), `scale_0..2` (natural logarithms of
//! the standard deviations), `rot_0..3` (quaternion w x y z). Normals are
//! written as zeros because some readers expect them.
//!
//! Files of other programs may have two scales (discs, as 2DGS trains them) and colors of
//! 8 bits, `red green blue`, in the place of `f_dc_0..2`. Where all properties are `ushort` these
//! are floats of 16 bits, as Babylon.js has them. `filter_3D` is put into scales and opacities.

mod collect;
mod compressed;
mod header;
mod read;
mod write;

pub use read::read_ply;
pub use write::write_ply;

use glam::DVec3;

pub(super) use compressed::encode as encode_compressed;
pub(super) use write::check;

use super::{
    ReadSplats, SplatError,
    sh::{MAX_DEGREE, coefficient_count},
    shared::CHANNELS,
};

/// The comment that tells readers to draw with opacities that fall by what the blur
/// spreads: Brush's, which splat-transform reads as well.
pub const ANTIALIASED: &str = "SplatRenderMode: mip";

/// The word that begins the comment with what was subtracted from the centers.
const OFFSET: &str = "offset";

/// The comment of a file from whose centers `offset` was subtracted because they would be too
/// large for 32-bit floats: `offset X Y Z`.
pub fn offset_comment(offset: DVec3) -> String {
    let [x, y, z] = offset.to_array();
    format!("{OFFSET} {x} {y} {z}")
}

/// Properties before the SH: center and normal.
const NORMALS: [&str; 3] = ["nx", "ny", "nz"];
const CENTER: [&str; 3] = ["x", "y", "z"];

/// Properties after the SH.
const SHAPE: [&str; 8] = [
    "opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3",
];

/// The standard deviation of the filter that Mip-Splatting and its kin keep beside scales and
/// opacities, which are without it.
const FILTER: &str = "filter_3D";

/// The scale that discs do not have.
const THIRD_SCALE: &str = "scale_2";

/// Names of the SH properties at a degree: `f_dc_0..2`, then `f_rest_*`.
fn sh_names(degree: u32) -> impl Iterator<Item = String> {
    let dc = (0..CHANNELS).map(|c| format!("f_dc_{c}"));
    dc.chain((0..rest_count(degree)).map(|i| format!("f_rest_{i}")))
}

/// Number of `f_rest_*` properties of a degree: 0, 9, 24 or 45.
fn rest_count(degree: u32) -> usize {
    CHANNELS * (coefficient_count(degree) - 1)
}

/// The degree that has `count` properties `f_rest_*`.
fn degree_of_rest_count(count: usize) -> Option<u32> {
    (0..=MAX_DEGREE).find(|&degree| rest_count(degree) == count)
}

/// Position of coefficient `(k, channel)` of one Gaussian among the SH properties: `f_rest_*` holds
/// all coefficients of red, then green, then blue.
fn sh_position(degree: u32, k: usize, channel: usize) -> usize {
    match k {
        0 => channel,
        k => CHANNELS + channel * (coefficient_count(degree) - 1) + k - 1,
    }
}

#[cfg(test)]
mod foreign_tests;
#[cfg(test)]
mod tests;
