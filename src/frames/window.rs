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
pub fn sums<const N: usize>(
    values: &[[f32; N]],
    [width, height]: [usize; 2],
    reach: usize,
) -> Vec<[f32; N]> {
    let add = |sum: [f32; N], value: [f32; N]| std::array::from_fn(|k| sum[k] + value[k]);
    let range = |i: usize, length: usize| i.saturating_sub(reach)..(i + reach + 1).min(length);
    let rows: Vec<[f32; N]> = (0..values.len())
        .map(|i| {
            let start = i / width * width;
            let row = range(i % width, width).map(|x| values[start + x]);
            row.fold([0.0; N], add)
        })
        .collect();
    (0..values.len())
        .map(|i| {
            let column = range(i / width, height).map(|y| rows[y * width + i % width]);
            column.fold([0.0; N], add)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

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
