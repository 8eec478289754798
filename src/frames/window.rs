//! Sums over the pixels around each pixel, and the two pixels that a place lies between.

/// The pixels before and after a place along an axis, in pixel indices, and what each counts in a
/// linear interpolation; the border goes on as it ends.
pub fn taps(place: f32, length: usize) -> [(usize, f32); 2] {
    let place = place.clamp(0.0, (length - 1) as f32);
    let first = place as usize;
    let share = place - first as f32;
    [(first, 1.0 - share), ((first + 1).min(length - 1), share)]
}

/// Bilinear value at a place in pixel indices, the border going on as it ends; `[height, width]`.
pub fn bilinear<const N: usize>(
    pixels: &[[f32; N]],
    [width, height]: [usize; 2],
    [x, y]: [f32; 2],
) -> [f32; N] {
    let [[(x0, left), (x1, right)], rows] = [taps(x, width), taps(y, height)];
    let mut sum = [0.0; N];
    for (row, share) in rows {
        let [a, b] = [x0, x1].map(|column| pixels[row * width + column]);
        for (k, sum) in sum.iter_mut().enumerate() {
            *sum += share * (left * a[k] + right * b[k]);
        }
    }
    sum
}

/// Sums over squares of `2 reach + 1` pixels, cut off at the border; `[height, width]`.
pub fn sums<const N: usize>(values: &[[f32; N]], size: [usize; 2], reach: usize) -> Vec<[f32; N]> {
    folded(values, size, reach, |sum, value| {
        std::array::from_fn(|k| sum[k] + value[k])
    })
}

/// Largest or smallest values, by `most`, of such squares.
pub fn extremes(
    values: &[f32],
    size: [usize; 2],
    reach: usize,
    most: fn(f32, f32) -> f32,
) -> Vec<f32> {
    folded(values, size, reach, most)
}

/// Values of squares joined, along rows and then along columns.
fn folded<T: Copy>(
    values: &[T],
    [width, height]: [usize; 2],
    reach: usize,
    join: impl Fn(T, T) -> T,
) -> Vec<T> {
    let range = |i: usize, length: usize| i.saturating_sub(reach)..(i + reach + 1).min(length);
    let rows: Vec<T> = (0..values.len())
        .map(|i| {
            let row = range(i % width, width).map(|x| values[i / width * width + x]);
            row.reduce(&join).unwrap_or(values[i])
        })
        .collect();
    (0..values.len())
        .map(|i| {
            let column = range(i / width, height).map(|y| rows[y * width + i % width]);
            column.reduce(&join).unwrap_or(rows[i])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_are_closed_and_what_is_alone_keeps_its_size() {
        let mut values = vec![0.0; 12 * 9];
        for at in [4 * 12 + 3, 4 * 12 + 6] {
            values[at] = 1.0;
        }
        let widened = extremes(&values, [12, 9], 1, f32::max);
        let closed = extremes(&widened, [12, 9], 1, f32::min);
        let set: Vec<usize> = (0..closed.len()).filter(|&i| closed[i] > 0.0).collect();
        assert_eq!(set, [51, 52, 53, 54]);
    }

    #[test]
    fn squares_are_cut_off_at_the_border() {
        let ones = vec![[1.0, 2.0]; 20];
        let found = sums(&ones, [5, 4], 1);
        assert_eq!(
            [found[0], found[1], found[6]],
            [[4.0, 8.0], [6.0, 12.0], [9.0, 18.0]]
        );
        assert_eq!(sums(&ones, [5, 4], 9), vec![[20.0, 40.0]; 20]);
        assert_eq!(sums(&[[3.0]], [1, 1], 2), [[3.0]]);
    }
}
