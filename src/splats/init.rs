//! Initial Gaussians from a point cloud: one a point, as wide as the gaps
//! between the points.

use super::{ShField, Splats, sh};
use glam::{Vec3, Vec3A};
use obvhs::Boundable;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, node::Bvh2Node};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use std::collections::HashMap;

/// Neighbours that set the width of an initial Gaussian (Kerbl et al. 2023).
const NEIGHBORS: usize = 3;

/// Standard deviation of an initial Gaussian as a share of the distance to its
/// neighbours, and its opacity. 3DGS begins with 1 and 0.1: a fog that must first
/// find its surface. Smaller and denser ones stand on it from the start (figures
/// in docs/decisions.md).
const INITIAL_WIDTH: f32 = 0.5;
const INITIAL_OPACITY: f64 = 0.5;

/// Smallest initial standard deviation, relative to the scene's extent: without
/// it duplicated points would be infinitely thin. The reference clamps the
/// squared distance at 1e-7 in scenes a few units wide, about the same.
const MIN_RELATIVE_SCALE: f32 = 1e-4;

/// One isotropic Gaussian a point: its standard deviation is half the root
/// mean square distance to the three nearest other points, its opacity 0.5, its
/// constant colour the point's gray value.
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

/// Root mean square distance from each point to its `k` nearest other points
/// (all others where there are fewer), in the points' units.
///
/// A duplicate is another point at distance 0. The distance is 0 where there is
/// no other point, and for points that are not finite, which nobody has as a
/// neighbour either.
pub fn nearest_neighbor_distances(points: &[[f32; 3]], k: usize) -> Vec<f32> {
    let tree = PointTree::new(points);
    let mut of_place = vec![0.0; tree.places.len()];
    let mut search = Search::default();
    // Leaf after leaf: one search finds in the cache what the last one read.
    for place in tree.leaf_order() {
        of_place[place] = search.root_mean_square_distance(&tree, place, k);
    }
    let distance = |place: &Option<usize>| place.map_or(0.0, |place| of_place[place]);
    tree.place_of.iter().map(distance).collect()
}

/// The distinct places of a point cloud in a bounding volume hierarchy.
struct PointTree {
    bvh: Bvh2,
    /// Distinct positions and how many points lie there.
    places: Vec<(Vec3, usize)>,
    /// For each point its index into `places`; none for a point that is not finite.
    place_of: Vec<Option<usize>>,
}

impl PointTree {
    fn new(points: &[[f32; 3]]) -> Self {
        let mut places: Vec<(Vec3, usize)> = Vec::with_capacity(points.len());
        let mut index_of = HashMap::with_capacity(points.len());
        let mut place_of = Vec::with_capacity(points.len());
        for &point in points {
            let position = Vec3::from(point);
            place_of.push(position.is_finite().then(|| {
                // Adding 0 turns -0 into 0, which has other bits.
                let bits = point.map(|x| (x + 0.0).to_bits());
                let place = *index_of.entry(bits).or_insert_with(|| {
                    places.push((position, 0));
                    places.len() - 1
                });
                places[place].1 += 1;
                place
            }));
        }
        let bvh = build(&places);
        Self {
            bvh,
            places,
            place_of,
        }
    }

    /// All places, neighbours in space mostly one after the other.
    fn leaf_order(&self) -> Vec<usize> {
        let mut places = Vec::with_capacity(self.places.len());
        let mut stack: Vec<u32> = (!self.places.is_empty()).then_some(0).into_iter().collect();
        while let Some(index) = stack.pop() {
            let node = &self.bvh.nodes[index as usize];
            if node.is_leaf() {
                places.push(self.place_in(node));
            } else {
                stack.extend([node.first_index, node.first_index + 1]);
            }
        }
        places
    }

    /// The place in a leaf; the builder makes leaves of one primitive.
    fn place_in(&self, leaf: &Bvh2Node) -> usize {
        self.bvh.primitive_indices[leaf.first_index as usize] as usize
    }
}

/// Scratch memory of a neighbour search.
#[derive(Default)]
struct Search {
    /// Ascending squared distances to the nearest points so far, at most `k`.
    nearest: Vec<f64>,
    /// Nodes to visit with lower bounds of the squared distance to their points.
    stack: Vec<(u32, f64)>,
}

