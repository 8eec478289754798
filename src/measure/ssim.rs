//! Structural similarity.

/// Pixels from a window's center to its edge: windows are 11 × 11.
const RADIUS: usize = 5;
const WINDOW: usize = 2 * RADIUS + 1;
/// Standard deviation of the window's Gaussian in pixels.
const SIGMA: f64 = 1.5;
/// The paper's K1 = 0.01 and K2 = 0.03, squared; the data range is 1.
const C1: f64 = 0.01 * 0.01;
const C2: f64 = 0.03 * 0.03;

/// Moments that a window averages: a, b, a², b² and ab.
type Moments = [f64; 5];

/// Mean structural similarity of two single-channel images.
///
/// Z. Wang, A. C. Bovik, H. R. Sheikh, E. P. Simoncelli, *Image Quality
/// Assessment: From Error Visibility to Structural Similarity*, IEEE TIP 13
/// (2004): 11 × 11 Gaussian windows of σ 1.5, K1 = 0.01, K2 = 0.03, data range
/// 1, averaged over the windows that lie inside the image. An image less than
/// 11 pixels wide or high holds no such window: it is framed with zeros and
/// every pixel is the center of one. Identical images give 1; a NaN anywhere
/// gives NaN.
///
/// # Panics
/// If `a` or `b` does not hold `width · height` values, or there are none.
pub fn ssim(width: usize, height: usize, a: &[f32], b: &[f32]) -> f64 {
    assert!(
        width * height > 0 && a.len() == width * height && b.len() == width * height,
        "{} and {} values are not two images of {width} × {height}",
        a.len(),
        b.len()
    );
    if width.min(height) < WINDOW {
        let framed = |image: &[f32]| frame(width, height, image);
        let (width, height) = (width + 2 * RADIUS, height + 2 * RADIUS);
        mean_over_windows(width, height, &framed(a), &framed(b))
    } else {
        mean_over_windows(width, height, a, b)
    }
}

fn mean_over_windows(width: usize, height: usize, a: &[f32], b: &[f32]) -> f64 {
    let weights = gaussian();
    let columns = width - 2 * RADIUS;
    // The window is separable: filtered rows wait in a ring for the columns' turn.
    let mut ring = vec![vec![Moments::default(); columns]; WINDOW];
    let mut products = vec![Moments::default(); width];
    let mut sum = 0.0;
    for y in 0..height {
        let row = y * width..(y + 1) * width;
        for (product, (&a, &b)) in products.iter_mut().zip(a[row.clone()].iter().zip(&b[row])) {
            let (a, b) = (f64::from(a), f64::from(b));
            *product = [a, b, a * a, b * b, a * b];
        }
        for (x, filtered) in ring[y % WINDOW].iter_mut().enumerate() {
            *filtered = weighted(&weights, |k| &products[x + k]);
        }
        if y + 1 >= WINDOW {
            let top = y + 1 - WINDOW;
            sum += (0..columns)
                .map(|x| similarity(weighted(&weights, |k| &ring[(top + k) % WINDOW][x])))
                .sum::<f64>();
        }
    }
    sum / (columns * (height - 2 * RADIUS)) as f64
}

/// Equation 13 of the paper for one window.
fn similarity([a, b, aa, bb, ab]: Moments) -> f64 {
    let (variance_a, variance_b, covariance) = (aa - a * a, bb - b * b, ab - a * b);
    ((2.0 * a * b + C1) * (2.0 * covariance + C2))
        / ((a * a + b * b + C1) * (variance_a + variance_b + C2))
}

fn weighted<'a>(weights: &[f64; WINDOW], at: impl Fn(usize) -> &'a Moments) -> Moments {
    let mut sum = Moments::default();
    for (k, weight) in weights.iter().enumerate() {
        for (s, value) in sum.iter_mut().zip(at(k)) {
            *s += weight * value;
        }
    }
    sum
}

/// The window's weights along one axis; they sum to 1.
fn gaussian() -> [f64; WINDOW] {
    let weights: [f64; WINDOW] = std::array::from_fn(|k| {
        let distance = k as f64 - RADIUS as f64;
        (-0.5 * (distance / SIGMA).powi(2)).exp()
    });
    let sum: f64 = weights.iter().sum();
    weights.map(|w| w / sum)
}

