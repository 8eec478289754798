//! Real spherical harmonics up to degree 3.

/// The highest degree that splat files and kernels know.
pub const MAX_DEGREE: u32 = 3;

/// The constant basis function Y₀₀ = 1 / (2 √π).
pub const C0: f64 = 0.282_094_791_773_878_14;

/// √(3 / 4π): the degree 1 functions are `C1` times a coordinate.
const C1: f64 = 0.488_602_511_902_919_9;

/// √(15 / 4π), √(5 / 16π), √(15 / 16π): xy-like, zonal and x² − y² of degree 2.
const C2: [f64; 3] = [
    1.092_548_430_592_079_2,
    0.315_391_565_252_520_05,
    0.546_274_215_296_039_6,
];

/// √(35 / 32π), √(105 / 4π), √(21 / 32π), √(7 / 16π), √(105 / 16π): orders
/// ±3, −2, ±1, 0 and 2 of degree 3.
const C3: [f64; 5] = [
    0.590_043_589_926_643_5,
    2.890_611_442_640_554,
    0.457_045_799_464_465_8,
    0.373_176_332_590_115_4,
    1.445_305_721_320_277,
];

/// The real spherical harmonics at a direction, in the order and with the
/// signs of 3D Gaussian Splatting files (Condon–Shortley phase kept: odd
/// orders are negative).
///
/// `direction` has unit length and points from the camera's center to the
/// Gaussian. Functions beyond `degree` are 0; a degree above [`MAX_DEGREE`]
/// counts as [`MAX_DEGREE`].
///
/// Source: Sloan, *Efficient Spherical Harmonic Evaluation*, JCGT 2013, with
/// the ordering of Kerbl et al. 2023.
pub fn basis(degree: u32, direction: [f64; 3]) -> [f64; 16] {
    let [x, y, z] = direction;
    let mut values = [0.0; 16];
    values[0] = C0;
    if degree >= 1 {
        values[1] = -C1 * y;
        values[2] = C1 * z;
        values[3] = -C1 * x;
    }
    let (xx, yy, zz) = (x * x, y * y, z * z);
    if degree >= 2 {
        values[4] = C2[0] * x * y;
        values[5] = -C2[0] * y * z;
        values[6] = C2[1] * (2.0 * zz - xx - yy);
        values[7] = -C2[0] * x * z;
        values[8] = C2[2] * (xx - yy);
    }
    if degree >= 3 {
        values[9] = -C3[0] * y * (3.0 * xx - yy);
        values[10] = C3[1] * x * y * z;
        values[11] = -C3[2] * y * (4.0 * zz - xx - yy);
        values[12] = C3[3] * z * (2.0 * zz - 3.0 * xx - 3.0 * yy);
        values[13] = -C3[2] * x * (4.0 * zz - xx - yy);
        values[14] = C3[4] * z * (xx - yy);
        values[15] = -C3[0] * x * (xx - 3.0 * yy);
    }
    values
}

/// The number of basis functions up to and including `degree`: `(degree + 1)²`.
pub const fn coefficient_count(degree: u32) -> usize {
    ((degree + 1) * (degree + 1)) as usize
}

/// One spherical-harmonic function per Gaussian and channel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ShField {
    /// Degree, 0 to [`MAX_DEGREE`].
    pub degree: u32,
    /// Channels: 1 luma, 2 chroma (a, b), 3 RGB.
    pub channels: usize,
    /// Coefficients `[N, (degree + 1)², channels]`, basis functions in the
    /// order of the reference splat files (the constant one first).
    pub coefficients: Vec<f32>,
}

impl ShField {
    /// A field of zeros for `count` Gaussians.
    pub fn zeros(count: usize, degree: u32, channels: usize) -> Self {
        Self {
            degree,
            channels,
            coefficients: vec![0.0; count * coefficient_count(degree) * channels],
        }
    }

    /// The field of a gray scene, of one channel, in three that are alike; others as they are.
    pub fn to_rgb(&self) -> Self {
        if self.channels != 1 {
            return self.clone();
        }
        let coefficients = self.coefficients.iter();
        Self {
            degree: self.degree,
            channels: 3,
            coefficients: coefficients.flat_map(|&value| [value; 3]).collect(),
        }
    }

    /// The same functions with coefficients up to at least `degree`; those that are new are zero.
    pub fn raised(&self, degree: u32) -> Self {
        let degree = self.degree.max(degree);
        let [old, new] =
            [self.degree, degree].map(|degree| coefficient_count(degree) * self.channels);
        let mut coefficients = Vec::with_capacity(self.coefficients.len() / old * new);
        for of_splat in self.coefficients.chunks_exact(old) {
            coefficients.extend_from_slice(of_splat);
            coefficients.resize(coefficients.len() + new - old, 0.0);
        }
        Self {
            degree,
            channels: self.channels,
            coefficients,
        }
    }

    /// Those of some Gaussians, in the order of `indices`.
    pub fn chosen(&self, indices: &[usize]) -> Self {
        let coefficients = indices.iter().flat_map(|&i| self.of(i));
        Self {
            coefficients: coefficients.copied().collect(),
            ..*self
        }
    }

