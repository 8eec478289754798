//! Thresholds of the forward pass, and other settings of its accuracy.

use super::Number;
use super::constants::{ALPHA_MIN, BLUR, PLAYCANVAS_BLUR, PLAYCANVAS_TAIL, TRANSMITTANCE_MIN};

/// Thresholds, depth precision and falloff of the kernels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Numerics {
    /// The smallest opacity that is blended.
    pub alpha_min: f64,
    /// A pixel stops before its transmittance would fall below this.
    pub transmittance_min: f64,
    /// Highest bits of a depth, as `f32`, that decide the order; with all 32 depths are
    /// compared as `f64`.
    pub depth_bits: u32,
    /// Falloff of a Gaussian.
    pub falloff: Falloff,
}

/// Falloff of a Gaussian's opacity towards its border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Falloff {
    /// As a Gaussian.
    Gaussian,
    /// As PlayCanvas' engine has it.
    PlayCanvas,
}

impl Falloff {
    /// Share of a Gaussian's opacity at a power, ½ dᵀ Σ⁻¹ d.
    pub fn at<T: Number>(self, power: T) -> T {
        match self {
            Self::Gaussian => (-power).exp(),
            Self::PlayCanvas => ((-power).exp() - PLAYCANVAS_TAIL) / (1.0 - PLAYCANVAS_TAIL),
        }
    }

    /// Added to both variances of the screen covariance, in px².
    pub fn blur(self) -> f64 {
        match self {
            Self::Gaussian => BLUR,
            Self::PlayCanvas => PLAYCANVAS_BLUR,
        }
    }
}

impl Numerics {
    /// Thresholds of 3D Gaussian splatting.
    pub const DEFAULT: Self = Self {
        alpha_min: ALPHA_MIN,
        transmittance_min: TRANSMITTANCE_MIN,
        depth_bits: 32,
        falloff: Falloff::Gaussian,
    };

    /// The number that a depth is sorted by.
    pub fn depth_key(&self, depth: f64) -> f64 {
        if self.depth_bits == 32 {
            return depth;
        }
        f64::from((depth as f32).to_bits() >> (32 - self.depth_bits))
    }
}

impl Default for Numerics {
    fn default() -> Self {
        Self::DEFAULT
    }
}

/// The number of which nothing but sign, exponent and seven bits of fraction is kept: the
/// nearest such number, of two equally near ones the one with an even last bit. For
/// numbers in the normal range of `f32`.
pub fn upper_half(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let ulp = 2_f64.powi(value.abs().log2().floor() as i32 - 7);
    (value / ulp).round_ties_even() * ulp
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_the_nearest_of_their_kind() {
        for (value, half) in [
            (0.0, 0.0),
            (1.0, 1.0),
            (-1.004, -1.0078125),
            (1.00390625, 1.0),
            (1.01171875, 1.015625),
            (255.9, 256.0),
            (3e-30, 2.995_206_249_511_029e-30),
        ] {
            let rounded = upper_half(value);
            assert!(
                (rounded - half).abs() <= 1e-15 * half.abs(),
                "{value}: {rounded}"
            );
            assert_eq!(upper_half(rounded), rounded);
        }
    }

    #[test]
    fn sixteen_bits_of_depth_are_a_128th() {
        let numerics = Numerics {
            depth_bits: 16,
            ..Numerics::DEFAULT
        };
        let key = |depth| numerics.depth_key(depth);
        assert_eq!(key(2.0), key(2.0156));
        assert!(key(2.0) < key(2.0157) && key(1.999) < key(2.0));
        assert!(Numerics::DEFAULT.depth_key(2.0) < Numerics::DEFAULT.depth_key(2.0 + 1e-12));
    }
}
