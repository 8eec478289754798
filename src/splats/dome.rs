//! Gaussians far behind the scene, for what no point explains: the sky.

use glam::{DMat3, DQuat, DVec3};

use super::{ShField, Splats, sh};

/// Standard deviation of a Gaussian as a share of the distance to its neighbors on the
/// lattice: what two of them show half-way between them is even.
const WIDTH: f64 = 0.7;

/// Thickness as a share of the width: a shell, not a fog.
const THICKNESS: f64 = 0.1;

/// Opacity. A few overlap everywhere, and behind them there is nothing.
const OPACITY: f64 = 0.8;

/// A dome: `count` flat Gaussians on a sphere around `center`, of which those stay whose
/// place has a gray (encoded sRGB, 0 to 1).
///
/// Places are those of a Fibonacci lattice (González 2010, "Measurement of areas on a
/// sphere using Fibonacci and latitude-longitude lattices"), evenly spread. World units;
/// the field has one channel of degree `sh_degree` (at most [`sh::MAX_DEGREE`]).
pub fn dome(
    center: DVec3,
    radius: f64,
    count: usize,
    sh_degree: u32,
    mut gray_at: impl FnMut(DVec3) -> Option<f32>,
) -> Splats {
    let golden_angle = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let places = (0..count).filter_map(|i| {
        let z = 1.0 - (2 * i + 1) as f64 / count as f64;
        let (sin, cos) = (golden_angle * i as f64).sin_cos();
        let flat = (1.0 - z * z).sqrt();
        let direction = DVec3::new(flat * cos, flat * sin, z);
        let place = center + radius * direction;
        Some((place, direction, gray_at(place)?))
    });
    let degree = sh_degree.min(sh::MAX_DEGREE);
    // Each has an equal share of the sphere's area.
    let apart = radius * (4.0 * std::f64::consts::PI / count.max(1) as f64).sqrt();
    let across = (WIDTH * apart).ln() as f32;
    let along = (WIDTH * THICKNESS * apart).ln() as f32;
    let mut splats = Splats {
        sh: ShField::zeros(0, degree, 1),
        ..Splats::default()
    };
    for (place, direction, gray) in places {
        let (x, y) = direction.any_orthonormal_pair();
        let quat = DQuat::from_mat3(&DMat3::from_cols(x, y, direction)).as_quat();
        splats.means.push(place.as_vec3().to_array());
        splats.quats.push([quat.w, quat.x, quat.y, quat.z]);
        splats.log_scales.push([across, across, along]);
        let logit = (OPACITY / (1.0 - OPACITY)).ln();
        splats.opacity_logits.push(logit as f32);
        let mut harmonics = vec![0.0; sh::coefficient_count(degree)];
        harmonics[0] = ((f64::from(gray) - 0.5) / sh::C0) as f32;
        splats.sh.coefficients.extend(harmonics);
    }
    splats
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_even_and_as_far_apart_as_the_widths_assume() {
        let center = DVec3::new(1.0, -2.0, 3.0);
        let splats = dome(center, 50.0, 500, 0, |_| Some(0.25));
        assert_eq!(splats.len(), 500);
        let places: Vec<DVec3> = (splats.means.iter())
            .map(|mean| DVec3::from(mean.map(f64::from)) - center)
            .collect();
        let sum: DVec3 = places.iter().sum();
        assert!(sum.length() / 500.0 < 0.1, "{sum}");
        for (i, a) in places.iter().enumerate() {
            assert!((a.length() - 50.0).abs() < 1e-4);
            let others = places.iter().enumerate().filter(|(j, _)| *j != i);
            let nearest = others.map(|(_, b)| a.distance(*b)).fold(1e9, f64::min);
            let width = f64::from(splats.log_scales[i][0]).exp();
            assert!((0.9..1.6).contains(&(nearest / width)), "{nearest} {width}");
        }
        // Gray 0.25 = 0.5 + C0 · coefficient.
        let shown = 0.5 + sh::C0 * f64::from(splats.sh.coefficients[0]);
        assert!((shown - 0.25).abs() < 1e-6);
    }

    #[test]
    fn the_thin_axis_looks_at_the_center() {
        let splats = dome(DVec3::ZERO, 10.0, 40, 2, |_| Some(0.5));
        for (mean, [w, x, y, z]) in splats.means.iter().zip(&splats.quats) {
            let turn = glam::Quat::from_xyzw(*x, *y, *z, *w);
            let thin = turn * glam::Vec3::Z;
            let outward = glam::Vec3::from(*mean).normalize();
            assert!((thin - outward).length() < 1e-5);
        }
        assert_eq!(splats.sh.coefficients.len(), 40 * 9);
    }

    #[test]
    fn only_places_with_a_gray_have_one() {
        let half = dome(DVec3::ZERO, 10.0, 400, 0, |place| {
            (place.y < 0.0).then_some(0.5)
        });
        assert!((190..210).contains(&half.len()), "{}", half.len());
        assert!(half.means.iter().all(|mean| mean[1] < 0.0));
        assert!(dome(DVec3::ZERO, 10.0, 400, 0, |_| None).is_empty());
        assert!(dome(DVec3::ZERO, 10.0, 0, 0, |_| Some(0.5)).is_empty());
    }
}
