//! Other axes than COLMAP's (x right, y down, z forward at the first camera, roughly): a scene
//! turned, or mirrored, by a change of axes.

use glam::{DMat3, DQuat, DVec3};

use super::{Splats, sh};

/// Old axis and sign of each new axis.
pub(super) type Turn = [(usize, f32); 3];

/// To y up: half a turn about z. splat-transform turns a `.ply` by the same for glTF.
pub(super) const Y_UP: Turn = [(0, -1.0), (1, -1.0), (2, 1.0)];

/// The same scene in other axes.
pub(super) fn turned(mut splats: Splats, turn: Turn) -> Splats {
    for mean in &mut splats.means {
        *mean = turn.map(|(from, sign)| sign * mean[from]);
    }
    // A Gaussian looks alike from opposite sides: it is mirrored by what turns it the other way.
    let rows = turn.map(|(from, sign)| DVec3::AXES[from] * f64::from(sign));
    let matrix = DMat3::from_cols_array_2d(&rows.map(|row| row.to_array())).transpose();
    let by = DQuat::from_mat3(&(matrix * matrix.determinant()));
    for quaternion in &mut splats.quats {
        let [w, x, y, z] = quaternion.map(f64::from);
        let DQuat { x, y, z, w } = by * DQuat::from_xyzw(x, y, z, w);
        *quaternion = [w, x, y, z].map(|value| value as f32);
    }
    let (terms, channels) = (
        sh::coefficient_count(splats.sh.degree),
        splats.sh.channels.max(1),
    );
    let matrix = of_harmonics(turn);
    for all in splats.sh.coefficients.chunks_exact_mut(terms * channels) {
        let before: Vec<f64> = all.iter().copied().map(f64::from).collect();
        for (place, value) in all.iter_mut().enumerate() {
            let (term, channel) = (place / channels, place % channels);
            let old = (0..terms).map(|k| matrix[k][term] * before[k * channels + channel]);
            *value = old.sum::<f64>() as f32;
        }
    }
    splats
}

/// `[old][new]`: how much of a new basis function the old one is. The integral of their product
/// over the sphere, by a rule that is exact for polynomials of degree 7.
fn of_harmonics(turn: Turn) -> [[f64; 16]; 16] {
    /// Gauss and Legendre's.
    const HEIGHTS: [(f64, f64); 2] = [
        (0.339_981_043_584_856_3, 0.652_145_154_862_546_1),
        (0.861_136_311_594_052_6, 0.347_854_845_137_453_9),
    ];
    const AROUND: usize = 8;
    let mut matrix = [[0.0; 16]; 16];
    for (z, weight) in HEIGHTS.into_iter().flat_map(|(z, w)| [(z, w), (-z, w)]) {
        for step in 0..AROUND {
            let share = std::f64::consts::TAU / AROUND as f64;
            let (sin, cos) = ((step as f64 + 0.5) * share).sin_cos();
            let flat = (1.0 - z * z).sqrt();
            let new = [flat * cos, flat * sin, z];
            let mut old = [0.0; 3];
            for ((from, sign), value) in turn.into_iter().zip(new) {
                old[from] = f64::from(sign) * value;
            }
            let [old, new] = [old, new].map(|direction| sh::basis(sh::MAX_DEGREE, direction));
            for (row, old) in matrix.iter_mut().zip(old) {
                for (sum, new) in row.iter_mut().zip(new) {
                    *sum += old * new * weight * share;
                }
            }
        }
    }
    // Zeros are to stay zeros.
    matrix.map(|row| row.map(|value| if value.abs() < 1e-9 { 0.0 } else { value }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::splats::fixtures::scattered;

    /// Color of a Gaussian in a direction, and its covariance.
    fn shown(splats: &Splats, direction: DVec3) -> (f64, DMat3) {
        let basis = sh::basis(3, direction.to_array());
        let coefficients = splats.sh.of(0).iter().step_by(3);
        let shown = basis
            .iter()
            .zip(coefficients)
            .map(|(y, &c)| y * f64::from(c));
        let [w, x, y, z] = splats.quats[0].map(f64::from);
        let turn = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w).normalize());
        let scales = DVec3::from(splats.log_scales[0].map(f64::from)).exp();
        let root = turn * DMat3::from_diagonal(scales);
        (shown.sum(), root * root.transpose())
    }

    #[test]
    fn a_turned_or_mirrored_scene_looks_the_same() {
        let scene = scattered(1, 3);
        let mirrored: Turn = [(0, -1.0), (1, 1.0), (2, 1.0)];
        let z_up: Turn = [(0, 1.0), (2, -1.0), (1, -1.0)];
        for turn in [Y_UP, mirrored, z_up] {
            let found = turned(scene.clone(), turn);
            let axes = turn.map(|(from, sign)| DVec3::AXES[from] * f64::from(sign));
            let matrix = DMat3::from_cols(axes[0], axes[1], axes[2]).transpose();
            let mean = |splats: &Splats| DVec3::from(splats.means[0].map(f64::from));
            assert_eq!(mean(&found), matrix * mean(&scene));
            for direction in [DVec3::new(0.48, -0.6, 0.64), DVec3::new(-0.6, 0.0, -0.8)] {
                let (color, shape) = shown(&scene, direction);
                let (same, turned) = shown(&found, matrix * direction);
                assert!((color - same).abs() < 1e-6, "{turn:?}");
                let expected = matrix * shape * matrix.transpose();
                assert!(turned.abs_diff_eq(expected, 1e-6), "{turn:?}");
            }
        }
    }
}