    /// Coefficients of one Gaussian, `[(degree + 1)², channels]`.
    pub fn of(&self, index: usize) -> &[f32] {
        let stride = coefficient_count(self.degree) * self.channels;
        &self.coefficients[index * stride..(index + 1) * stride]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// Nodes and weights of the 8-point Gauss–Legendre rule on [-1, 1] (exact
    /// to degree 15), found by Newton's method on the Legendre polynomial.
    fn gauss_legendre() -> Vec<(f64, f64)> {
        const POINTS: usize = 8;
        (0..POINTS)
            .map(|i| {
                let mut t = ((i as f64 + 0.75) / (POINTS as f64 + 0.5) * PI).cos();
                let mut slope = 0.0;
                for _ in 0..20 {
                    let (mut previous, mut value) = (1.0, t);
                    for n in 2..=POINTS {
                        let n = n as f64;
                        (previous, value) = (
                            value,
                            ((2.0 * n - 1.0) * t * value - (n - 1.0) * previous) / n,
                        );
                    }
                    slope = POINTS as f64 * (t * value - previous) / (t * t - 1.0);
                    t -= value / slope;
                }
                (t, 2.0 / ((1.0 - t * t) * slope * slope))
            })
            .collect()
    }

    #[test]
    fn basis_is_orthonormal() {
        const TURNS: usize = 16;
        let mut gram = [[0.0; 16]; 16];
        for (z, weight) in gauss_legendre() {
            let r = (1.0 - z * z).sqrt();
            for turn in 0..TURNS {
                let phi = 2.0 * PI * (turn as f64 + 0.3) / TURNS as f64;
                let y = basis(3, [r * phi.cos(), r * phi.sin(), z]);
                for i in 0..16 {
                    for j in 0..16 {
                        gram[i][j] += y[i] * y[j] * weight * 2.0 * PI / TURNS as f64;
                    }
                }
            }
        }
        for (i, row) in gram.iter().enumerate() {
            for (j, &value) in row.iter().enumerate() {
                let expected = if i == j { 1.0 } else { 0.0 };
                assert!((value - expected).abs() < 1e-12, "{i} {j}: {value}");
            }
        }
    }

    /// Orthonormality does not see signs or order; these values do. They follow
    /// from the polynomials at (1, 2, 2) / 3.
    #[test]
    fn signs_and_order() {
        let y = basis(3, [1.0 / 3.0, 2.0 / 3.0, 2.0 / 3.0]);
        let k = |square: f64| (square / PI).sqrt();
        let expected = [
            k(1.0 / 4.0),
            -k(3.0 / 4.0) * 2.0 / 3.0,
            k(3.0 / 4.0) * 2.0 / 3.0,
            -k(3.0 / 4.0) / 3.0,
            k(15.0 / 4.0) * 2.0 / 9.0,
            -k(15.0 / 4.0) * 4.0 / 9.0,
            k(5.0 / 16.0) * 3.0 / 9.0,
            -k(15.0 / 4.0) * 2.0 / 9.0,
            k(15.0 / 16.0) * -3.0 / 9.0,
            -k(35.0 / 32.0) * -2.0 / 27.0,
            k(105.0 / 4.0) * 4.0 / 27.0,
            -k(21.0 / 32.0) * 2.0 * 11.0 / 27.0,
            k(7.0 / 16.0) * 2.0 * -7.0 / 27.0,
            -k(21.0 / 32.0) * 11.0 / 27.0,
            k(105.0 / 16.0) * 2.0 * -3.0 / 27.0,
            -k(35.0 / 32.0) * -11.0 / 27.0,
        ];
        for (i, (value, expected)) in y.iter().zip(expected).enumerate() {
            assert!((value - expected).abs() < 1e-14, "{i}: {value} {expected}");
        }
    }

    #[test]
    fn a_lower_degree_is_a_prefix() {
        let direction = [0.6, 0.0, -0.8];
        let full = basis(3, direction);
        for degree in 0..=3 {
            let count = coefficient_count(degree);
            let part = basis(degree, direction);
            assert_eq!(part[..count], full[..count]);
            assert!(part[count..].iter().all(|&v| v == 0.0));
        }
    }

    #[test]
    fn a_raised_field_is_the_same_function() {
        let field = ShField {
            degree: 0,
            channels: 3,
            coefficients: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0],
        };
        let raised = field.raised(2);
        assert_eq!((raised.degree, raised.coefficients.len()), (2, 54));
        assert_eq!(raised.of(1)[..4], [4.0, 5.0, 6.0, 0.0]);
        assert_eq!(raised.raised(1), raised);
    }

    #[test]
    fn coefficients_of_one_gaussian() {
        let mut field = ShField::zeros(3, 1, 2);
        field.coefficients[8] = 5.0;
        assert_eq!(field.coefficients.len(), 24);
        assert_eq!(field.of(1), [5.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    }
}
