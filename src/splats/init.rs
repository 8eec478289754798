//! Initial Gaussians from a point cloud: one a point, as wide as the gaps
//! between the points.

use super::{ShField, Splats, nearest_neighbor_distances, sh};

/// Neighbors that set the width of an initial Gaussian (Kerbl et al. 2023).
const NEIGHBORS: usize = 3;

/// Standard deviation of an initial Gaussian as a share of the distance to its
/// neighbors, and its opacity. 3DGS begins with 1 and 0.1: a fog that must first
/// find its surface. Smaller and denser ones stand on it from the start (figures
/// in docs/decisions/22-densification.md).
const INITIAL_WIDTH: f32 = 0.5;
const INITIAL_OPACITY: f64 = 0.5;

/// Smallest initial standard deviation, relative to the scene's extent: without
/// it duplicated points would be infinitely thin. The reference clamps the
/// squared distance at 1e-7 in scenes a few units wide, about the same.
const MIN_RELATIVE_SCALE: f32 = 1e-4;

/// One isotropic Gaussian a point: its standard deviation is half the root
/// mean square distance to the three nearest other points, its opacity 0.5, its
/// constant color the point's gray value.
///
/// `points` are `(position, gray)` in world units and sRGB-encoded `0..=1`;
/// points that are not finite are left out. `extent` is the scene's size in
/// world units, which bounds the standard deviations from below. The field has
/// one channel of degree `sh_degree` (at most [`sh::MAX_DEGREE`]).
pub fn initial_splats(points: &[([f32; 3], f32)], extent: f32, sh_degree: u32) -> Splats {
    let degree = sh_degree.min(sh::MAX_DEGREE);
    let finite = |(position, gray): &&([f32; 3], f32)| {
        gray.is_finite() && position.iter().all(|x| x.is_finite())
    };
    let (means, grays): (Vec<[f32; 3]>, Vec<f32>) = points.iter().filter(finite).copied().unzip();
    let count = means.len();

    let min_scale = (extent * MIN_RELATIVE_SCALE).max(f32::MIN_POSITIVE);
    let log_scales = nearest_neighbor_distances(&means, NEIGHBORS)
        .into_iter()
        .map(|distance| [(INITIAL_WIDTH * distance).max(min_scale).min(f32::MAX).ln(); 3])
        .collect();

    let mut field = ShField::zeros(count, degree, 1);
    let stride = sh::coefficient_count(degree);
    for (coefficients, gray) in field.coefficients.chunks_exact_mut(stride).zip(grays) {
        coefficients[0] = ((f64::from(gray) - 0.5) / sh::C0) as f32;
    }
    Splats {
        means,
        quats: vec![[1.0, 0.0, 0.0, 0.0]; count],
        log_scales,
        opacity_logits: vec![(INITIAL_OPACITY / (1.0 - INITIAL_OPACITY)).ln() as f32; count],
        sh: field,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn initial_values() {
        let points = [
            ([0.0, 0.0, 0.0], 1.0),
            ([2.0, 0.0, 0.0], 0.25),
            ([f32::NAN, 0.0, 0.0], 0.5),
        ];
        let splats = initial_splats(&points, 10.0, 3);
        assert_eq!(splats.len(), 2);
        assert_eq!(splats.means, [[0.0; 3], [2.0, 0.0, 0.0]]);
        assert_eq!(splats.quats, [[1.0, 0.0, 0.0, 0.0]; 2]);
        assert_eq!(splats.log_scales, [[1f32.ln(); 3]; 2]);
        let opacity = 1.0 / (1.0 + (-splats.opacity_logits[1]).exp());
        assert!((opacity - 0.5).abs() < 1e-6);
        assert_eq!((splats.sh.degree, splats.sh.channels), (3, 1));
        for (i, gray) in [1.0, 0.25].into_iter().enumerate() {
            let coefficients = splats.sh.of(i);
            assert!((0.5 + sh::C0 as f32 * coefficients[0] - gray).abs() < 1e-6);
            assert_eq!(coefficients[1..], [0.0; 15]);
        }
    }

    #[test]
    fn duplicates_get_the_smallest_scale() {
        let points = [([1.0; 3], 0.5); 5];
        let splats = initial_splats(&points, 10.0, 0);
        let expected = (10.0 * MIN_RELATIVE_SCALE).ln();
        assert_eq!(splats.log_scales, [[expected; 3]; 5]);
        for extent in [0.0, f32::NAN] {
            let scales = initial_splats(&points, extent, 0).log_scales;
            assert!(scales.iter().flatten().all(|s| s.is_finite()));
        }
    }
}