impl Search {
    /// Root mean square distance from a place's points to their `k` nearest others.
    fn root_mean_square_distance(&mut self, tree: &PointTree, place: usize, k: usize) -> f32 {
        let Self { nearest, stack } = self;
        let (position, duplicates) = tree.places[place];
        nearest.clear();
        nearest.resize((duplicates - 1).min(k), 0.0);
        let bounded = |node: u32| {
            let aabb = tree.bvh.nodes[node as usize].aabb();
            let inside = position.clamp(aabb.min.into(), aabb.max.into());
            (node, squared_distance(position, inside))
        };

        stack.push((0, 0.0));
        while let Some((index, lower_bound)) = stack.pop() {
            // The radius shrinks once k neighbours are known.
            if nearest.len() == k && nearest.last().is_none_or(|&worst| lower_bound >= worst) {
                continue;
            }
            let node = &tree.bvh.nodes[index as usize];
            if !node.is_leaf() {
                // The nearer child is visited first, so it goes on the stack last.
                let [a, b] = [bounded(node.first_index), bounded(node.first_index + 1)];
                stack.extend(if a.1 < b.1 { [b, a] } else { [a, b] });
                continue;
            }
            let other = tree.place_in(node);
            if other == place {
                continue;
            }
            // The box of a leaf is its point, so the bound is the distance.
            let distance = lower_bound;
            for _ in 0..tree.places[other].1.min(k) {
                let rank = nearest.partition_point(|&known| known <= distance);
                nearest.insert(rank, distance);
                nearest.truncate(k);
            }
        }
        let sum: f64 = nearest.iter().sum();
        (sum / nearest.len().max(1) as f64).sqrt() as f32
    }
}

fn squared_distance(a: Vec3, b: Vec3) -> f64 {
    a.as_dvec3().distance_squared(b.as_dvec3())
}

/// A hierarchy with tight boxes over distinct, finite positions.
///
/// The builder pairs neighbours by the surface of their common box, and takes
/// quadratic time where all of those are equal: on a line along an axis (no
/// surface at all) and on evenly spaced points. So it is shown a copy of the
/// cloud in the unit cube (where nothing overflows) whose points have a slight
/// and irregular thickness; the true boxes are filled in afterwards.
fn build(places: &[(Vec3, usize)]) -> Bvh2 {
    /// Thickness in the unit cube: far below the spacing of any cloud that fits
    /// memory, well above the rounding of the cube's coordinates.
    const THICKNESS: f64 = 1e-6;

    struct Thickened(Aabb);
    impl Boundable for Thickened {
        fn aabb(&self) -> Aabb {
            self.0
        }
    }

    let Some(&(first, _)) = places.first() else {
        return Bvh2::default();
    };
    let fold = |f: fn(Vec3, Vec3) -> Vec3| places.iter().fold(first, |acc, &(p, _)| f(acc, p));
    let min = fold(Vec3::min).as_dvec3();
    let size = (fold(Vec3::max).as_dvec3() - min).max_element();
    let scale = if size > 0.0 { 1.0 / size } else { 0.0 };

    let boxes: Vec<Thickened> = places
        .iter()
        .enumerate()
        .map(|(i, &(position, _))| {
            // Multiples of the golden ratio modulo 1 (Weyl) are as irregular as needed here.
            let irregular = (i as f64 * 0.618_033_988_749_894_9).fract();
            let center = (position.as_dvec3() - min) * scale;
            let half = THICKNESS * (1.0 + irregular);
            Thickened(Aabb::new(
                (center - half).as_vec3a(),
                (center + half).as_vec3a(),
            ))
        })
        .collect();
    let indices = (0..places.len() as u32).collect();
    let mut bvh = PlocBuilder::with_capacity(places.len()).build(
        PlocSearchDistance::Low,
        &boxes,
        indices,
        // A few far outliers must not put the whole scene into one cell.
        SortPrecision::U128,
        0,
    );
    for node in &mut bvh.nodes {
        if node.is_leaf() {
            let place = bvh.primitive_indices[node.first_index as usize] as usize;
            node.set_aabb(Aabb::from_point(Vec3A::from(places[place].0)));
        }
    }
    bvh.refit_all();
    bvh
}

#[cfg(test)]
mod tests {
    use super::*;

