//! From COLMAP's axes (x right, y down, z forward at the first camera, roughly) to those with
//! y up: half a turn about z. splat-transform turns a `.ply` by the same for glTF.

use super::{Splats, sh};

/// The same scene, y up: x and y change their signs, in harmonics those of odd order.
pub(super) fn y_up(mut splats: Splats) -> Splats {
    for [x, y, _] in &mut splats.means {
        (*x, *y) = (-*x, -*y);
    }
    for quaternion in &mut splats.quats {
        // The turn has w 0 and z 1; it is multiplied from the left.
        let [w, x, y, z] = *quaternion;
        *quaternion = [-z, -y, x, w];
    }
    let (degree, channels) = (splats.sh.degree, splats.sh.channels);
    let terms = sh::coefficient_count(degree);
    let coefficients = splats.sh.coefficients.chunks_exact_mut(channels.max(1));
    for (index, channels) in coefficients.enumerate() {
        if is_of_odd_order(index % terms) {
            channels.iter_mut().for_each(|value| *value = -*value);
        }
    }
    splats
}

/// Whether half a turn about z changes the sign of a basis function: its order m, from -l to l
/// in each degree l, is odd.
fn is_of_odd_order(term: usize) -> bool {
    let degree = term.isqrt();
    // Odd where term - l² - l is.
    (term + degree * degree + degree) % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::splats::ShField;

    #[test]
    fn harmonics_turn_with_the_directions() {
        let [x, y, z] = [0.48, -0.6, 0.64];
        let before = sh::basis(3, [x, y, z]);
        let after = sh::basis(3, [-x, -y, z]);
        for term in 0..16 {
            let sign = if is_of_odd_order(term) { -1.0 } else { 1.0 };
            assert!((after[term] - sign * before[term]).abs() < 1e-12, "{term}");
        }
    }

    #[test]
    fn a_turned_scene_has_turned_axes() {
        let quaternion = [0.5_f32, -0.1, 0.7, 0.5];
        let splats = Splats {
            means: vec![[1.0, 2.0, 3.0]],
            quats: vec![quaternion],
            log_scales: vec![[0.0; 3]],
            opacity_logits: vec![0.0],
            sh: ShField::zeros(1, 1, 3),
        };
        let turned = y_up(splats);
        assert_eq!(turned.means, [[-1.0, -2.0, 3.0]]);
        let matrix = |[w, x, y, z]: [f32; 4]| {
            glam::Mat3::from_quat(glam::Quat::from_xyzw(x, y, z, w).normalize())
        };
        let half = glam::Mat3::from_diagonal(glam::Vec3::new(-1.0, -1.0, 1.0));
        let [found, wanted] = [matrix(turned.quats[0]), half * matrix(quaternion)];
        assert!(found.abs_diff_eq(wanted, 1e-6), "{found} {wanted}");
    }
}
