//! Scene, camera and median that several benchmarks share.

use gs_chroma::{capture::Camera, luma::frontal_camera};

pub use gs_chroma::luma::random_cloud as cloud;

/// A camera at the origin that looks along z, 16 by 9.
pub fn camera(width: u32) -> Camera {
    frontal_camera(width, width * 9 / 16)
}

/// The middle one of several values, the upper one of two.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
