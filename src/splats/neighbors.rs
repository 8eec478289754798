//! Nearest neighbors in a cloud of points, by a bounding volume hierarchy.

use glam::{Vec3, Vec3A};
use obvhs::Boundable;
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, node::Bvh2Node};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use std::collections::HashMap;

/// Root mean square distance from each point to its `k` nearest other points
/// (all others where there are fewer), in the points' units.
///
/// A duplicate is another point at distance 0. The distance is 0 where there is
/// no other point, and for points that are not finite, which nobody has as a
/// neighbor either.
pub fn nearest_neighbor_distances(points: &[[f32; 3]], k: usize) -> Vec<f32> {
    let tree = PointTree::new(points);
    let mut of_place = vec![0.0; tree.places.len()];
    let mut search = Search::default();
    // Leaf after leaf: one search finds in the cache what the last one read.
    for place in tree.leaf_order() {
        let nearest = search.nearest(&tree, place, k, Counted::Points);
        let sum: f64 = nearest.iter().map(|&(squared, _)| squared).sum();
        of_place[place] = (sum / nearest.len().max(1) as f64).sqrt() as f32;
    }
    let distance = |place: &Option<usize>| place.map_or(0.0, |place| of_place[place]);
    tree.place_of.iter().map(distance).collect()
}

/// Up to `k` points at the nearest other places to each point, nearest first: of
/// points that lie in one place the first stands for all. None for points that are not
/// finite, nor are they anybody's neighbors.
pub fn nearest_neighbors(points: &[[f32; 3]], k: usize) -> Vec<Vec<u32>> {
    let tree = PointTree::new(points);
    let mut first_of = vec![u32::MAX; tree.places.len()];
    for (point, place) in (0..).zip(&tree.place_of) {
        if let Some(place) = place {
            first_of[*place] = first_of[*place].min(point);
        }
    }
    let mut of_place = vec![Vec::new(); tree.places.len()];
    let mut search = Search::default();
    for place in tree.leaf_order() {
        let nearest = search.nearest(&tree, place, k, Counted::Places);
        of_place[place] = nearest.iter().map(|&(_, other)| first_of[other]).collect();
    }
    let neighbors = |place: &Option<usize>| place.map_or(Vec::new(), |p| of_place[p].clone());
    tree.place_of.iter().map(neighbors).collect()
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

    /// All places, neighbors in space mostly one after the other.
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

/// Unit in which a search counts to `k`.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Counted {
    /// Points, each duplicate on its own.
    Points,
    /// Places, however many points lie there.
    Places,
}

/// Scratch memory of a neighbor search.
#[derive(Default)]
struct Search {
    /// Squared distances to the nearest points so far, ascending, and their places; at
    /// most `k`.
    nearest: Vec<(f64, usize)>,
    /// Nodes to visit with lower bounds of the squared distance to their points.
    stack: Vec<(u32, f64)>,
}

impl Search {
    /// The `k` nearest others of a place's points, with squared distance and place.
    fn nearest(
        &mut self,
        tree: &PointTree,
        place: usize,
        k: usize,
        counted: Counted,
    ) -> &[(f64, usize)] {
        let Self { nearest, stack } = self;
        let (position, duplicates) = tree.places[place];
        nearest.clear();
        if counted == Counted::Points {
            nearest.resize((duplicates - 1).min(k), (0.0, place));
        }
        let bounded = |node: u32| {
            let aabb = tree.bvh.nodes[node as usize].aabb();
            let inside = position.clamp(aabb.min.into(), aabb.max.into());
            (node, squared_distance(position, inside))
        };

        stack.push((0, 0.0));
        while let Some((index, lower_bound)) = stack.pop() {
            // The radius shrinks once k neighbors are known.
            if nearest.len() == k
                && nearest
                    .last()
                    .is_none_or(|&(worst, _)| lower_bound >= worst)
            {
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
            let count = match counted {
                Counted::Points => tree.places[other].1.min(k),
                Counted::Places => 1,
            };
            for _ in 0..count {
                let rank = nearest.partition_point(|&(known, _)| known <= distance);
                nearest.insert(rank, (distance, other));
                nearest.truncate(k);
            }
        }
        nearest
    }
}

fn squared_distance(a: Vec3, b: Vec3) -> f64 {
    a.as_dvec3().distance_squared(b.as_dvec3())
}

/// A hierarchy with tight boxes over distinct, finite positions.
///
/// The builder pairs neighbors by the surface of their common box, and takes
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
    fn neighbors_are_other_places_nearest_first() {
        let points = [
            [0.0; 3],
            [1.0, 0.0, 0.0],
            [0.0; 3],
            [0.0, 3.0, 0.0],
            [f32::NAN; 3],
            [0.0, 0.0, 7.0],
            [1.0, 0.0, 0.0],
        ];
        let found = nearest_neighbors(&points, 2);
        let expected: [&[u32]; 7] = [&[1, 3], &[0, 3], &[1, 3], &[0, 1], &[], &[0, 1], &[0, 3]];
        assert_eq!(found, expected);
        assert!(nearest_neighbors(&[], 2).is_empty());
        assert_eq!(
            nearest_neighbors(&[[1.0; 3]; 3], 2),
            vec![Vec::<u32>::new(); 3]
        );
    }

    #[test]
    fn neighbors_match_brute_force() {
        let points = cloud(300);
        let position = |i: usize| Vec3::from(points[i]);
        for (i, found) in nearest_neighbors(&points, 5).iter().enumerate() {
            let mut others: Vec<usize> = (0..points.len()).filter(|&j| j != i).collect();
            others.sort_by(|&a, &b| {
                let [a, b] = [a, b].map(|j| squared_distance(position(i), position(j)));
                a.total_cmp(&b)
            });
            let expected: Vec<u32> = others[..5].iter().map(|&j| j as u32).collect();
            assert_eq!(found, &expected);
        }
    }
}
