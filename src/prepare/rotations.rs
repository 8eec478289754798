//! Rotations and focal lengths of photos that were taken from one place.
//!
//! A pixel x of photo i is seen in photo j at π(K_j R_j R_iᵀ K_i⁻¹ x): no depth is in it (Hartley
//! and Zisserman, *Multiple View Geometry*, 8.4; Brown and Lowe 2007 adjust panoramas alike).
//! Levenberg and Marquardt's method minimizes the squared distances to the matches, weighed
//! by Cauchy's weights, over rotations R = exp(ω)·R and the logarithms of focal lengths.

use glam::{DMat3, DQuat, DVec2, DVec3};

/// Distance in pixels, of photos [`SIDE`] wide, at which a match has half its weight: features are
/// found to less than a pixel, and what moves is farther off.
const HALF_WEIGHT: f64 = 1.0;

/// Displacement, in pixels of photos [`SIDE`] wide, of most matches of a pair that has moved, and the
/// share of such pairs from which on only they count.
const MOVED: f64 = 2.0;
const FEW: f64 = 0.1;

/// Longer side in pixels of the photos that all such distances refer to.
pub(super) const SIDE: f64 = 640.0;

/// Matches of a pair that are taken, an even choice: more tell no more about three angles.
const MOST_MATCHES: usize = 60;

/// Matches of all pairs that are taken: with so many a step takes a tenth of a second.
const MOST_OF_ALL: usize = 100_000;

/// Steps at most, and the change of the loss, as a share of it, that ends them.
const STEPS: usize = 60;
const SETTLED: f64 = 1e-6;

/// Pull of all focal lengths to where they began, so that a camera that stands has one.
const PULL: f64 = 1.0;

/// Pull of neighboring photos' focal lengths to each other: of one lens, and of a zoom.
const ONE_LENS: f64 = 1e9;
const ZOOM: f64 = 1e3;

/// Parameters of a photo: three of its rotation, and the logarithm of its focal length.
const OF_PHOTO: usize = 4;

/// Two photos, and what both show, in pixels from their principal points.
#[derive(Clone, Debug)]
pub(super) struct Seen {
    pub photos: [usize; 2],
    pub places: Vec<[DVec2; 2]>,
}

/// Photos from one place.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Turned {
    /// From world to camera, of each photo.
    pub rotations: Vec<DMat3>,
    /// In pixels, of each photo.
    pub focals: Vec<f64>,
}

/// Distances between matches and where the photos' rotations put them, in pixels of photos
/// [`SIDE`] wide.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Residuals {
    pub median: f64,
    /// 80th percentile.
    pub most: f64,
}

impl Turned {
    /// Finds rotations of `count` photos that begin with a focal length in pixels, and are as
    /// many pixels wide or high; with `zooms` each has a focal length of its own. Photos are in the
    /// order in which they were taken.
    pub fn of(count: usize, seen: &[Seen], (focal, side): (f64, u32), zooms: bool) -> Self {
        let start = Self {
            rotations: vec![DMat3::IDENTITY; count],
            focals: vec![focal; count],
        };
        let most = (MOST_OF_ALL / seen.len().max(1)).clamp(4, MOST_MATCHES);
        let fewer: Vec<Seen> = seen.iter().map(|seen| seen.fewer(most)).collect();
        let problem = Problem {
            seen: &fewer,
            focal,
            scale: SIDE / f64::from(side),
            lens: if zooms { ZOOM } else { ONE_LENS },
        };
        let chained = problem.chained(start);
        problem.solved(chained)
    }

    /// Place in photo `to`, in pixels from its principal point, of one in photo `from`; `None`
    /// behind it.
    pub fn moved(&self, [from, to]: [usize; 2], place: DVec2) -> Option<DVec2> {
        let there = self.rotations[to] * self.direction(from, place);
        (there.z > 0.0).then(|| self.focals[to] * there.truncate() / there.z)
    }

