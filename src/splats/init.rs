//! Initial Gaussians from a point cloud: one a point, as wide as the gaps
//! between the points.

use super::{ShField, Splats, nearest_neighbor_distances, sh};

/// Neighbors that set the width of an initial Gaussian (Kerbl et al. 2023).
const NEIGHBORS: usize = 3;

/// Standard deviation of an initial Gaussian as a share of the distance to its
/// neighbors, and its opacity. 3DGS begins with 1 and 0.1: a fog that must first
/// find its surface. Smaller and denser ones stand on it from the start (figures
/// in docs/decisions/training.md).
const INITIAL_WIDTH: f32 = 0.5;
const INITIAL_OPACITY: f64 = 0.5;

/// Smallest initial standard deviation, relative to the scene's extent: without
/// it duplicated points would be infinitely thin. The reference clamps the
/// squared distance at 1e-7 in scenes a few units wide, about the same.
const MIN_RELATIVE_SCALE: f32 = 1e-4;

/// A point to start a Gaussian from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InitialPoint {
    /// World coordinates.
    pub position: [f32; 3],
    /// sRGB-encoded, `0..=1`.
    pub gray: f32,
    /// Distance to its neighbors in world units; `None`: the root mean square
    /// of those to the three nearest other points.
    pub spacing: Option<f32>,
}

impl From<([f32; 3], f32)> for InitialPoint {
    /// A point at a position with a gray, without a spacing.
    fn from((position, gray): ([f32; 3], f32)) -> Self {
        Self {
            position,
            gray,
            spacing: None,
        }
    }
}

/// One isotropic Gaussian a point: its standard deviation is half its spacing,
/// its opacity 0.5, its constant color the point's gray value.
///
/// Points that are not finite are left out. `extent` is the scene's size in
/// world units, which bounds the standard deviations from below. The field has
/// one channel of degree `sh_degree` (at most [`sh::MAX_DEGREE`]).
pub fn initial_splats<P: Copy + Into<InitialPoint>>(
    points: &[P],
    extent: f32,
    sh_degree: u32,
) -> Splats {
    let degree = sh_degree.min(sh::MAX_DEGREE);
    let finite = |point: &InitialPoint| {
        point.gray.is_finite() && point.position.iter().all(|x| x.is_finite())
    };
    let points: Vec<InitialPoint> = (points.iter().copied().map(P::into))
        .filter(finite)
        .collect();
    let means: Vec<[f32; 3]> = points.iter().map(|point| point.position).collect();
    let count = means.len();

    let min_scale = (extent * MIN_RELATIVE_SCALE).max(f32::MIN_POSITIVE);
    let log_scales = nearest_neighbor_distances(&means, NEIGHBORS)
        .into_iter()
        .zip(&points)
        .map(|(distance, point)| point.spacing.unwrap_or(distance))
        .map(|distance| [(INITIAL_WIDTH * distance).max(min_scale).min(f32::MAX).ln(); 3])
        .collect();

    let mut field = ShField::zeros(count, degree, 1);
    let stride = sh::coefficient_count(degree);
    for (coefficients, point) in field.coefficients.chunks_exact_mut(stride).zip(&points) {
        coefficients[0] = ((f64::from(point.gray) - 0.5) / sh::C0) as f32;
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
    fn a_spacing_that_is_known_counts() {
        let mut points: [InitialPoint; 2] =
            [([0.0; 3], 0.5), ([2.0, 0.0, 0.0], 0.5)].map(InitialPoint::from);
        points[1].spacing = Some(6.0);
        let splats = initial_splats(&points, 10.0, 0);
        assert_eq!(splats.log_scales, [[1f32.ln(); 3], [3f32.ln(); 3]]);
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
