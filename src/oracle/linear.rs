//! The few vector operations that the kernels share.

use super::Number;

/// `matrix · vector`.
pub fn apply<T: Number>(matrix: &[[f64; 3]; 3], vector: &[T; 3]) -> [T; 3] {
    matrix.map(|row| vector[0] * row[0] + vector[1] * row[1] + vector[2] * row[2])
}

/// The rotation matrix of a unit quaternion `w x y z`.
pub fn rotation<T: Number>([w, x, y, z]: [T; 4]) -> [[T; 3]; 3] {
    let one = T::one();
    [
        [
            one - (y * y + z * z) * 2.0,
            (x * y - w * z) * 2.0,
            (x * z + w * y) * 2.0,
        ],
        [
            (x * y + w * z) * 2.0,
            one - (x * x + z * z) * 2.0,
            (y * z - w * x) * 2.0,
        ],
        [
            (x * z - w * y) * 2.0,
            (y * z + w * x) * 2.0,
            one - (x * x + y * y) * 2.0,
        ],
    ]
}

/// `a · b`.
pub fn dot<T: Number, const N: usize>(a: &[T; N], b: &[T; N]) -> T {
    a.iter().zip(b).fold(T::zero(), |sum, (&a, &b)| sum + a * b)
}

/// The transpose of a 3 × 3 matrix.
pub fn transpose(matrix: [[f64; 3]; 3]) -> [[f64; 3]; 3] {
    [0, 1, 2].map(|i| matrix.map(|row| row[i]))
}
