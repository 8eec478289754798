//! From what a photo's strokes claim of the Gaussians that it shows to those that it does not.

use std::{collections::BinaryHeap, sync::Arc};

use super::region::{Front, claimed};
use crate::{
    chroma::field::Primitives,
    splats::{nearest_neighbors, sh},
};

/// Neighbors that a front runs to.
const NEIGHBORS: usize = 8;

/// Pixels that show a Gaussian fully, below which a photo does not tell whose it is.
const SHOWN: f32 = 0.5;

/// A Gaussian that is claimed by less does not send a front.
const SENDS: f32 = 0.5;

/// Gray levels, of 1, by which neighbors may differ for nothing, and that end a front beyond.
const GRAY: [f32; 2] = [0.04, 0.12];

/// Range of a front that nothing slows, as a share of the claimed Gaussians' distance from their
/// middle.
const REACH: f32 = 0.5;

/// Share of the claimed Gaussians that are no farther than this from their middle.
const INSIDE: f64 = 0.9;

/// A claim on a Gaussian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct StrokeWeight {
    /// The Gaussian.
    pub splat: u32,
    /// a, b at the middle lightness.
    pub color: [f32; 2],
    /// Claimed share of it, 0 to 1.
    pub alpha: f32,
}

/// Neighborhood and gray of the Gaussians.
pub(super) struct Cloud {
    primitives: Arc<Primitives>,
    grays: Vec<f32>,
    neighbors: Vec<Vec<u32>>,
}

impl Cloud {
    /// The cloud of a scene of one channel.
    pub fn of(primitives: &Arc<Primitives>) -> Self {
        let nearest = nearest_neighbors(&primitives.centers, NEIGHBORS);
        let mut neighbors = nearest.clone();
        // A front runs both ways.
        for (i, others) in (0..).zip(&nearest) {
            for &other in others {
                neighbors[other as usize].push(i);
            }
        }
        for others in &mut neighbors {
            others.sort_unstable();
            others.dedup();
        }
        Self {
            grays: (primitives.luma.iter())
                .map(|&luma| 0.5 + sh::C0 as f32 * luma)
                .collect(),
            primitives: primitives.clone(),
            neighbors,
        }
    }

    /// All that one photo's strokes claim. `sums` are, of each Gaussian, α a, α b, α and 1 summed
    /// over the photo's pixels by how much of it each shows.
    pub fn claims(&self, sums: &[[f32; 4]]) -> Vec<StrokeWeight> {
        let mut colors = vec![[0.0; 2]; sums.len()];
        let mut alphas = vec![0.0; sums.len()];
        let mut costs = vec![f32::INFINITY; sums.len()];
        let mut queue = BinaryHeap::new();
        for (i, &[a, b, alpha, shown]) in sums.iter().enumerate() {
            if shown >= SHOWN {
                costs[i] = 0.0;
                if alpha > 0.0 {
                    colors[i] = [a / alpha, b / alpha];
                    alphas[i] = (alpha / shown).min(1.0);
                }
                if alphas[i] > SENDS {
                    queue.push(Front {
                        cost: 0.0,
                        place: i,
                    });
                }
            }
        }
        let claimed_ones: Vec<usize> = queue.iter().map(|front| front.place).collect();
        let reach = REACH * self.size(&claimed_ones);
        while let Some(Front { cost, place }) = queue.pop() {
            if cost > costs[place] {
                continue;
            }
            for &other in &self.neighbors[place] {
                let other = other as usize;
                let cost = cost + self.step(place, other, reach);
                if cost < costs[other] && cost < 1.0 {
                    costs[other] = cost;
                    colors[other] = colors[place];
                    // What is handed on is the sender's.
                    alphas[other] = alphas[place];
                    queue.push(Front { cost, place: other });
                }
            }
        }
        (0..sums.len())
            .filter(|&i| alphas[i] > 0.0)
            .map(|i| StrokeWeight {
                splat: i as u32,
                color: colors[i],
                alpha: alphas[i] * claimed(costs[i]),
            })
            .collect()
    }

    fn step(&self, from: usize, to: usize, reach: f32) -> f32 {
        let apart = (self.grays[from] - self.grays[to]).abs();
        let edge = ((apart - GRAY[0]) / (GRAY[1] - GRAY[0])).max(0.0);
        let far = distance(self.primitives.centers[from], self.primitives.centers[to]);
        far / reach + edge
    }

    /// Distance of most of some Gaussians from their middle.
    fn size(&self, some: &[usize]) -> f32 {
        let middle = [0, 1, 2].map(|axis| {
            let mut values: Vec<f32> = some
                .iter()
                .map(|&i| self.primitives.centers[i][axis])
                .collect();
            quantile(&mut values, 0.5)
        });
        let mut far: Vec<f32> = (some.iter())
            .map(|&i| distance(self.primitives.centers[i], middle))
            .collect();
        quantile(&mut far, INSIDE)
    }
}

fn distance(a: [f32; 3], b: [f32; 3]) -> f32 {
    glam::Vec3::from(a).distance(glam::Vec3::from(b))
}

/// 0 of none.
fn quantile(values: &mut [f32], share: f64) -> f32 {
    let at = (share * values.len().saturating_sub(1) as f64) as usize;
    if values.is_empty() {
        return 0.0;
    }
    *values.select_nth_unstable_by(at, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::splats::fixtures::row;

    /// A photo shows the first `shown` of these and claims the first `red`.
    fn claims(grays: &[f32], red: usize, shown: usize) -> Vec<f32> {
        let sums: Vec<[f32; 4]> = (0..grays.len())
            .map(|i| match i {
                _ if i < red => [90.0, 30.0, 3.0, 3.0],
                _ if i < shown => [0.0, 0.0, 0.0, 3.0],
                _ => [0.0; 4],
            })
            .collect();
        let mut alphas = vec![0.0; grays.len()];
        for claim in Cloud::of(&Arc::new(Primitives::from(&row(grays)))).claims(&sums) {
            assert_eq!(claim.color, [30.0, 10.0]);
            alphas[claim.splat as usize] = claim.alpha;
        }
        alphas
    }

    #[test]
    fn what_the_photo_does_not_show_is_claimed_up_to_an_edge() {
        let mut grays = [0.3; 40];
        grays[24..].fill(0.6);
        let found = claims(&grays, 20, 20);
        assert!(found[..22].iter().all(|&alpha| alpha > 0.9), "{found:?}");
        assert!(found[24..].iter().all(|&alpha| alpha == 0.0), "{found:?}");
    }

    #[test]
    fn what_the_photo_shows_unclaimed_stays_so() {
        let found = claims(&[0.3; 40], 20, 30);
        assert!(found[20..30].iter().all(|&alpha| alpha == 0.0), "{found:?}");
        assert_eq!(claims(&[0.3; 10], 0, 10), [0.0; 10]);
        assert_eq!(claims(&[0.3; 10], 0, 0), [0.0; 10]);
    }
}
