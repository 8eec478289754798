//! Sharpness of a gray picture.

/// The discrete Laplacian at each pixel, `[height, width]`: the four neighbors less four times
/// the pixel, on the scale of 0 to 255. Beyond the border the picture is mirrored about its
/// outermost pixels, as OpenCV does.
///
/// Its variance is a common measure of focus (J. L. Pech-Pacheco et al., *Diatom autofocusing
/// in brightfield microscopy*, ICPR 2000). `gray` is in `[0, 1]`.
pub fn laplacian(width: usize, height: usize, gray: &[f32]) -> Vec<f32> {
    // Mirrored, the neighbor outside is the one inside.
    let beside = |at: usize, size: usize| {
        let before = if at > 0 { at - 1 } else { 1.min(size - 1) };
        let after = if at + 1 < size {
            at + 1
        } else {
            size.saturating_sub(2)
        };
        [before, after]
    };
    (0..width * height)
        .map(|p| {
            let (column, row) = (p % width, p / width);
            let [left, right] = beside(column, width).map(|x| gray[row * width + x]);
            let [above, below] = beside(row, height).map(|y| gray[y * width + column]);
            255.0 * (left + right + above + below - 4.0 * gray[p])
        })
        .collect()
}

/// Variance of some values; 0 of none.
pub fn variance(values: &[f32]) -> f64 {
    let count = values.len().max(1) as f64;
    let mean = values.iter().map(|&v| f64::from(v)).sum::<f64>() / count;
    let squares = values.iter().map(|&v| (f64::from(v) - mean).powi(2));
    squares.sum::<f64>() / count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flat_pictures_and_even_slopes_are_not_sharp() {
        assert_eq!(variance(&laplacian(5, 4, &[0.3; 20])), 0.0);
        let slope: Vec<f32> = (0..20).map(|p| (p % 5) as f32 / 8.0).collect();
        let inside: Vec<f32> = (laplacian(5, 4, &slope).into_iter().enumerate())
            .filter(|(p, _)| (1..4).contains(&(p % 5)))
            .map(|(_, value)| value)
            .collect();
        assert_eq!(variance(&inside), 0.0);
    }

    #[test]
    fn a_single_bright_pixel_is() {
        let mut gray = [0.0; 25];
        gray[12] = 1.0;
        let found = laplacian(5, 5, &gray);
        assert_eq!([found[12], found[7], found[6]], [-1020.0, 255.0, 0.0]);
        // Mirrored at the border, a bright corner counts twice for its neighbors' sum.
        let mut corner = [0.0; 4];
        corner[0] = 1.0;
        assert_eq!(laplacian(2, 2, &corner), [-1020.0, 510.0, 510.0, 0.0]);
        assert_eq!(laplacian(1, 1, &[0.5]), [0.0]);
    }

    #[test]
    fn a_variance_is_about_the_mean() {
        assert_eq!(variance(&[]), 0.0);
        assert_eq!(variance(&[1.0, 3.0]), 1.0);
    }
}
