//! A few sets of harmonics for all Gaussians.
//!
//! Clusters are split in two, the one of the largest error first, until there are as many as
//! asked for; then points and centers are brought in line (Lloyd's k-means) among those that
//! come from one of the larger clusters, which are few enough to be compared all with all. No
//! chance is involved, nor the number of threads.

use std::{
    cmp::Reverse,
    collections::BinaryHeap,
    num::NonZero,
    sync::atomic::{AtomicUsize, Ordering},
    thread,
};

/// Values that are compared at once.
const LANES: usize = 8;

/// Clusters that are compared all with all.
const TOGETHER: usize = 256;

/// Rounds in which two halves of a cluster are brought in line.
const HALVING: usize = 4;

/// Rounds in which clusters are.
const ROUNDS: usize = 5;

/// Values of a point, filled up with zeros.
type Point = Vec<[f32; LANES]>;

/// The palette and the entry that each point uses.
pub(super) struct Palette {
    /// `[entries, dimensions]`.
    pub entries: Vec<Vec<f32>>,
    /// Entry of each point, `[N]`.
    pub labels: Vec<u16>,
}

/// At most `most` entries, up to 65536, for points `[N, dimensions]`.
pub(super) fn palette(points: &[f32], dimensions: usize, most: usize) -> Palette {
    let points: Vec<Point> = (points.chunks_exact(dimensions))
        .map(|values| {
            let lanes = values.chunks(LANES).map(|some| {
                let mut lane = [0.0; LANES];
                lane[..some.len()].copy_from_slice(some);
                lane
            });
            lanes.collect()
        })
        .collect();
    let mut labels = vec![0; points.len()];
    let mut entries = Vec::new();
    for group in in_line(&points, groups(&points, most.max(1))) {
        for (index, label) in group.labels {
            labels[index as usize] = (entries.len() + label) as u16;
        }
        entries.extend(group.centers.iter().map(|center| {
            let mut values = center.as_flattened().to_vec();
            values.truncate(dimensions);
            values
        }));
    }
    Palette { entries, labels }
}

/// Points that belong together.
struct Cluster {
    /// Sum of squared distances from the center.
    error: f64,
    center: Point,
    members: Vec<u32>,
    /// The first cluster with so many descendants at most that it is refined by itself.
    group: usize,
}

impl Cluster {
    fn of(points: &[Point], members: Vec<u32>, group: usize) -> Self {
        let center = mean(points, &members);
        let error = |&index: &u32| f64::from(distance(&points[index as usize], &center));
        Self {
            error: members.iter().map(error).sum(),
            center,
            members,
            group,
        }
    }
}

/// Clusters by the group that they are refined in.
fn groups(points: &[Point], most: usize) -> Vec<Vec<Cluster>> {
    if points.is_empty() {
        return Vec::new();
    }
    let everyone = (0..points.len() as u32).collect();
    let mut all = vec![Cluster::of(points, everyone, 0)];
    // The largest error first, as bits, which are in order as no error is negative; of equal ones
    // the oldest.
    let entry = |cluster: &Cluster, born| (cluster.error.to_bits(), Reverse(born));
    let mut open = BinaryHeap::from([entry(&all[0], 0)]);
    // So many that each has about as many descendants as are compared all with all.
    let group_count = most.div_ceil(TOGETHER);
    while open.len() < most {
        if open.len() == group_count {
            // From here on descendants keep to their group.
            let mut first: Vec<usize> = open.iter().map(|(_, Reverse(born))| *born).collect();
            first.sort_unstable();
            (first.into_iter().enumerate()).for_each(|(group, born)| all[born].group = group);
        }
        let Some(&(_, Reverse(worst))) = open.peek() else {
            break;
        };
        // The largest error may be none at all: so are the others.
        let Some(parts) = halves(points, &all[worst]) else {
            break;
        };
        open.pop();
        all[worst].members = Vec::new();
        for members in parts {
            let cluster = Cluster::of(points, members, all[worst].group);
            open.push(entry(&cluster, all.len()));
            all.push(cluster);
        }
    }
    // Those that were split have no members any more.
    all.retain(|cluster| !cluster.members.is_empty());
    all.sort_by_key(|cluster| cluster.group);
    let mut groups: Vec<Vec<Cluster>> = Vec::new();
    for cluster in all {
        match groups.last_mut() {
            Some(group) if group[0].group == cluster.group => group.push(cluster),
            _ => groups.push(vec![cluster]),
        }
    }
    groups
}

/// The members of a cluster in two, or none if they are all alike.
fn halves(points: &[Point], cluster: &Cluster) -> Option<[Vec<u32>; 2]> {
    let farthest = |from: &Point| {
        let distance = |&index: &u32| distance(&points[index as usize], from);
        // The first of several.
        let farther = |best: (f32, u32), index: &u32| match distance(index) {
            far if far > best.0 => (far, *index),
            _ => best,
        };
        let (far, index) = cluster.members.iter().fold((0.0, 0), farther);
        (far > 0.0).then(|| points[index as usize].clone())
    };
    let one = farthest(&cluster.center)?;
    let other = farthest(&one)?;
    let mut centers = [one, other];
    let mut parts = [Vec::new(), Vec::new()];
    for round in 0..HALVING {
        parts = cluster
            .members
            .iter()
            .fold([Vec::new(), Vec::new()], |mut parts, &index| {
                let [one, other] = centers
                    .each_ref()
                    .map(|c| distance(&points[index as usize], c));
                parts[usize::from(other < one)].push(index);
                parts
            });
        if parts.iter().any(Vec::is_empty) {
            return None;
        }
        if round + 1 < HALVING {
            centers = parts.each_ref().map(|part| mean(points, part));
        }
    }
    Some(parts)
}