    /// Direction in the world, of length 1, in which a photo shows a place.
    pub fn direction(&self, photo: usize, place: DVec2) -> DVec3 {
        let ray = (place / self.focals[photo]).extend(1.0).normalize();
        self.rotations[photo].transpose() * ray
    }

    /// Distances of the matches of photos `side` pixels wide or high; `None` without any. Pairs that
    /// show the same, as those of held frames, say nothing where others have moved.
    pub fn residuals(&self, seen: &[Seen], side: u32) -> Option<Residuals> {
        let scale = SIDE / f64::from(side);
        let has_moved = |seen: &&Seen| {
            let still = |[from, to]: &&[DVec2; 2]| scale * from.distance(*to) < MOVED;
            2 * seen.places.iter().filter(still).count() < seen.places.len()
        };
        let all_count = (seen.iter().filter(has_moved).count() as f64) < FEW * seen.len() as f64;
        let mut all: Vec<f64> = (seen.iter())
            .filter(|seen| all_count || has_moved(seen))
            .flat_map(|seen| seen.places.iter().map(|places| (seen.photos, places)))
            .map(|(photos, [from, to])| {
                let moved = self.moved(photos, *from);
                // A whole picture, where one is behind the camera.
                moved.map_or(SIDE, |at| (scale * at.distance(*to)).min(SIDE))
            })
            .collect();
        all.sort_by(f64::total_cmp);
        let at = |share: f64| all.get((share * (all.len() as f64 - 1.0)).round() as usize);
        Some(Residuals {
            median: *at(0.5)?,
            most: *at(0.8)?,
        })
    }
}

impl Seen {
    fn fewer(&self, most: usize) -> Self {
        let step = self.places.len().div_ceil(most).max(1);
        Self {
            photos: self.photos,
            places: self.places.iter().step_by(step).copied().collect(),
        }
    }
}

/// The least squares.
struct Problem<'a> {
    seen: &'a [Seen],
    /// Focal length to begin with, in pixels.
    focal: f64,
    /// Pixels of photos [`SIDE`] wide, of one here.
    scale: f64,
    /// Pull of neighbors' focal lengths to each other.
    lens: f64,
}