/// The image with `RADIUS` zeros on every side.
fn frame(width: usize, height: usize, image: &[f32]) -> Vec<f32> {
    let stride = width + 2 * RADIUS;
    let mut framed = vec![0.0; stride * (height + 2 * RADIUS)];
    for (y, row) in image.chunks_exact(width).enumerate() {
        let start = (y + RADIUS) * stride + RADIUS;
        framed[start..start + width].copy_from_slice(row);
    }
    framed
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reproducible noise in `[0, 1)`.
    fn noise(count: usize, seed: u32) -> Vec<f32> {
        let mut state = seed;
        (0..count)
            .map(|_| {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                (state >> 8) as f32 / (1 << 24) as f32
            })
            .collect()
    }

    /// The definition, window by window, with the two-dimensional Gaussian and
    /// central moments.
    fn by_definition(width: usize, height: usize, a: &[f32], b: &[f32]) -> f64 {
        let weights = gaussian();
        let (mut sum, mut count) = (0.0, 0);
        for top in 0..=height - WINDOW {
            for left in 0..=width - WINDOW {
                let mean = |f: &dyn Fn(f64, f64) -> f64| -> f64 {
                    let mut total = 0.0;
                    for i in 0..WINDOW {
                        for j in 0..WINDOW {
                            let at = (top + i) * width + left + j;
                            let (x, y) = (f64::from(a[at]), f64::from(b[at]));
                            total += weights[i] * weights[j] * f(x, y);
                        }
                    }
                    total
                };
                let (ma, mb) = (mean(&|x, _| x), mean(&|_, y| y));
                let va = mean(&|x, _| (x - ma).powi(2));
                let vb = mean(&|_, y| (y - mb).powi(2));
                let cov = mean(&|x, y| (x - ma) * (y - mb));
                sum += (2.0 * ma * mb + C1) * (2.0 * cov + C2)
                    / ((ma * ma + mb * mb + C1) * (va + vb + C2));
                count += 1;
            }
        }
        sum / f64::from(count)
    }

    #[test]
    fn agrees_with_the_definition() {
        for (width, height) in [(11, 11), (17, 12), (12, 23)] {
            let (a, b) = (noise(width * height, 1), noise(width * height, 2));
            let mixed: Vec<f32> = a.iter().zip(&b).map(|(x, y)| 0.7 * x + 0.3 * y).collect();
            let want = by_definition(width, height, &a, &mixed);
            assert!(want > 0.1 && want < 0.99);
            assert!((ssim(width, height, &a, &mixed) - want).abs() < 1e-12);
        }
    }

    #[test]
    fn small_images_are_framed_with_zeros() {
        let (a, b) = (noise(7 * 20, 3), noise(7 * 20, 4));
        let want = by_definition(17, 30, &frame(7, 20, &a), &frame(7, 20, &b));
        assert!((ssim(7, 20, &a, &b) - want).abs() < 1e-12);
        assert_eq!(ssim(1, 1, &[0.3], &[0.3]), 1.0);
        assert!(ssim(1, 1, &[0.0], &[1.0]) < 0.1);
    }

    #[test]
    fn identical_images_give_one_and_constants_a_known_value() {
        let a = noise(16 * 16, 5);
        assert_eq!(ssim(16, 16, &a, &a), 1.0);
        for (x, y) in [(0.0_f32, 0.0_f32), (1.0, 1.0), (0.0, 1.0), (0.25, 0.75)] {
            let (p, q) = (f64::from(x), f64::from(y));
            let want = (2.0 * p * q + C1) / (p * p + q * q + C1);
            let got = ssim(16, 16, &[x; 256], &[y; 256]);
            assert!((got - want).abs() < 1e-9, "{x} {y}: {got} {want}");
        }
    }

    #[test]
    fn a_negative_is_dissimilar() {
        let a = noise(32 * 32, 6);
        let b: Vec<f32> = a.iter().map(|x| 1.0 - x).collect();
        assert!(ssim(32, 32, &a, &b) < -0.8);
    }

    #[test]
    fn not_a_number_is_not_hidden() {
        let mut a = vec![0.5; 256];
        a[100] = f32::NAN;
        assert!(ssim(16, 16, &a, &[0.5; 256]).is_nan());
    }

    #[test]
    #[should_panic(expected = "not two images")]
    fn refuses_other_sizes() {
        ssim(4, 4, &[0.0; 16], &[0.0; 15]);
    }
}
