//! The luma loss: 0.8 · L1 + 0.2 · (1 - SSIM), averaged over the pixels.
//!
//! SSIM after Wang et al. 2004 with an 11×11 Gaussian window; outside the
//! image the window meets zeros, as in the reference splat trainer. [`LumaEffects`] may
//! add an exposure and a mask.

use super::constants::{SSIM_C1, SSIM_C2, SSIM_SIGMA, SSIM_WEIGHT, SSIM_WINDOW};
use super::{Number, lift, seed};

/// The window of `side` taps along one axis; sums to one.
pub fn window(side: usize) -> Vec<f64> {
    let raw = (0..side).map(|i| {
        let distance = i as f64 - (side / 2) as f64;
        (-distance * distance / (2.0 * SSIM_SIGMA * SSIM_SIGMA)).exp()
    });
    let raw: Vec<f64> = raw.collect();
    let sum: f64 = raw.iter().sum();
    raw.into_iter().map(|w| w / sum).collect()
}

/// The pixels of a window of `side` taps around `center` that lie in `0..size`.
fn reach(center: usize, side: usize, size: usize) -> std::ops::Range<usize> {
    let radius = side / 2;
    center.saturating_sub(radius)..(center + radius + 1).min(size)
}

/// SSIM at one pixel. `x` and `y` are `[height · width]`.
fn ssim_at<T: Number>(
    x: impl Fn(usize) -> T,
    y: &[f64],
    [width, height]: [usize; 2],
    pixel: usize,
    window: &[f64],
) -> T {
    let (column, row) = (pixel % width, pixel / width);
    let (side, radius) = (window.len(), window.len() / 2);
    let [mut mean_x, mut xx, mut xy] = [T::zero(); 3];
    let [mut mean_y, mut yy] = [0.0; 2];
    for j in reach(row, side, height) {
        for i in reach(column, side, width) {
            let weight = window[i + radius - column] * window[j + radius - row];
            let (a, b) = (x(j * width + i), y[j * width + i]);
            mean_x += a * weight;
            mean_y += b * weight;
            xx += a * a * weight;
            yy += b * b * weight;
            xy += a * b * weight;
        }
    }
    let variance_x = xx - mean_x * mean_x;
    let variance_y = yy - mean_y * mean_y;
    let covariance = xy - mean_x * mean_y;
    let luminance =
        (mean_x * mean_y * 2.0 + SSIM_C1) / (mean_x * mean_x + mean_y * mean_y + SSIM_C1);
    let structure = (covariance * 2.0 + SSIM_C2) / (variance_x + variance_y + SSIM_C2);
    luminance * structure
}

/// SSIM window, exposure and mask of the loss.
#[derive(Clone, Copy, Debug)]
pub struct LumaEffects<'a> {
    /// Taps of SSIM's window along one axis.
    pub ssim_window: usize,
    /// Gain and offset: what the photo shows of the image.
    pub exposure: Option<[f64; 2]>,
    /// Weight of each pixel, `[height · width]`.
    pub mask: Option<&'a [f64]>,
}

impl Default for LumaEffects<'_> {
    fn default() -> Self {
        Self {
            ssim_window: SSIM_WINDOW,
            exposure: None,
            mask: None,
        }
    }
}

impl LumaEffects<'_> {
    /// The image as the photo would show it: where the photo is black or white, what
    /// lies beyond is met.
    fn shown<T: Number>(&self, x: T, y: f64) -> T {
        let Some([gain, offset]) = self.exposure else {
            return x;
        };
        let value = x * gain + offset;
        let beyond = (y >= 1.0 && value.re() > 1.0) || (y <= 0.0 && value.re() < 0.0);
        if beyond { T::from(y) } else { value }
    }

    /// Weight of a pixel.
    fn weight(&self, pixel: usize) -> f64 {
        self.mask.map_or(1.0, |mask| mask[pixel])
    }
}

/// `|r|`, with slope zero at zero.
fn absolute<T: Number>(r: T) -> T {
    if r.re() > 0.0 {
        r
    } else if r.re() < 0.0 {
        -r
    } else {
        r * 0.0
    }
}

