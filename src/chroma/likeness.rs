//! Likely color of a Gaussian that no view shows: that of seen ones that are
//! like it in lightness, texture, size and place.

use super::field::Primitives;
use crate::splats::sh;

/// Seen Gaussians that are looked at, at most, an even choice: more find no better (with twice
/// as many the a/b error of what no view shows is within 3 %), and it is all against all.
const EXAMPLES: usize = 2048;

/// Examples are shown in more pixels than this.
const SEEN: f32 = 1.0;

/// Pixels beyond which an example is no surer.
const SURE: f32 = 20.0;

/// The weight of an example falls with this power of the squared distance; 2 is blunt, 6 no
/// better.
const FALL: i32 = 4;

/// Squared distance below which examples are as good as the same.
const SAME: f32 = 1e-3;

/// Gray levels, of 1, that tell as much as a factor of e in size or in contrast, or as being
/// as far apart as the scene is large: of a Gaussian itself, and of what surrounds it.
const GRAY: f64 = 0.1;
const AROUND: f64 = 0.15;

/// Contrast, as a standard deviation of gray, that noise has anyway.
const CONTRAST: f64 = 0.01;

/// Share of the Gaussians within what counts as the scene's size.
const INSIDE: f64 = 0.9;

/// Place, gray, gray around, contrast around, size: in units that count alike.
type Features = [f32; 7];

/// Features of each Gaussian. `neighbors` are those around it, `grays` of 0 to 1.
fn features(primitives: &Primitives, grays: &[f64], neighbors: &[Vec<u32>]) -> Vec<Features> {
    let count = primitives.count();
    let middle = |of: &dyn Fn(usize) -> f64, share: f64| {
        let mut values: Vec<f64> = (0..count).map(of).filter(|v| v.is_finite()).collect();
        let at = (share * values.len().saturating_sub(1) as f64) as usize;
        (!values.is_empty()).then(|| *values.select_nth_unstable_by(at, f64::total_cmp).1)
    };
    let center = [0, 1, 2].map(|axis| {
        let median = middle(&|i| f64::from(primitives.centers[i][axis]), 0.5);
        median.unwrap_or(0.0)
    });
    let off = |i: usize| [0, 1, 2].map(|k| f64::from(primitives.centers[i][k]) - center[k]);
    let far = |i: usize| off(i).iter().map(|v| v * v).sum::<f64>().sqrt();
    let extent = middle(&far, INSIDE).filter(|&far| far > 0.0).unwrap_or(1.0);
    (0..count)
        .map(|i| {
            let around = || neighbors[i].iter().map(|&j| grays[j as usize]);
            let all = || around().chain([grays[i]]);
            let whole = (neighbors[i].len() + 1) as f64;
            let mean = all().sum::<f64>() / whole;
            let variance = all().map(|gray| (gray - mean).powi(2)).sum::<f64>() / whole;
            let size = f64::from(primitives.log_sizes[i]);
            let [x, y, z] = off(i).map(|v| v / extent);
            let contrast = (variance.sqrt() + CONTRAST).ln();
            [x, y, z, grays[i] / GRAY, mean / AROUND, contrast, size].map(|v| v as f32)
        })
        .collect()
}

/// The likely a/b harmonic of the Gaussians that `seen`, in pixels, leaves open, those below
/// `least`, from what is `found` for the others; `None` for these, and where nothing is seen.
pub(super) fn likely_colors(
    primitives: &Primitives,
    neighbors: &[Vec<u32>],
    found: &[[f64; 2]],
    seen: &[f32],
    least: f32,
) -> Vec<Option<[f64; 2]>> {
    let grays: Vec<f64> = (primitives.luma.iter())
        .map(|&luma| 0.5 + sh::C0 * f64::from(luma))
        .collect();
    let features = features(primitives, &grays, neighbors);
    let known: Vec<usize> = (0..primitives.count())
        .filter(|&i| seen[i] > SEEN)
        .collect();
    let every = known.len().div_ceil(EXAMPLES).max(1);
    let examples: Vec<usize> = known.into_iter().step_by(every).collect();
    let likely = |i: usize| {
        let (mut sum, mut weights) = ([0.0; 2], 0.0);
        for &j in &examples {
            let apart = features[i].iter().zip(&features[j]);
            let squared = apart.map(|(a, b)| (a - b).powi(2)).sum::<f32>() + SAME;
            let weight = f64::from(seen[j].min(SURE)) * f64::from(squared).powi(-FALL);
            sum = [0, 1].map(|c| sum[c] + weight * found[j][c]);
            weights += weight;
        }
        // Too far from all, or without a place.
        (weights > 0.0).then(|| sum.map(|s| s / weights))
    };
    (0..primitives.count())
        .map(|i| (seen[i] < least).then(|| likely(i)).flatten())
        .collect()
}
