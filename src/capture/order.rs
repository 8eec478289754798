//! The order in which views are trained on.

/// The view of an iteration: every view once an epoch, in an order that the
/// seed and the epoch alone decide, so that an iteration can be repeated.
///
/// # Panics
/// Without views.
pub fn view_at(seed: u64, views: usize, iteration: usize) -> usize {
    let (epoch, place) = (iteration / views, iteration % views);
    let mut order: Vec<usize> = (0..views).collect();
    // The golden ratio's bits keep the epochs' seeds apart.
    let seed = seed ^ (epoch as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    fastrand::Rng::with_seed(seed).shuffle(&mut order);
    order[place]
}

#[cfg(test)]
mod tests {
    use super::view_at;

    #[test]
    fn every_epoch_shows_every_view_in_its_own_order() {
        let epoch = |e: usize| (0..7).map(|k| view_at(3, 7, 7 * e + k)).collect::<Vec<_>>();
        for e in 0..20 {
            let mut sorted = epoch(e);
            sorted.sort_unstable();
            assert_eq!(sorted, [0, 1, 2, 3, 4, 5, 6]);
        }
        assert!((1..20).any(|e| epoch(e) != epoch(0)));
    }
}
