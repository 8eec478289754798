//! Color arithmetic: sRGB, CIELAB, color differences and the display gamut.
//!
//! Everything is in `f64`. Encoded sRGB values are in `[0, 1]`; Lab is
//! `[L*, a*, b*]` with `L*` in `[0, 100]`, under D65.

mod delta_e;
mod gamut;
mod gray;
mod lab;
mod srgb;

pub use delta_e::ciede2000;
pub use gamut::gamut_map_lab;
pub use gray::{GrayTable, gray_from_rgb, gray_to_lightness};
pub use lab::{lab_to_linear, lab_to_srgb, linear_to_lab, srgb_to_lab};
pub use srgb::{linear_to_srgb, srgb_to_linear};
