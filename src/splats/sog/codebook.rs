//! 256 values for all.

/// Entries of a codebook.
const ENTRIES: usize = 256;

/// Groups of neighboring values that are kept together, about: so many for equal numbers, and
/// so many for equal widths.
const GROUPS: usize = 2048;

/// Rounds in which entries and boundaries are brought in line, value by value.
const ROUNDS: usize = 8;

/// The 256 values, ascending, from which the sum of all squared differences is least: that of
/// groups of neighbors by dynamic programming, then brought in line with the values themselves.
///
/// Source of the recurrence and of its division: Grønlund et al., *Fast Exact k-Means, k-Medians
/// and Bregman Divergence Clustering in 1D*, 2017.
pub(super) fn codebook(values: &[f32]) -> Vec<f32> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f32::total_cmp);
    let mut distinct = sorted.clone();
    distinct.dedup();
    if distinct.len() <= ENTRIES {
        let last = distinct.last().copied().unwrap_or(0.0);
        distinct.resize(ENTRIES, last);
        return distinct;
    }
    let groups = Groups::of(&sorted);
    let mut entries = groups.cluster();
    let sums = prefix_sums(sorted.iter().map(|&value| f64::from(value)));
    for _ in 0..ROUNDS {
        let mut begin = 0;
        for k in 0..ENTRIES {
            let end = match entries.get(k + 1) {
                Some(&next) => {
                    let boundary = (entries[k] + next) / 2.0;
                    sorted.partition_point(|&value| f64::from(value) <= boundary)
                }
                None => sorted.len(),
            };
            if end > begin {
                entries[k] = (sums[end] - sums[begin]) / (end - begin) as f64;
                begin = end;
            }
        }
    }
    entries.into_iter().map(|entry| entry as f32).collect()
}

/// The index of the entry nearest to a value.
pub(super) fn nearest(codebook: &[f32], value: f32) -> u8 {
    let above = codebook.partition_point(|&entry| entry < value);
    let index = match (above.checked_sub(1), codebook.get(above)) {
        (Some(below), Some(entry)) if value - codebook[below] <= entry - value => below,
        (Some(below), None) => below,
        _ => above,
    };
    index.min(ENTRIES - 1) as u8
}

/// Sums of all before each place, and of all.
fn prefix_sums(values: impl Iterator<Item = f64>) -> Vec<f64> {
    let sums = values.scan(0.0, |sum, value| {
        *sum += value;
        Some(*sum)
    });
    std::iter::once(0.0).chain(sums).collect()
}

/// Neighboring values taken together, as prefix sums of their numbers and of their values.
struct Groups {
    counts: Vec<f64>,
    sums: Vec<f64>,
}

impl Groups {
    fn of(sorted: &[f32]) -> Self {
        let (first, last) = (sorted[0], sorted[sorted.len() - 1]);
        let widest = (f64::from(last) - f64::from(first)) / GROUPS as f64;
        let most = sorted.len().div_ceil(GROUPS);
        let mut groups: Vec<(f64, f64)> = Vec::new();
        let (mut begin, mut count) = (first, most);
        for &value in sorted {
            if count == most || f64::from(value) - f64::from(begin) > widest {
                groups.push((0.0, 0.0));
                (begin, count) = (value, 0);
            }
            if let Some((number, sum)) = groups.last_mut() {
                *number += 1.0;
                *sum += f64::from(value);
            }
            count += 1;
        }
        Self {
            counts: prefix_sums(groups.iter().map(|group| group.0)),
            sums: prefix_sums(groups.iter().map(|group| group.1)),
        }
    }

    fn len(&self) -> usize {
        self.counts.len() - 1
    }

    /// Gain of an entry for groups `begin..end` alone: the sum of squares that their mean takes
    /// away.
    fn gain(&self, begin: usize, end: usize) -> f64 {
        let sum = self.sums[end] - self.sums[begin];
        sum * sum / (self.counts[end] - self.counts[begin])
    }