/// The map of SSIM of `x` against `y` with a window of `side` taps, `[height · width]`.
pub fn ssim_map<T: Number>(x: &[T], y: &[f64], width: usize, height: usize, side: usize) -> Vec<T> {
    let window = window(side);
    (0..width * height)
        .map(|pixel| ssim_at(|i| x[i], y, [width, height], pixel, &window))
        .collect()
}

/// The loss of a rendered image `x` against a photo `y`, both `[height · width]`.
pub fn luma_loss<T: Number>(
    x: &[T],
    y: &[f64],
    width: usize,
    height: usize,
    effects: &LumaEffects,
) -> T {
    let shown: Vec<T> = x
        .iter()
        .zip(y)
        .map(|(&x, &y)| effects.shown(x, y))
        .collect();
    let weights: Vec<f64> = (0..x.len()).map(|pixel| effects.weight(pixel)).collect();
    let weighted: Vec<T> = shown.iter().zip(&weights).map(|(&x, &w)| x * w).collect();
    let wanted: Vec<f64> = y.iter().zip(&weights).map(|(y, w)| y * w).collect();
    let mut sum = T::zero();
    for (pixel, ssim) in ssim_map(&weighted, &wanted, width, height, effects.ssim_window)
        .into_iter()
        .enumerate()
    {
        let difference = absolute(shown[pixel] - y[pixel]);
        let term = difference * (1.0 - SSIM_WEIGHT) + (T::one() - ssim) * SSIM_WEIGHT;
        sum += term * weights[pixel];
    }
    sum / (width * height) as f64
}

