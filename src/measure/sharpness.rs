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

/// Side in pixels, at half the size, of the blocks in which detail is compared.
const BLOCK: usize = 16;

/// Share of the photo's detail below which a block has lost it.
const LOST: f64 = 0.15;

/// Detail of a block, as a share of the median over all, below which there is none to be lost.
const FLAT: f64 = 0.25;

/// Share of a photo's textured blocks that lost their detail in a picture of it: the deviation of
/// the Laplacian there is less than 15 % of the photo's. At half the size, where grain counts less;
/// 0 of pictures smaller than a block.
pub fn lost_detail(width: usize, height: usize, gray: &[f32], photo: &[f32]) -> f64 {
    let [drawn, photo] = [gray, photo].map(|gray| block_detail(width, height, gray));
    let mut sorted = photo.clone();
    sorted.sort_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let textured = (drawn.iter().zip(&photo)).filter(|(_, photo)| **photo > FLAT * median);
    let (lost, all) = textured.fold((0_u32, 0_u32), |(lost, all), (drawn, photo)| {
        (lost + u32::from(*drawn < LOST * photo), all + 1)
    });
    f64::from(lost) / f64::from(all.max(1))
}

/// Deviation of the Laplacian in each whole block of a picture of half the size.
fn block_detail(width: usize, height: usize, gray: &[f32]) -> Vec<f64> {
    let [half_width, half_height] = [width / 2, height / 2];
    let half: Vec<f32> = (0..half_width * half_height)
        .map(|p| {
            let at = 2 * (p / half_width) * width + 2 * (p % half_width);
            0.25 * (gray[at] + gray[at + 1] + gray[at + width] + gray[at + width + 1])
        })
        .collect();
    if half.is_empty() {
        return Vec::new();
    }
    let edges = laplacian(half_width, half_height, &half);
    let [columns, rows] = [half_width / BLOCK, half_height / BLOCK];
    let block = |index: usize| {
        let corner = BLOCK * (index / columns * half_width + index % columns);
        let lines = (0..BLOCK).map(|y| corner + y * half_width);
        let values: Vec<f32> = lines
            .flat_map(|at| edges[at..at + BLOCK].to_vec())
            .collect();
        variance(&values).sqrt()
    };
    (0..columns * rows).map(block).collect()
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

    /// A texture that the left half of a picture has, and the right half as faintly.
    #[test]
    fn detail_is_lost_where_little_is_left() {
        let (width, height) = (128, 64);
        let photo: Vec<f32> = (0..width * height)
            .map(|p| 0.5 + 0.2 * ((p % width / 3 + p / width / 3) % 2) as f32)
            .collect();
        let faint = |left: f32| -> Vec<f32> {
            let pixels = photo.iter().enumerate();
            let at = |(p, v): (usize, &f32)| match p % width < width / 2 {
                true => *v,
                false => 0.6 + left * (v - 0.6),
            };
            pixels.map(at).collect()
        };
        let lost = |left: f32| lost_detail(width, height, &faint(left), &photo);
        assert_eq!([lost(1.0), lost(0.3), lost(0.05)], [0.0, 0.0, 0.5]);
        assert_eq!(lost_detail(4, 4, &[0.5; 16], &[0.5; 16]), 0.0);
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
