//! Color for Gaussians that the views hardly show: that of their neighbors, and of those that
//! are like them.

use super::{field::Primitives, likeness::likely_colors};
use crate::splats::{ShField, nearest_neighbors, sh};

/// Neighbors that a Gaussian looks to.
const NEIGHBORS: usize = 8;

/// Difference in gray at which a neighbor's word has lost most of its weight: edges of
/// luma are where colors end.
const GRAY_RANGE: f64 = 0.1;

/// Weight of all neighbors together against the views, in pixels that show the
/// Gaussian fully.
const NEIGHBOR_PIXELS: f64 = 1.0;

/// Pixels that decide a color: what the views lack of them is left to likeness.
const DECIDED: f32 = 1.0;

/// The sweeps end once none moves a harmonic by more, in CIELAB units, or after so many:
/// every Gaussian holds on to a pixel's worth of its own, so that a few dozen do.
const SETTLED: f64 = 0.01;
const SWEEPS: usize = 200;

/// Draws the constant harmonic of `chroma` towards that of the neighbors in position
/// and gray, and of seen Gaussians that are like it in gray, texture, size and place: the less a
/// Gaussian is seen, the more.
///
/// `seen` is how far the views decide each Gaussian's color, in pixels that show it
/// fully. Minimizes `Σ seen_i |c_i - chroma_i|² + Σ (1 - seen_i)₊ |c_i - like_i|² +
/// Σ w_ij |c_i - c_j|²` by Gauss–Seidel sweeps. The higher harmonics of Gaussians seen less than
/// a pixel fade with `seen`.
///
/// # Panics
/// When the three have not the same number of Gaussians.
pub fn fill_unseen(primitives: &Primitives, chroma: &mut ShField, seen: &[f32]) {
    let count = primitives.count();
    assert_eq!(count, seen.len());
    let stride = 2 * sh::coefficient_count(chroma.degree);
    assert_eq!(chroma.coefficients.len(), count * stride);
    let neighbors = nearest_neighbors(&primitives.centers, NEIGHBORS);
    let found: Vec<[f64; 2]> = (chroma.coefficients.chunks_exact(stride))
        .map(|c| [f64::from(c[0]), f64::from(c[1])])
        .collect();
    let likely = likely_colors(primitives, &neighbors, &found, seen, DECIDED);
    // What each Gaussian holds on to, and how strongly.
    let own: Vec<([f64; 2], f64)> = (0..count)
        .map(|i| {
            let by_views = f64::from(seen[i]);
            let likeness = f64::from(DECIDED) - by_views;
            match likely[i] {
                Some(like) => {
                    let sum = [0, 1].map(|c| by_views * found[i][c] + likeness * like[c]);
                    (sum, f64::from(DECIDED))
                }
                None => (found[i].map(|v| by_views * v), by_views),
            }
        })
        .collect();
    let filled = relaxed(&own, &edges(primitives, &neighbors), found);
    for (i, out) in chroma.coefficients.chunks_exact_mut(stride).enumerate() {
        let sure = seen[i].min(1.0);
        out[0] = filled[i][0] as f32;
        out[1] = filled[i][1] as f32;
        for c in &mut out[2..] {
            *c *= sure;
        }
    }
}

/// Neighbors of each Gaussian, and what their word weighs; both ends weigh an edge alike, so that
/// sweeps descend one energy.
fn edges(primitives: &Primitives, neighbors: &[Vec<u32>]) -> Vec<Vec<(u32, f64)>> {
    let gray = |i: usize| sh::C0 * f64::from(primitives.luma[i]);
    let mut edges: Vec<Vec<(u32, f64)>> = vec![Vec::new(); neighbors.len()];
    for (i, others) in neighbors.iter().enumerate() {
        for &j in others {
            let apart = (gray(i) - gray(j as usize)) / GRAY_RANGE;
            let weight = NEIGHBOR_PIXELS / NEIGHBORS as f64 * (-apart * apart).exp();
            edges[i].push((j, 0.5 * weight));
            edges[j as usize].push((i as u32, 0.5 * weight));
        }
    }
    edges
}

