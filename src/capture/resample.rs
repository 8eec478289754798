//! Making pictures smaller.

/// Downscales an interleaved 8-bit picture of `N` channels by area averaging:
/// each new pixel is the mean of the old ones it covers, those on its border
/// in proportion.
///
/// The mean is taken over encoded values, not in linear light, as OpenCV and
/// PIL do it and hence as the pictures of published results were made.
/// `from` and `to` are width and height; `to` must not exceed `from`.
pub fn downscale<const N: usize>(
    picture: &[[u8; N]],
    from: [usize; 2],
    to: [usize; 2],
) -> Vec<[u8; N]> {
    if from == to {
        return picture.to_vec();
    }
    let means = average(from, to, |i| picture[i].map(f32::from));
    means.iter().map(|mean| mean.map(rounded)).collect()
}

/// [`downscale`] of pixels that count differently, and of what they count, 0 to 255:
/// each new pixel is the mean of what counts, so that nothing that does not spills
/// over the border. Where nothing counts it is the plain mean.
pub(super) fn downscale_masked<const N: usize>(
    picture: &[[u8; N]],
    mask: &[u8],
    from: [usize; 2],
    to: [usize; 2],
) -> (Vec<[u8; N]>, Vec<u8>) {
    let counts = average(from, to, |i| [f32::from(mask[i])]);
    let plain = average(from, to, |i| picture[i].map(f32::from));
    let counted = average(from, to, |i| {
        picture[i].map(|v| f32::from(v) * f32::from(mask[i]))
    });
    let pixels = counts.iter().zip(plain.iter().zip(&counted));
    let smaller = pixels.map(|(&[count], (plain, counted))| match count > 0.0 {
        true => counted.map(|sum| rounded(sum / count)),
        false => plain.map(rounded),
    });
    (
        smaller.collect(),
        counts.iter().map(|&[count]| rounded(count)).collect(),
    )
}

/// `value` to the nearest of 0 to 255.
fn rounded(value: f32) -> u8 {
    value.round() as u8
}

/// Means over the old pixels, whose values `at` gives.
fn average<const N: usize>(
    from: [usize; 2],
    to: [usize; 2],
    at: impl Fn(usize) -> [f32; N],
) -> Vec<[f32; N]> {
    let columns = coverage(from[0], to[0]);
    let rows = coverage(from[1], to[1]);
    let mut smaller = Vec::with_capacity(to[0] * to[1]);
    let mut blended = vec![[0.0; N]; from[0]];
    for span in &rows {
        blended.fill([0.0; N]);
        for (y, weight) in span.pixels() {
            for (x, sum) in blended.iter_mut().enumerate() {
                add(sum, &at(y * from[0] + x), weight);
            }
        }
        smaller.extend(columns.iter().map(|span| {
            let mut sum = [0.0; N];
            for (x, weight) in span.pixels() {
                add(&mut sum, &blended[x], weight);
            }
            sum
        }));
    }
    smaller
}

fn add<const N: usize>(sum: &mut [f32; N], values: &[f32; N], weight: f32) {
    for (s, value) in sum.iter_mut().zip(values) {
        *s += weight * value;
    }
}

/// The old pixels under one new pixel along an axis; their weights sum to 1.
struct Span {
    first: usize,
    weights: Vec<f32>,
}

impl Span {
    fn pixels(&self) -> impl Iterator<Item = (usize, f32)> {
        (self.first..).zip(self.weights.iter().copied())
    }
}

/// The spans of `to` pixels over `from`. In integers: old pixel `i` covers
/// `[i·to, (i+1)·to)` and new pixel `k` covers `[k·from, (k+1)·from)`.
fn coverage(from: usize, to: usize) -> Vec<Span> {
    (0..to)
        .map(|k| {
            let (start, end) = (k * from, (k + 1) * from);
            let first = start / to;
            let last = end.div_ceil(to);
            let weights = (first..last)
                .map(|i| {
                    let overlap = end.min((i + 1) * to) - start.max(i * to);
                    (overlap as f64 / from as f64) as f32
                })
                .collect();
            Span { first, weights }
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halving_averages_four() {
        let picture = [[10_u8], [20], [30], [50], [30], [40], [70], [90]];
        assert_eq!(downscale(&picture, [4, 2], [2, 1]), [[25], [60]]);
    }

    #[test]
    fn pixels_on_the_border_count_in_proportion() {
        // Three to two: 1 + half of the middle, over 1.5.
        let picture = [[0_u8, 90], [90, 0], [240, 240]];
        assert_eq!(downscale(&picture, [3, 1], [2, 1]), [[30, 60], [190, 160]]);
    }

    #[test]
    fn what_does_not_count_does_not_spill() {
        let picture = [[10_u8], [200], [30], [50], [90], [90], [90], [90]];
        let mask = [255, 0, 255, 85, 0, 0, 0, 0];
        let (smaller, counts) = downscale_masked(&picture, &mask, [8, 1], [4, 1]);
        // (30 · 255 + 50 · 85) / 340 = 35; nothing counts in the rest.
        assert_eq!(smaller, [[10], [35], [90], [90]]);
        assert_eq!(counts, [128, 170, 0, 0]);
    }

    #[test]
    fn constants_and_the_same_size_are_kept() {
        let constant = vec![[77_u8, 255, 0]; 37 * 23];
        assert_eq!(
            downscale(&constant, [37, 23], [11, 7]),
            vec![[77, 255, 0]; 77]
        );
        let ramp: Vec<[u8; 1]> = (0..=255).map(|k| [k]).collect();
        assert_eq!(downscale(&ramp, [16, 16], [16, 16]), ramp);
    }

    #[test]
    fn weights_cover_everything_once() {
        for (from, to) in [(7, 3), (100, 99), (1000, 1), (5, 5)] {
            let spans = coverage(from, to);
            let mut covered = vec![0.0; from];
            for span in &spans {
                assert!((span.weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
                for (i, weight) in span.pixels() {
                    covered[i] += weight;
                }
            }
            let share = to as f32 / from as f32;
            assert!(covered.iter().all(|c| (c - share).abs() < 1e-5));
        }
    }
}
