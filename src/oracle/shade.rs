//! View-dependent color from spherical harmonics, as splat files define them.

use super::Number;
use super::constants::{SH_C0, SH_C1, SH_C2, SH_C3};
use super::linear::dot;
use super::view::View;

/// Mapping from the sum of harmonics to a color.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shading {
    /// Luma and RGB: plus 0.5, and nothing below zero.
    Offset,
    /// Chroma (a, b): the sum itself, in Lab units.
    Plain,
}

impl Shading {
    /// The mode that belongs to a number of channels: two is chroma.
    pub fn of_channels(channels: usize) -> Self {
        if channels == 2 {
            Self::Plain
        } else {
            Self::Offset
        }
    }
}

/// The unit vector from the camera's center `-Rᵀt` to `mean`, in world space.
pub fn direction<T: Number>(mean: &[T; 3], view: &View) -> [T; 3] {
    let center = view.center();
    let offset: [T; 3] = std::array::from_fn(|i| mean[i] - center[i]);
    let length = dot(&offset, &offset).sqrt();
    offset.map(|v| v / length)
}

/// All harmonics of degree 0 to 3 in a unit direction, in file order.
pub fn basis<T: Number>([x, y, z]: [T; 3]) -> [T; 16] {
    let (xx, yy, zz) = (x * x, y * y, z * z);
    [
        T::from(SH_C0),
        -y * SH_C1,
        z * SH_C1,
        -x * SH_C1,
        x * y * SH_C2[0],
        y * z * SH_C2[1],
        (zz * 2.0 - xx - yy) * SH_C2[2],
        x * z * SH_C2[3],
        (xx - yy) * SH_C2[4],
        y * (xx * 3.0 - yy) * SH_C3[0],
        x * y * z * SH_C3[1],
        y * (zz * 4.0 - xx - yy) * SH_C3[2],
        z * (zz * 2.0 - xx * 3.0 - yy * 3.0) * SH_C3[3],
        x * (zz * 4.0 - xx - yy) * SH_C3[4],
        z * (xx - yy) * SH_C3[5],
        x * (xx - yy * 3.0) * SH_C3[6],
    ]
}

/// The harmonics' sum, plus 0.5 under [`Shading::Offset`], before the clamp.
pub fn unclamped<T: Number, const C: usize>(
    mean: &[T; 3],
    sh: &[[T; C]],
    view: &View,
    shading: Shading,
) -> [T; C] {
    let harmonics = basis(direction(mean, view));
    let start = match shading {
        Shading::Offset => 0.5,
        Shading::Plain => 0.0,
    };
    let mut color = [T::from(start); C];
    for (coefficients, harmonic) in sh.iter().zip(harmonics) {
        for (channel, &coefficient) in color.iter_mut().zip(coefficients) {
            *channel += harmonic * coefficient;
        }
    }
    color
}

/// Color of one Gaussian seen from `view`; `sh` is `[K][C]`, K = 1, 4, 9 or 16.
pub fn shade<T: Number, const C: usize>(
    mean: &[T; 3],
    sh: &[[T; C]],
    view: &View,
    shading: Shading,
) -> [T; C] {
    let color = unclamped(mean, sh, view, shading);
    match shading {
        Shading::Plain => color,
        // At and below zero the derivative is zero; NaN stays visible.
        Shading::Offset => color.map(|c| if c.re() <= 0.0 { T::zero() } else { c }),
    }
}

#[cfg(test)]
mod tests {
    use super::super::{numerics::Numerics, seed};
    use super::*;
    use std::f64::consts::PI;

    fn view() -> View {
        View {
            rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            translation: [-1.0, -2.0, -3.0],
            fx: 50.0,
            fy: 50.0,
            cx: 24.0,
            cy: 20.0,
            width: 48,
            height: 40,
            near: 0.1,
            antialiased: false,
            numerics: Numerics::DEFAULT,
        }
    }

    #[test]
    fn degree_one_signs_along_the_axes() {
        // The camera is at (1, 2, 3). Order in the files: -y, z, -x.
        let sh = [[0.0], [1.0], [10.0], [100.0]];
        let along = |x, y, z| shade(&[x, y, z], &sh, &view(), Shading::Plain)[0] / SH_C1;
        assert!((along(6.0, 2.0, 3.0) + 100.0).abs() < 1e-12);
        assert!((along(1.0, 7.0, 3.0) + 1.0).abs() < 1e-12);
        assert!((along(1.0, 2.0, 8.0) - 10.0).abs() < 1e-12);
        assert!((along(1.0, 2.0, -8.0) + 10.0).abs() < 1e-12);
    }

    #[test]
    fn harmonics_are_orthonormal_on_the_sphere() {
        // Midpoints in z and in angle integrate these polynomials to 1e-6.
        let (rings, sectors) = (1200, 16);
        let mut products = [[0.0; 16]; 16];
        for ring in 0..rings {
            let z = -1.0 + (f64::from(ring) + 0.5) * 2.0 / f64::from(rings);
            let radius = (1.0 - z * z).sqrt();
            for sector in 0..sectors {
                let angle = (f64::from(sector) + 0.5) * 2.0 * PI / f64::from(sectors);
                let values = basis([radius * angle.cos(), radius * angle.sin(), z]);
                for (row, a) in products.iter_mut().zip(values) {
                    for (sum, b) in row.iter_mut().zip(values) {
                        *sum += a * b * 4.0 * PI / f64::from(rings * sectors);
                    }
                }
            }
        }
        for (i, row) in products.iter().enumerate() {
            for (j, &value) in row.iter().enumerate() {
                let expected = f64::from(u8::from(i == j));
                assert!((value - expected).abs() < 1e-4, "{i} {j}: {value}");
            }
        }
    }

    #[test]
    fn clamp_masks_value_and_derivative() {
        let mean = [1.0, 2.0, 8.0].map(super::super::lift);
        let dark = shade(&mean, &[[seed(-10.0)]], &view(), Shading::Offset)[0];
        assert_eq!((dark.re, dark.eps), (0.0, 0.0));
        let bright = shade(&mean, &[[seed(1.0)]], &view(), Shading::Offset)[0];
        assert!((bright.re - 0.5 - SH_C0).abs() < 1e-15);
        assert!((bright.eps - SH_C0).abs() < 1e-15);
        let chroma = shade(&mean, &[[seed(-10.0)]], &view(), Shading::Plain)[0];
        assert!((chroma.re + 10.0 * SH_C0).abs() < 1e-15);
    }
}
