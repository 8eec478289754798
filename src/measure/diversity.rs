//! Effective number of colors in a picture.

use std::collections::BTreeMap;

/// Side, in CIELAB units, of the squares of the a, b plane that count as one color: colors in
/// neighboring squares are told apart at a glance.
const SQUARE: f32 = 5.0;

/// The effective number of colors in a picture: the exponential of Shannon's entropy of how
/// its pixels spread over squares of the a, b plane, five CIELAB units wide (the Hill number of
/// order one; M. O. Hill, *Diversity and Evenness*, Ecology 54, 1973).
///
/// A picture of one color has 1, of n equally frequent ones n; where all that differs has been
/// averaged to one brown it falls, though colorfulness may not. NaN counts as gray; no pixels
/// give 0.
pub fn color_diversity(ab: &[[f32; 2]]) -> f64 {
    let mut counts: BTreeMap<[i32; 2], usize> = BTreeMap::new();
    for ab in ab {
        // Squares are centered on gray, so that no border runs through it; NaN becomes 0.
        let square = ab.map(|v| (v / SQUARE).round() as i32);
        *counts.entry(square).or_default() += 1;
    }
    if ab.is_empty() {
        return 0.0;
    }
    let entropy: f64 = (counts.values())
        .map(|&count| {
            let share = count as f64 / ab.len() as f64;
            -share * share.ln()
        })
        .sum();
    entropy.exp()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_shares_count_one_each() {
        assert_eq!(color_diversity(&[]), 0.0);
        assert_eq!(color_diversity(&[[12.0, 40.0]; 9]), 1.0);
        // About gray there is no border.
        assert_eq!(color_diversity(&[[1.0, -1.0], [-1.0, 1.0]]), 1.0);
        let four = [[0.0, 0.0], [50.0, 0.0], [0.0, 50.0], [50.0, 50.0]];
        assert!((color_diversity(&four) - 4.0).abs() < 1e-12);
    }

    #[test]
    fn a_rare_color_counts_less() {
        let mut many = vec![[0.0, 0.0]; 99];
        many.push([60.0, 0.0]);
        let found = color_diversity(&many);
        assert!(found > 1.0 && found < 1.1, "{found}");
    }
}