    fn mean(&self, begin: usize, end: usize) -> f64 {
        (self.sums[end] - self.sums[begin]) / (self.counts[end] - self.counts[begin])
    }

    /// The best entries for the groups, ascending.
    fn cluster(&self) -> Vec<f64> {
        let n = self.len();
        let entries = ENTRIES.min(n);
        // Of the first `end` groups by one entry.
        let mut best: Vec<f64> = (0..=n)
            .map(|end| if end == 0 { 0.0 } else { self.gain(0, end) })
            .collect();
        // By one more entry each: where the last one begins.
        let mut begins: Vec<Vec<u32>> = Vec::new();
        for used in 1..entries {
            let mut next = vec![f64::NEG_INFINITY; n + 1];
            let mut begin = vec![0; n + 1];
            // Where the last entry begins grows with where it ends.
            let mut open = vec![(used + 1, n, used, n - 1)];
            while let Some((low, high, first, last)) = open.pop() {
                if low > high {
                    continue;
                }
                let end = low.midpoint(high);
                let last_here = last.min(end - 1);
                for (at, before) in (first..).zip(&best[first..=last_here]) {
                    let gain = before + self.gain(at, end);
                    if gain > next[end] {
                        next[end] = gain;
                        begin[end] = at as u32;
                    }
                }
                let at = begin[end] as usize;
                open.push((low, end - 1, first, at));
                open.push((end + 1, high, at, last));
            }
            best = next;
            begins.push(begin);
        }
        let mut end = n;
        let mut found: Vec<f64> = (begins.iter().rev())
            .map(|begin| {
                let at = begin[end] as usize;
                let mean = self.mean(at, end);
                end = at;
                mean
            })
            .collect();
        found.push(self.mean(0, end));
        found.reverse();
        let last = found[found.len() - 1];
        found.resize(ENTRIES, last);
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error(values: &[f32], codebook: &[f32]) -> f64 {
        let off = |&value: &f32| f64::from(value - codebook[usize::from(nearest(codebook, value))]);
        values.iter().map(|value| off(value).powi(2)).sum()
    }

    #[test]
    fn few_values_are_kept() {
        let values: Vec<f32> = (0..1000).map(|k| (k % 200) as f32 / 7.0).collect();
        let book = codebook(&values);
        assert_eq!((book.len(), error(&values, &book)), (256, 0.0));
        assert_eq!(codebook(&[]), [0.0; 256]);
        assert!(book.is_sorted());
    }

    #[test]
    fn it_is_better_than_even_steps_and_as_good_as_theory() {
        // Squares of even steps: dense near 0, sparse far away.
        let values: Vec<f32> = (0..20_000).map(|k| (k as f32 / 20_000.0).powi(3)).collect();
        let even: Vec<f32> = (0..256).map(|k| (k as f32 + 0.5) / 256.0).collect();
        let book = codebook(&values);
        let [ours, even] = [&book, &even].map(|book| error(&values, book));
        assert!(ours < 0.75 * even, "{ours} {even}");
        // Panter and Dite: (∫ p^⅓)³ / 12 k² for the density p of the values.
        let density_third = (0..100_000).map(|k| {
            let value = (f64::from(k) + 0.5) / 100_000.0;
            (value.powf(-2.0 / 3.0) / 3.0).cbrt() / 100_000.0
        });
        let bound = density_third.sum::<f64>().powi(3) / (12.0 * 256.0 * 256.0) * 20_000.0;
        assert!(ours < 1.05 * bound, "{ours} {bound}");
    }

    #[test]
    fn the_nearest_entry() {
        let mut book = vec![0.0, 1.0, 3.0];
        book.resize(256, 7.0);
        let found = [-5.0, 0.4, 0.6, 2.1, 6.0, 99.0].map(|value| nearest(&book, value));
        assert_eq!(found, [0, 0, 1, 2, 3, 255]);
    }
}