/// The loss's gradient with respect to `x`: each pixel in turn as a dual
/// number, summed over the windows it lies in.
pub fn luma_loss_gradient(
    x: &[f64],
    y: &[f64],
    width: usize,
    height: usize,
    effects: &LumaEffects,
) -> Vec<f64> {
    let side = effects.ssim_window;
    let window = window(side);
    let shown: Vec<f64> = x
        .iter()
        .zip(y)
        .map(|(&x, &y)| effects.shown(x, y))
        .collect();
    let weights: Vec<f64> = (0..x.len()).map(|pixel| effects.weight(pixel)).collect();
    let wanted: Vec<f64> = y.iter().zip(&weights).map(|(y, w)| y * w).collect();
    (0..width * height)
        .map(|varied| {
            let dual = effects.shown(seed(x[varied]), y[varied]);
            let weighted = |i: usize| {
                let shown = if i == varied { dual } else { lift(shown[i]) };
                shown * weights[i]
            };
            let mut sum = absolute(dual - y[varied]) * (1.0 - SSIM_WEIGHT) * weights[varied];
            for j in reach(varied / width, side, height) {
                for i in reach(varied % width, side, width) {
                    let pixel = j * width + i;
                    let ssim = ssim_at(weighted, &wanted, [width, height], pixel, &window);
                    sum -= ssim * SSIM_WEIGHT * weights[pixel];
                }
            }
            sum.eps / (width * height) as f64
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;

    const PLAIN: LumaEffects = LumaEffects {
        ssim_window: SSIM_WINDOW,
        exposure: None,
        mask: None,
    };

    fn images(seed: u64, count: usize) -> [Vec<f64>; 2] {
        let mut random = Random::new(seed);
        [(); 2].map(|()| (0..count).map(|_| random.range(0.0, 1.0)).collect())
    }

    #[test]
    fn window_is_normalized_and_symmetric() {
        for side in [11, 7, 5] {
            let (w, middle) = (window(side), side / 2);
            assert!((w.iter().sum::<f64>() - 1.0).abs() < 1e-15);
            assert_eq!(w[0], w[side - 1]);
            assert!((w[middle] / w[middle - 1] - (1.0 / 4.5_f64).exp()).abs() < 1e-12);
        }
    }

    #[test]
    fn identical_images_have_no_loss_and_no_slope() {
        let [x, _] = images(31, 20 * 17);
        assert!(
            ssim_map(&x, &x, 20, 17, 11)
                .iter()
                .all(|s| (s - 1.0).abs() < 1e-12)
        );
        assert!(luma_loss(&x, &x, 20, 17, &PLAIN).abs() < 1e-12);
        let gradient = luma_loss_gradient(&x, &x, 20, 17, &PLAIN);
        assert!(gradient.iter().all(|g| g.abs() < 1e-12));
    }

    #[test]
    fn constant_images_have_the_analytic_ssim() {
        let (x, y) = (vec![0.3; 24 * 24], vec![0.6; 24 * 24]);
        let inside = ssim_map(&x, &y, 24, 24, 11)[12 * 24 + 12];
        let expected = (2.0 * 0.18 + SSIM_C1) / (0.09 + 0.36 + SSIM_C1);
        assert!((inside - expected).abs() < 1e-10);
        // In the corner, six of eleven taps of each axis see the image.
        let share: f64 = window(11)[5..].iter().sum::<f64>().powi(2);
        let (a, b) = (0.3 * share, 0.6 * share);
        let luminance = (2.0 * a * b + SSIM_C1) / (a * a + b * b + SSIM_C1);
        let spread = share - share * share;
        let structure = (2.0 * 0.18 * spread + SSIM_C2) / (0.45 * spread + SSIM_C2);
        let corner = ssim_map(&x, &y, 24, 24, 11)[0];
        assert!((corner - luminance * structure).abs() < 1e-10);
    }

    #[test]
    fn black_and_white_are_finite() {
        for (x, y) in [(0.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
            let (x, y): (Vec<f64>, Vec<f64>) = (vec![x; 144], vec![y; 144]);
            assert!(luma_loss(&x, &y, 12, 12, &PLAIN).is_finite());
            let gradient = luma_loss_gradient(&x, &y, 12, 12, &PLAIN);
            assert!(gradient.iter().all(|g| g.is_finite()));
        }
    }

    #[test]
    fn gradient_agrees_with_finite_differences() {
        let [x, y] = images(32, 16 * 13);
        let gradient = luma_loss_gradient(&x, &y, 16, 13, &PLAIN);
        for pixel in [0, 5, 15, 90, 100, 207] {
            let shifted = |by: f64| {
                let mut x = x.clone();
                x[pixel] += by;
                luma_loss(&x, &y, 16, 13, &PLAIN)
            };
            let difference = (shifted(1e-6) - shifted(-1e-6)) / 2e-6;
            assert!((difference - gradient[pixel]).abs() < 1e-9);
        }
    }

    #[test]
    fn a_masked_pixel_is_as_good_as_outside() {
        let [x, y] = images(33, 20 * 16);
        // The image without its right half, or with a mask over it.
        let mask: Vec<f64> = (0..320).map(|p| f64::from(u8::from(p % 20 < 10))).collect();
        let effects = LumaEffects {
            mask: Some(&mask),
            ..PLAIN
        };
        let half = |image: &[f64]| -> Vec<f64> {
            image
                .chunks(20)
                .flat_map(|row| row[..10].to_vec())
                .collect()
        };
        let masked = luma_loss(&x, &y, 20, 16, &effects);
        let alone = luma_loss(&half(&x), &half(&y), 10, 16, &PLAIN);
        assert!((2.0 * masked - alone).abs() < 1e-12);
        let gradient = luma_loss_gradient(&x, &y, 20, 16, &effects);
        let of_half = luma_loss_gradient(&half(&x), &half(&y), 10, 16, &PLAIN);
        for (p, slope) in gradient.iter().enumerate() {
            let expected = if p % 20 < 10 {
                0.5 * of_half[p / 20 * 10 + p % 20]
            } else {
                0.0
            };
            assert!((slope - expected).abs() < 1e-14);
        }
    }

    #[test]
    fn an_exposed_image_that_is_met_has_no_loss() {
        let [x, _] = images(34, 17 * 12);
        let effects = LumaEffects {
            exposure: Some([1.4, -0.1]),
            ..PLAIN
        };
        let y: Vec<f64> = x.iter().map(|x| (1.4 * x - 0.1).clamp(0.0, 1.0)).collect();
        assert!(y.contains(&1.0) && y.contains(&0.0));
        assert!(luma_loss(&x, &y, 17, 12, &effects).abs() < 1e-12);
        let gradient = luma_loss_gradient(&x, &y, 17, 12, &effects);
        assert!(gradient.iter().all(|g| g.abs() < 1e-12));
    }
}