    fn brute_force(points: &[[f32; 3]], k: usize) -> Vec<f32> {
        let position = |i: usize| Vec3::from(points[i]);
        (0..points.len())
            .map(|i| {
                let mut squared: Vec<f64> = (0..points.len())
                    .filter(|&j| j != i)
                    .map(|j| squared_distance(position(i), position(j)))
                    .collect();
                squared.sort_by(f64::total_cmp);
                squared.truncate(k);
                (squared.iter().sum::<f64>() / squared.len().max(1) as f64).sqrt() as f32
            })
            .collect()
    }

    /// Deterministic numbers in 0..1 (a linear congruential generator).
    fn random(count: usize) -> Vec<f32> {
        let mut state = 12345u64;
        let mut next = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        (0..count).map(|_| next()).collect()
    }

    fn cloud(count: usize) -> Vec<[f32; 3]> {
        random(3 * count).as_chunks().0.to_vec()
    }

    fn assert_matches(points: &[[f32; 3]]) {
        for k in [0, 1, 3, 7] {
            let found = nearest_neighbor_distances(points, k);
            assert_eq!(found, brute_force(points, k), "k = {k}");
        }
    }

    #[test]
    fn matches_brute_force() {
        assert_matches(&cloud(500));
    }

    #[test]
    fn matches_brute_force_on_degenerate_clouds() {
        let cloud = cloud(300);
        let coplanar: Vec<_> = cloud.iter().map(|p| [p[0], 2.0, p[2]]).collect();
        let collinear: Vec<_> = cloud.iter().map(|p| [3.0, 2.0, p[2]]).collect();
        let doubled: Vec<_> = cloud.iter().chain(&cloud[..100]).copied().collect();
        let grid: Vec<_> = (0..343)
            .map(|i| [(i % 7) as f32, (i / 7 % 7) as f32, (i / 49) as f32])
            .collect();
        let mut outliers = cloud.clone();
        outliers.extend([[1e6, 0.0, 0.0], [0.0, -3e7, 1.0]]);
        for points in [coplanar, collinear, doubled, grid, outliers] {
            assert_matches(&points);
        }
    }

    #[test]
    fn few_points() {
        assert!(nearest_neighbor_distances(&[], 3).is_empty());
        assert_eq!(nearest_neighbor_distances(&[[1.0; 3]], 3), [0.0]);
        let pair = [[0.0, 0.0, 0.0], [3.0, 4.0, 0.0]];
        assert_eq!(nearest_neighbor_distances(&pair, 3), [5.0, 5.0]);
        assert_eq!(nearest_neighbor_distances(&[[7.0; 3]; 9], 3), [0.0; 9]);
        assert_eq!(
            nearest_neighbor_distances(&[[0.0; 3], [-0.0; 3]], 1),
            [0.0; 2]
        );
    }

    #[test]
    fn known_distances() {
        // From the origin: 1, 2 and 2; the farther point does not count.
        let points = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.0, 2.0, 0.0],
            [0.0, 0.0, -2.0],
            [9.0, 9.0, 9.0],
        ];
        assert_eq!(
            nearest_neighbor_distances(&points, 3)[0],
            3f64.sqrt() as f32
        );
    }

    #[test]
    fn points_that_are_not_finite_stay_out() {
        let points = [
            [0.0; 3],
            [f32::NAN, 0.0, 0.0],
            [f32::INFINITY; 3],
            [2.0, 0.0, 0.0],
        ];
        assert_eq!(nearest_neighbor_distances(&points, 3), [2.0, 0.0, 0.0, 2.0]);
        let huge = [[f32::MAX; 3], [f32::MIN; 3]];
        assert!(nearest_neighbor_distances(&huge, 3)[0] > 0.0);
    }

    /// Clouds on which a naive use of the builder takes minutes.
    #[test]
    fn regular_clouds_build_fast() {
        // A power of two of equal steps has no rounding that would break the ties.
        let line: Vec<_> = (0..=16_384).map(|i| [i as f32, 0.0, 0.0]).collect();
        let grid: Vec<_> = (0..20_000)
            .map(|i| [(i % 200) as f32, 0.0, (i / 200) as f32])
            .collect();
        for points in [line, grid, vec![[1.0; 3]; 20_000]] {
            let start = std::time::Instant::now();
            nearest_neighbor_distances(&points, 3);
            let seconds = start.elapsed().as_secs_f64();
            assert!(seconds < 2.0, "{seconds} s");
        }
    }

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
