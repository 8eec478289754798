//! A view as plain numbers.

use super::numerics::Numerics;

/// A pinhole view; axes x right, y down, z forward.
#[derive(Clone, Debug)]
pub struct View {
    /// World-to-camera rotation, rows.
    pub rotation: [[f64; 3]; 3],
    /// World-to-camera translation.
    pub translation: [f64; 3],
    /// Focal lengths in pixels.
    pub fx: f64,
    /// Focal lengths in pixels.
    pub fy: f64,
    /// Principal point in pixels.
    pub cx: f64,
    /// Principal point in pixels.
    pub cy: f64,
    /// Image width in pixels.
    pub width: usize,
    /// Image height in pixels.
    pub height: usize,
    /// Gaussians are drawn beyond this depth only, in world units; 0 or more.
    pub near: f64,
    /// True if a Gaussian's opacity falls by what the blur spreads it.
    pub antialiased: bool,
    /// Thresholds and falloff.
    pub numerics: Numerics,
}

impl View {
    /// The camera's center in world space, `-Rᵀt`.
    pub fn center(&self) -> [f64; 3] {
        std::array::from_fn(|column| {
            -(0..3)
                .map(|row| self.rotation[row][column] * self.translation[row])
                .sum::<f64>()
        })
    }
}