/// A group of clusters, refined.
struct Refined {
    centers: Vec<Point>,
    /// Points and their places among the centers.
    labels: Vec<(u32, usize)>,
}

/// Refines every group, as many at once as there are processors.
fn in_line(points: &[Point], groups: Vec<Vec<Cluster>>) -> Vec<Refined> {
    let threads = thread::available_parallelism().map_or(1, NonZero::get);
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        loop {
            let at = next.fetch_add(1, Ordering::Relaxed);
            match groups.get(at) {
                Some(group) => done.push((at, refine(points, group))),
                None => return done,
            }
        }
    };
    let mut done = thread::scope(|scope| {
        let others: Vec<_> = (1..threads.min(groups.len()))
            .map(|_| scope.spawn(work))
            .collect();
        let mut done = work();
        for other in others {
            match other.join() {
                Ok(more) => done.extend(more),
                Err(panic) => std::panic::resume_unwind(panic),
            }
        }
        done
    });
    done.sort_unstable_by_key(|(at, _)| *at);
    done.into_iter().map(|(_, refined)| refined).collect()
}

fn refine(points: &[Point], group: &[Cluster]) -> Refined {
    let mut members: Vec<u32> = (group.iter())
        .flat_map(|cluster| &cluster.members)
        .copied()
        .collect();
    members.sort_unstable();
    let mut centers: Vec<Point> = group.iter().map(|cluster| cluster.center.clone()).collect();
    let mut labels = Vec::new();
    for round in 0..ROUNDS {
        let nearest = |&index: &u32| {
            let point = &points[index as usize];
            let nearer = |best: (f32, usize), (label, center): (usize, &Point)| match distance(
                point, center,
            ) {
                near if near < best.0 => (near, label),
                _ => best,
            };
            let (_, label) = centers.iter().enumerate().fold((f32::INFINITY, 0), nearer);
            (index, label)
        };
        let found: Vec<(u32, usize)> = members.iter().map(nearest).collect();
        let settled = found == labels;
        labels = found;
        if settled || round + 1 == ROUNDS {
            break;
        }
        let mut parts = vec![Vec::new(); centers.len()];
        for &(index, label) in &labels {
            parts[label].push(index);
        }
        for (center, part) in centers.iter_mut().zip(&parts) {
            if !part.is_empty() {
                *center = mean(points, part);
            }
        }
    }
    Refined { centers, labels }
}

/// The mean of some points, of which there is one at least.
fn mean(points: &[Point], members: &[u32]) -> Point {
    let lanes = points[members[0] as usize].len();
    let mut sums = vec![[0.0_f64; LANES]; lanes];
    for &index in members {
        for (sum, lane) in sums.iter_mut().zip(&points[index as usize]) {
            for (sum, value) in sum.iter_mut().zip(lane) {
                *sum += f64::from(*value);
            }
        }
    }
    let count = members.len() as f64;
    let mean = |sum: [f64; LANES]| sum.map(|sum| (sum / count) as f32);
    sums.into_iter().map(mean).collect()
}

/// The squared distance of two points.
fn distance(a: &[[f32; LANES]], b: &[[f32; LANES]]) -> f32 {
    let mut sums = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..LANES {
            let difference = a[lane] - b[lane];
            sums[lane] += difference * difference;
        }
    }
    sums.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(points: &[f32], dimensions: usize, palette: &Palette) -> f64 {
        let points = points.chunks_exact(dimensions).zip(&palette.labels);
        let off = points.flat_map(|(point, &label)| {
            let entry = &palette.entries[usize::from(label)];
            point
                .iter()
                .zip(entry)
                .map(|(p, e)| f64::from(p - e).powi(2))
        });
        off.sum()
    }

    fn scattered(count: usize, dimensions: usize) -> Vec<f32> {
        let mut random = fastrand::Rng::with_seed(7);
        (0..count * dimensions)
            .map(|_| random.f32() - 0.5)
            .collect()
    }

    #[test]
    fn clusters_that_are_apart_are_found() {
        let mut points = scattered(600, 9);
        for (index, point) in points.chunks_exact_mut(9).enumerate() {
            point.iter_mut().for_each(|value| *value *= 0.01);
            point[index % 9] += (index % 3) as f32;
        }
        let palette = palette(&points, 9, 12);
        assert!(palette.entries.len() <= 12);
        // Of values spread over 0.01: a twelfth of its square each.
        let within = 0.01_f64.powi(2) / 12.0 * points.len() as f64;
        let error = error(&points, 9, &palette);
        assert!(error < 1.1 * within, "{error} {within}");
    }

    #[test]
    fn more_entries_are_nearer_and_enough_are_exact() {
        let points = scattered(900, 24);
        let errors = [1, 30, 300, 2000].map(|most| {
            let palette = palette(&points, 24, most);
            assert!(palette.entries.len() <= most);
            error(&points, 24, &palette)
        });
        assert!(
            errors.windows(2).all(|pair| pair[1] < pair[0]),
            "{errors:?}"
        );
        assert_eq!(errors[3], 0.0);
        // Points that are alike need one entry, and none need none.
        assert_eq!(palette(&[0.5; 90], 9, 8).entries, [[0.5; 9]]);
        assert!(palette(&[], 9, 8).entries.is_empty());
    }
}