/// Gauss–Seidel sweeps from `colors` until nothing moves: `own` are weighed sums and weights.
fn relaxed(
    own: &[([f64; 2], f64)],
    edges: &[Vec<(u32, f64)>],
    mut colors: Vec<[f64; 2]>,
) -> Vec<[f64; 2]> {
    let count = colors.len();
    for sweep in 0..SWEEPS {
        let mut moved = 0.0_f64;
        for k in 0..count {
            // There and back, or color would travel one way only.
            let i = if sweep % 2 == 0 { k } else { count - 1 - k };
            let (mut sum, mut weight) = own[i];
            for &(j, w) in &edges[i] {
                let other = colors[j as usize];
                sum = [sum[0] + w * other[0], sum[1] + w * other[1]];
                weight += w;
            }
            if weight > 0.0 {
                let new = sum.map(|s| s / weight);
                moved = (0..2).fold(moved, |most, c| most.max((new[c] - colors[i][c]).abs()));
                colors[i] = new;
            }
        }
        if moved < SETTLED {
            break;
        }
    }
    colors
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::splats::fixtures;

    fn row(grays: &[f32]) -> Primitives {
        Primitives::from(&fixtures::row(grays))
    }

    fn chroma(values: &[[f32; 2]]) -> ShField {
        ShField {
            degree: 0,
            channels: 2,
            coefficients: values.as_flattened().to_vec(),
        }
    }

    #[test]
    fn the_unseen_take_their_neighbors_color() {
        let luma = row(&[0.5; 12]);
        let mut values = [[30.0, -20.0]; 12];
        let mut seen = [100.0; 12];
        for i in 4..7 {
            (values[i], seen[i]) = ([-90.0, 90.0], 0.0);
        }
        let mut field = chroma(&values);
        fill_unseen(&luma, &mut field, &seen);
        for c in field.coefficients.chunks_exact(2) {
            assert!(
                (c[0] - 30.0).abs() < 1e-3 && (c[1] + 20.0).abs() < 1e-3,
                "{c:?}"
            );
        }
    }

    #[test]
    fn color_does_not_cross_an_edge_of_luma() {
        let mut grays = [0.2; 20];
        grays[10..].fill(0.9);
        let mut values = [[10.0, 0.0]; 20];
        values[10..].fill([-40.0, 0.0]);
        let mut seen = [50.0; 20];
        (seen[9], seen[10]) = (0.0, 0.0);
        (values[9], values[10]) = ([0.0; 2], [0.0; 2]);
        let mut field = chroma(&values);
        fill_unseen(&row(&grays), &mut field, &seen);
        assert!((field.of(9)[0] - 10.0).abs() < 0.5, "{:?}", field.of(9));
        assert!((field.of(10)[0] + 40.0).abs() < 0.5, "{:?}", field.of(10));
    }

    /// A meadow and a road, of which only the nearer halves are seen: the farther ones take the
    /// color of what is as light, though the road lies between.
    #[test]
    fn what_is_like_the_seen_takes_its_color() {
        let gray = |i: usize| if (10..30).contains(&i) { 0.8 } else { 0.3 };
        let luma = row(&(0..40).map(gray).collect::<Vec<f32>>());
        let seen: Vec<f32> = (0..40).map(|i| if i < 20 { 50.0 } else { 0.0 }).collect();
        let color = |i: usize| match i {
            0..10 => [-30.0, 40.0],
            10..20 => [2.0, 3.0],
            _ => [0.0; 2],
        };
        let mut field = chroma(&(0..40).map(color).collect::<Vec<_>>());
        fill_unseen(&luma, &mut field, &seen);
        for (i, expected) in [(23, [2.0, 3.0]), (35, [-30.0, 40.0])] {
            let found = field.of(i);
            for c in 0..2 {
                assert!((found[c] - expected[c]).abs() < 4.0, "{i}: {found:?}");
            }
        }
    }

    #[test]
    fn what_is_well_seen_stays() {
        let values: Vec<[f32; 2]> = (0..30).map(|i| [i as f32, -(i as f32)]).collect();
        let mut field = chroma(&values);
        fill_unseen(&row(&[0.5; 30]), &mut field, &[1e4; 30]);
        for (c, v) in field.coefficients.iter().zip(values.as_flattened()) {
            assert!((c - v).abs() < 0.01);
        }
        // Nobody sees anything: gray stays gray, and nothing is divided by zero.
        let mut nothing = chroma(&[[0.0; 2]; 3]);
        fill_unseen(&row(&[0.5; 3]), &mut nothing, &[0.0; 3]);
        assert_eq!(nothing.coefficients, [0.0; 6]);
    }
}
