//! The Pareto front.

/// Indices of the places `[seconds, merit]` that no other place beats in one and
/// equals in the other, fastest first; of equal places the first. Places that are
/// not finite are on no front.
pub fn front(places: &[[f64; 2]]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..places.len())
        .filter(|&i| places[i].iter().all(|v| v.is_finite()))
        .collect();
    let key = |&i: &usize| (places[i][0], -places[i][1]);
    order.sort_by(|a, b| {
        let (a, b) = (key(a), key(b));
        a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
    });
    let mut best = f64::NEG_INFINITY;
    order.retain(|&i| {
        let better = places[i][1] > best;
        best = best.max(places[i][1]);
        better
    });
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_nothing_beats() {
        let places = [
            [4.0, 24.0],
            [1.0, 20.0],
            [2.0, 19.0],
            [3.0, 23.0],
            [5.0, 24.0],
        ];
        assert_eq!(front(&places), [1, 3, 0]);
    }

    #[test]
    fn equal_places_count_once() {
        let places = [[1.0, 2.0], [1.0, 2.0], [1.0, 3.0], [1.0, 3.0]];
        assert_eq!(front(&places), [2]);
    }

    #[test]
    fn nothing_and_nonsense() {
        assert!(front(&[]).is_empty());
        let places = [[f64::NAN, 9.0], [1.0, f64::INFINITY], [2.0, 1.0]];
        assert_eq!(front(&places), [2]);
    }

    /// The definition, applied to every pair.
    #[test]
    fn against_the_definition() {
        let mut random = fastrand::Rng::with_seed(3);
        for _ in 0..200 {
            let places: Vec<[f64; 2]> = (0..random.usize(1..12))
                .map(|_| [random.u8(0..6), random.u8(0..6)].map(f64::from))
                .collect();
            let beats = |a: [f64; 2], b: [f64; 2]| a != b && a[0] <= b[0] && a[1] >= b[1];
            let mut expected: Vec<[f64; 2]> = (places.iter().copied())
                .filter(|&place| !places.iter().any(|&other| beats(other, place)))
                .collect();
            expected.sort_by(|a, b| a[0].total_cmp(&b[0]));
            expected.dedup();
            let found: Vec<[f64; 2]> = front(&places).into_iter().map(|i| places[i]).collect();
            assert_eq!(found, expected, "{places:?}");
        }
    }
}