impl Problem<'_> {
    /// Each photo turned from the one before it, with which it has most matches.
    fn chained(&self, mut turned: Turned) -> Turned {
        let mut known = vec![false; turned.rotations.len()];
        for photo in 0..known.len() {
            let before = (self.seen.iter())
                .filter(|seen| seen.photos[1] == photo && known[seen.photos[0]])
                .max_by_key(|seen| seen.places.len());
            if let Some(seen) = before {
                turned.rotations[photo] = turned.rotations[seen.photos[0]];
                let one = Problem {
                    seen: std::slice::from_ref(seen),
                    ..*self
                };
                one.turn_last(&mut turned, photo);
            }
            known[photo] = true;
        }
        turned
    }

    /// Turns one photo alone.
    fn turn_last(&self, turned: &mut Turned, photo: usize) {
        for _ in 0..STEPS / 4 {
            let normal = self.normal(turned, photo..photo + 1);
            let mut matrix = normal.matrix;
            // Focal lengths stay.
            matrix[OF_PHOTO * 3 + 3] += ONE_LENS;
            let Some(step) = solved(matrix, &normal.right) else {
                return;
            };
            *turned = turned.stepped(photo..photo + 1, &step);
        }
    }

    /// Rotations and focal lengths of all.
    fn solved(&self, mut turned: Turned) -> Turned {
        let all = 0..turned.rotations.len();
        let mut damping = 1e-3;
        let mut loss = self.loss(&turned);
        for _ in 0..STEPS {
            let normal = self.normal(&turned, all.clone());
            let stepped = loop {
                let size = normal.right.len();
                let mut matrix = normal.matrix.clone();
                for k in 0..size {
                    let own = matrix[k * size + k];
                    matrix[k * size + k] += damping * own + 1e-9;
                }
                let next = solved(matrix, &normal.right)
                    .map(|step| turned.stepped(all.clone(), &step))
                    .filter(|next| self.loss(next) < loss);
                if next.is_some() || damping > 1e9 {
                    break next;
                }
                damping *= 10.0;
            };
            let Some(next) = stepped else { break };
            let now = self.loss(&next);
            turned = next;
            damping = (damping * 0.1).max(1e-9);
            let gain = (loss - now) / loss.max(f64::MIN_POSITIVE);
            loss = now;
            if gain < SETTLED {
                break;
            }
        }
        turned
    }

    /// Cauchy's loss of the matches, and the pulls.
    fn loss(&self, turned: &Turned) -> f64 {
        let square = HALF_WEIGHT * HALF_WEIGHT;
        let of_matches = self.seen.iter().flat_map(|seen| {
            seen.places.iter().map(|[from, to]| {
                let moved = turned.moved(seen.photos, *from);
                let off = moved.map_or(1e6, |at| self.scale * at.distance(*to));
                0.5 * square * (off * off / square).ln_1p()
            })
        });
        let logs: Vec<f64> = turned
            .focals
            .iter()
            .map(|f| (f / self.focal).ln())
            .collect();
        let apart = logs.windows(2).map(|pair| (pair[1] - pair[0]).powi(2));
        let pulled: f64 = logs.iter().map(|log| log * log).sum();
        of_matches.sum::<f64>() + 0.5 * (PULL * pulled + self.lens * apart.sum::<f64>())
    }

    /// Gauss and Newton's equations of a step of some photos.
    fn normal(&self, turned: &Turned, photos: std::ops::Range<usize>) -> Normal {
        let mut normal = Normal::of(photos.len());
        let at = |photo: usize| {
            photos
                .contains(&photo)
                .then(|| OF_PHOTO * (photo - photos.start))
        };
        let square = HALF_WEIGHT * HALF_WEIGHT;
        for seen in self.seen {
            let places = seen.photos.map(at);
            for [from, to] in &seen.places {
                let Some((off, slopes)) = turned.slopes(seen.photos, *from, *to) else {
                    continue;
                };
                let weight = self.scale.powi(2);
                let weight = weight / (1.0 + weight * off.length_squared() / square);
                normal.add(places, off, &slopes, weight);
            }
        }
        // The world may be turned: the first photo stays.
        if photos.len() > 1 {
            (0..3).for_each(|k| normal.add_to(k, k, 1e12));
        }
        let log = |photo: usize| (turned.focals[photo] / self.focal).ln();
        for photo in photos.clone() {
            let own = OF_PHOTO * (photo - photos.start) + 3;
            normal.add_to(own, own, PULL);
            normal.right[own] -= PULL * log(photo);
            if photos.contains(&(photo + 1)) {
                let next = own + OF_PHOTO;
                for (i, j, sign) in [
                    (own, own, 1.0),
                    (next, next, 1.0),
                    (own, next, -1.0),
                    (next, own, -1.0),
                ] {
                    normal.add_to(i, j, sign * self.lens);
                }
                let pull = self.lens * (log(photo + 1) - log(photo));
                normal.right[own] += pull;
                normal.right[next] -= pull;
            }
        }
        normal
    }
}

