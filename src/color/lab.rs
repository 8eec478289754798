//! CIELAB (CIE 15:2004) of sRGB colors.

use super::srgb::{linear_to_srgb, srgb_to_linear};

/// Linear sRGB to CIE XYZ (ITU-R BT.709 primaries, D65), rows X, Y, Z.
///
/// These six-digit values are the ones OpenCV and scikit-image use, and hence
/// what published colorization networks were trained with.
const RGB_TO_XYZ: [[f64; 3]; 3] = [
    [0.412453, 0.357580, 0.180423],
    [0.212671, 0.715160, 0.072169],
    [0.019334, 0.119193, 0.950227],
];

/// Linear sRGB to XYZ relative to white.
///
/// Each row is divided by its sum, which makes the white point the image of
/// R = G = B = 1: grays then have no chroma, whatever digits a tabulated D65
/// would round away.
const RGB_TO_RELATIVE_XYZ: [[f64; 3]; 3] = rows_summing_to_one(RGB_TO_XYZ);

const RELATIVE_XYZ_TO_RGB: [[f64; 3]; 3] = inverse(RGB_TO_RELATIVE_XYZ);

/// The weights of linear R, G and B in relative luminance Y; they sum to 1.
pub(super) const LUMINANCE: [f64; 3] = RGB_TO_RELATIVE_XYZ[1];

/// Cube root of the value at which the CIE function turns from linear to cube root.
const DELTA: f64 = 6.0 / 29.0;

/// Encoded sRGB to Lab.
///
/// Takes any finite RGB; `[0, 1]³` gives `L*` in `[0, 100]`. R = G = B gives
/// `a* = b* = 0` to 1e-12.
pub fn srgb_to_lab(rgb: [f64; 3]) -> [f64; 3] {
    linear_to_lab(rgb.map(srgb_to_linear))
}

/// Lab to encoded sRGB, not clamped: components outside `[0, 1]` tell that no
/// display shows the color. See [`gamut_map_lab`](super::gamut_map_lab).
pub fn lab_to_srgb(lab: [f64; 3]) -> [f64; 3] {
    lab_to_linear(lab).map(linear_to_srgb)
}

/// Linear-light sRGB to Lab.
pub fn linear_to_lab(rgb: [f64; 3]) -> [f64; 3] {
    let [fx, fy, fz] = multiply(&RGB_TO_RELATIVE_XYZ, rgb).map(compress);
    [116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)]
}

/// Lab to linear-light sRGB, not clamped.
pub fn lab_to_linear([l, a, b]: [f64; 3]) -> [f64; 3] {
    let fy = (l + 16.0) / 116.0;
    let relative = [fy + a / 500.0, fy, fy - b / 200.0].map(expand);
    multiply(&RELATIVE_XYZ_TO_RGB, relative)
}

/// Relative luminance to `L*`.
pub(super) fn luminance_to_lightness(y: f64) -> f64 {
    116.0 * compress(y) - 16.0
}

/// The CIE function f: a cube root with a linear segment below `DELTA³`, where
/// the root's slope would grow without bound.
fn compress(t: f64) -> f64 {
    if t > DELTA * DELTA * DELTA {
        t.cbrt()
    } else {
        t / (3.0 * DELTA * DELTA) + 4.0 / 29.0
    }
}

/// The inverse of [`compress`].
fn expand(t: f64) -> f64 {
    if t > DELTA {
        t * t * t
    } else {
        3.0 * DELTA * DELTA * (t - 4.0 / 29.0)
    }
}

fn multiply(m: &[[f64; 3]; 3], [x, y, z]: [f64; 3]) -> [f64; 3] {
    m.map(|[p, q, r]| p * x + q * y + r * z)
}

const fn rows_summing_to_one(m: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let mut scaled = m;
    let mut row = 0;
    while row < 3 {
        let sum = m[row][0] + m[row][1] + m[row][2];
        scaled[row] = [m[row][0] / sum, m[row][1] / sum, m[row][2] / sum];
        row += 1;
    }
    scaled
}

/// The inverse of a 3×3 matrix by cofactors.
const fn inverse(m: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    let mut cofactor = [[0.0; 3]; 3];
    let mut i = 0;
    while i < 3 {
        let (i1, i2) = ((i + 1) % 3, (i + 2) % 3);
        let mut j = 0;
        while j < 3 {
            let (j1, j2) = ((j + 1) % 3, (j + 2) % 3);
            cofactor[j][i] = m[i1][j1] * m[i2][j2] - m[i1][j2] * m[i2][j1];
            j += 1;
        }
        i += 1;
    }
    let determinant =
        m[0][0] * cofactor[0][0] + m[0][1] * cofactor[1][0] + m[0][2] * cofactor[2][0];
    let mut row = 0;
    while row < 3 {
        let mut column = 0;
        while column < 3 {
            cofactor[row][column] /= determinant;
            column += 1;
        }
        row += 1;
    }
    cofactor
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_close(got: [f64; 3], want: [f64; 3], tolerance: f64) {
        for (g, w) in got.iter().zip(want) {
            assert!((g - w).abs() <= tolerance, "{got:?} instead of {want:?}");
        }
    }

    /// The usual published values; they scatter by 0.01 with the digits of the
    /// matrix in use.
    #[test]
    fn primaries() {
        assert_close(srgb_to_lab([1.0, 0.0, 0.0]), [53.24, 80.09, 67.20], 0.02);
        assert_close(srgb_to_lab([0.0, 1.0, 0.0]), [87.73, -86.18, 83.18], 0.02);
        assert_close(srgb_to_lab([0.0, 0.0, 1.0]), [32.30, 79.19, -107.86], 0.02);
    }

    #[test]
    fn grays_have_no_chroma() {
        for i in 0..=1000 {
            let g = f64::from(i) / 1000.0;
            let [_, a, b] = srgb_to_lab([g; 3]);
            assert!(a.abs() < 1e-12 && b.abs() < 1e-12, "{g}: {a} {b}");
        }
        assert_close(srgb_to_lab([1.0; 3]), [100.0, 0.0, 0.0], 1e-12);
        assert_close(srgb_to_lab([0.0; 3]), [0.0; 3], 1e-12);
    }

    #[test]
    fn lab_inverts_over_the_cube_and_beyond() {
        for i in 0..13_i32.pow(3) {
            let rgb = [i % 13, i / 13 % 13, i / 169].map(|k| f64::from(k) / 10.0 - 0.1);
            assert_close(lab_to_srgb(srgb_to_lab(rgb)), rgb, 1e-11);
        }
    }

    #[test]
    fn slope_at_black_is_finite_and_the_segments_meet() {
        let slope = compress(1e-9) - compress(0.0);
        assert!((slope / 1e-9 - 29.0 * 29.0 / 108.0).abs() < 1e-5);
        let knee = DELTA.powi(3);
        assert!((compress(knee * (1.0 + 1e-12)) - compress(knee)).abs() < 1e-11);
        assert!((luminance_to_lightness(knee) - 8.0).abs() < 1e-12);
    }

    #[test]
    fn matrices_are_inverse_and_keep_white() {
        for column in 0..3 {
            let mut unit = [0.0; 3];
            unit[column] = 1.0;
            let back = multiply(&RELATIVE_XYZ_TO_RGB, multiply(&RGB_TO_RELATIVE_XYZ, unit));
            assert_close(back, unit, 1e-14);
        }
        assert_close(multiply(&RGB_TO_RELATIVE_XYZ, [1.0; 3]), [1.0; 3], 1e-15);
        assert!((LUMINANCE.iter().sum::<f64>() - 1.0).abs() < 1e-15);
    }
}