impl Turned {
    /// Where the match of a pair is off, and how that changes with each parameter of both photos.
    fn slopes(
        &self,
        [i, j]: [usize; 2],
        from: DVec2,
        to: DVec2,
    ) -> Option<(DVec2, [[DVec2; OF_PHOTO]; 2])> {
        let ray = (from / self.focals[i]).extend(1.0);
        let between = self.rotations[j] * self.rotations[i].transpose();
        let there = between * ray;
        if there.z <= 0.0 {
            return None;
        }
        let focal = self.focals[j];
        let at = focal * there.truncate() / there.z;
        let project =
            |d: DVec3| focal / there.z * (d.truncate() - there.truncate() * (d.z / there.z));
        let axes = [DVec3::X, DVec3::Y, DVec3::Z];
        let [ix, iy, iz] = axes.map(|axis| project(-(between * axis.cross(ray))));
        let [jx, jy, jz] = axes.map(|axis| project(axis.cross(there)));
        // By ln f of the first: its ray's slope falls as f grows.
        let own = project(between * (-from / self.focals[i]).extend(0.0));
        Some((at - to, [[ix, iy, iz, own], [jx, jy, jz, at]]))
    }

    /// The same after a step.
    fn stepped(&self, photos: std::ops::Range<usize>, step: &[f64]) -> Self {
        let mut next = self.clone();
        for (photo, of_photo) in photos.zip(step.as_chunks::<OF_PHOTO>().0) {
            let [x, y, z, focal] = *of_photo;
            let turn = DMat3::from_quat(DQuat::from_scaled_axis(DVec3::new(x, y, z)));
            next.rotations[photo] = turn * self.rotations[photo];
            next.focals[photo] = self.focals[photo] * focal.clamp(-0.5, 0.5).exp();
        }
        next
    }
}

/// Normal equations, `[size, size]` and `[size]`.
struct Normal {
    matrix: Vec<f64>,
    right: Vec<f64>,
}

impl Normal {
    fn of(photos: usize) -> Self {
        let size = OF_PHOTO * photos;
        Self {
            matrix: vec![0.0; size * size],
            right: vec![0.0; size],
        }
    }

    fn add_to(&mut self, i: usize, j: usize, value: f64) {
        let size = self.right.len();
        self.matrix[i * size + j] += value;
    }

    /// Adds a match of weight `weight`, of photos whose parameters begin `at` some place, or stay.
    fn add(
        &mut self,
        at: [Option<usize>; 2],
        off: DVec2,
        slopes: &[[DVec2; OF_PHOTO]; 2],
        weight: f64,
    ) {
        let both = || (at.into_iter().zip(slopes)).filter_map(|(at, slopes)| Some((at?, slopes)));
        for (row, slopes) in both() {
            for (i, slope) in slopes.iter().enumerate() {
                self.right[row + i] -= weight * slope.dot(off);
                for (column, others) in both() {
                    for (j, other) in others.iter().enumerate() {
                        self.add_to(row + i, column + j, weight * slope.dot(*other));
                    }
                }
            }
        }
    }
}

/// Solution of a symmetric positive definite system by Cholesky's decomposition; `None` of another.
fn solved(mut matrix: Vec<f64>, right: &[f64]) -> Option<Vec<f64>> {
    let size = right.len();
    for i in 0..size {
        for j in 0..=i {
            let (before, own) = matrix.split_at(i * size);
            let row = match j < i {
                true => &before[j * size..j * size + j],
                false => &own[..j],
            };
            let sum = own[j] - row.iter().zip(&own[..j]).map(|(a, b)| a * b).sum::<f64>();
            matrix[i * size + j] = match i == j {
                true if sum > 0.0 => sum.sqrt(),
                true => return None,
                false => sum / matrix[j * size + j],
            };
        }
    }
    let mut found = right.to_vec();
    for i in 0..size {
        let row = &matrix[i * size..i * size + i];
        let sum: f64 = row.iter().zip(&found).map(|(a, b)| a * b).sum();
        found[i] = (found[i] - sum) / matrix[i * size + i];
    }
    for i in (0..size).rev() {
        let sum: f64 = (i + 1..size).map(|k| matrix[k * size + i] * found[k]).sum();
        found[i] = (found[i] - sum) / matrix[i * size + i];
    }
    Some(found)
}

#[cfg(test)]
#[path = "rotations_tests.rs"]
mod tests;
