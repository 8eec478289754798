//! Pixelwise differences of two images.

use crate::color::{ciede2000, srgb_to_lab};

/// PSNR in reports for pictures without a difference, in dB: JSON knows no infinity.
pub const IDENTICAL_PSNR: f64 = 100.0;

/// Peak signal-to-noise ratio in decibels: `-10 log10(mean (a - b)²)`, peak 1.
///
/// The mean runs over all values of all channels. Identical images give
/// `f64::INFINITY`; a NaN anywhere gives NaN.
///
/// # Panics
/// If the lengths differ or are zero.
pub fn psnr(a: &[f32], b: &[f32]) -> f64 {
    assert_same_size(a.len(), b.len());
    let sum: f64 = a
        .iter()
        .zip(b)
        .map(|(&x, &y)| (f64::from(x) - f64::from(y)).powi(2))
        .sum();
    -10.0 * (sum / a.len() as f64).log10()
}

/// [`psnr`] as reports have it: at most [`IDENTICAL_PSNR`], and 0 where a value is not finite,
/// for nothing is worse than no picture.
///
/// # Panics
/// If the lengths differ or are zero.
pub fn reported_psnr(a: &[f32], b: &[f32]) -> f64 {
    let value = psnr(a, b);
    // NaN fails the comparison.
    if value > f64::NEG_INFINITY {
        value.min(IDENTICAL_PSNR)
    } else {
        0.0
    }
}

/// [`reported_psnr`] of `picture` after the gain and offset that bring it closest to `truth`
/// in the least squares, cut to [0, 1]: what others call color-corrected.
///
/// # Panics
/// If the lengths differ or are zero.
pub fn corrected_psnr(picture: &[f32], truth: &[f32]) -> f64 {
    assert_same_size(picture.len(), truth.len());
    let count = picture.len() as f64;
    let mean = |values: &[f32]| values.iter().map(|&v| f64::from(v)).sum::<f64>() / count;
    let [from, to] = [mean(picture), mean(truth)];
    let (mut variance, mut covariance) = (0.0, 0.0);
    for (&x, &y) in picture.iter().zip(truth) {
        let x = f64::from(x) - from;
        variance += x * x;
        covariance += x * (f64::from(y) - to);
    }
    // An even picture says nothing about a gain.
    let gain = if variance > 0.0 {
        covariance / variance
    } else {
        1.0
    };
    let corrected: Vec<f32> = (picture.iter())
        .map(|&x| (gain * (f64::from(x) - from) + to).clamp(0.0, 1.0) as f32)
        .collect();
    reported_psnr(&corrected, truth)
}

/// CIEDE2000 of two images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeltaE {
    /// The mean over the pixels.
    pub mean: f64,
    /// The smallest of the pixels' values that at least 95 % of them do not exceed.
    pub percentile_95: f64,
}

/// CIEDE2000 between two RGB images, pixel by pixel.
///
/// Values outside `[0, 1]` are taken as they are. A NaN anywhere makes the
/// mean NaN and counts as the largest difference in the percentile.
///
/// # Panics
/// If the lengths differ or are zero.
pub fn mean_delta_e(a: &[[f32; 3]], b: &[[f32; 3]]) -> DeltaE {
    let mut differences = delta_e(a, b);
    let mean = differences.iter().sum::<f64>() / differences.len() as f64;
    let rank = (differences.len() * 95).div_ceil(100) - 1;
    let (_, &mut percentile_95, _) = differences.select_nth_unstable_by(rank, f64::total_cmp);
    DeltaE {
        mean,
        percentile_95,
    }
}

/// CIEDE2000 of each pixel of two RGB images.
///
/// # Panics
/// If the lengths differ or are zero.
pub fn delta_e(a: &[[f32; 3]], b: &[[f32; 3]]) -> Vec<f64> {
    assert_same_size(a.len(), b.len());
    a.iter()
        .zip(b)
        .map(|(x, y)| {
            let [x, y] = [x, y].map(|rgb| srgb_to_lab(rgb.map(f64::from)));
            // Positive NaN, so that it sorts behind every number.
            Some(ciede2000(x, y))
                .filter(|d| !d.is_nan())
                .unwrap_or(f64::NAN)
        })
        .collect()
}

/// Root mean square of the differences of a and of b, in CIELAB units: the error of a
/// picture's colors where its lightness is taken from the reference.
///
/// # Panics
/// If the lengths differ or are zero.
pub fn ab_error(a: &[[f32; 2]], b: &[[f32; 2]]) -> f64 {
    assert_same_size(a.len(), b.len());
    let squares: f64 = a
        .iter()
        .zip(b)
        .flat_map(|(x, y)| [0, 1].map(|c| (f64::from(x[c]) - f64::from(y[c])).powi(2)))
        .sum();
    (squares / (2 * a.len()) as f64).sqrt()
}

fn assert_same_size(a: usize, b: usize) {
    assert!(
        a == b && a > 0,
        "images to compare must be of one size and not empty: {a} and {b} values"
    );
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn psnr_of_a_known_error() {
        let a = vec![0.5; 100];
        let b = vec![0.6; 100];
        assert!((psnr(&a, &b) - 20.0).abs() < 1e-5);
        let mut one = a.clone();
        one[7] = 1.0;
        assert!((psnr(&a, &one) - 10.0 * 400_f64.log10()).abs() < 1e-9);
    }

    #[test]
    fn a_gain_and_an_offset_are_corrected_and_nothing_else() {
        let truth = [0.2, 0.4, 0.5, 0.9];
        let moved = truth.map(|v| 0.5 * v + 0.1);
        assert!(corrected_psnr(&moved, &truth) > 80.0);
        assert!(reported_psnr(&moved, &truth) < 20.0);
        // Orthogonal to both of them: mean and covariance with the truth stay.
        let wrong = [0.2 + 0.1, 0.4 - 0.1, 0.5 - 0.1, 0.9 + 0.1];
        assert!(corrected_psnr(&wrong, &truth) < 24.0);
        // Even pictures only get the right mean.
        let even = corrected_psnr(&[0.1; 4], &truth);
        assert!(
            (even - reported_psnr(&[0.5; 4], &truth)).abs() < 1e-4,
            "{even}"
        );
        assert_eq!(corrected_psnr(&[0.1, f32::NAN], &[0.5, 0.6]), 0.0);
    }

    #[test]
    fn psnr_of_the_same_image_and_of_poison() {
        assert_eq!(psnr(&[0.25, 1.0], &[0.25, 1.0]), f64::INFINITY);
        assert!(psnr(&[0.25, f32::NAN], &[0.25, 1.0]).is_nan());
    }

    #[test]
    #[should_panic(expected = "one size")]
    fn psnr_refuses_other_sizes() {
        psnr(&[0.0], &[0.0, 1.0]);
    }

    #[test]
    fn delta_e_of_a_gray_step() {
        let same = mean_delta_e(&[[0.5, 0.2, 0.1]; 10], &[[0.5, 0.2, 0.1]; 10]);
        assert_eq!((same.mean, same.percentile_95), (0.0, 0.0));
        // Black against white differs by 100 in CIEDE2000.
        let a = [[0.0; 3]; 20];
        let mut b = a;
        b[3] = [1.0; 3];
        let one = mean_delta_e(&a, &b);
        assert!((one.mean - 5.0).abs() < 1e-9);
        assert!(one.percentile_95.abs() < 1e-9, "19 of 20 are the same");
        b[4] = [1.0; 3];
        assert!((mean_delta_e(&a, &b).percentile_95 - 100.0).abs() < 1e-9);
    }

    #[test]
    fn a_picture_that_is_not_finite_is_not_reported_as_perfect() {
        assert_eq!(reported_psnr(&[0.5], &[0.5]), IDENTICAL_PSNR);
        assert_eq!(
            reported_psnr(&[0.5, 0.6], &[0.5, 0.5]),
            psnr(&[0.5, 0.6], &[0.5, 0.5])
        );
        for bad in [f32::NAN, f32::INFINITY] {
            assert_eq!(reported_psnr(&[0.5, bad], &[0.5, 0.5]), 0.0);
        }
    }

    #[test]
    fn ab_error_is_the_root_mean_square_of_both_channels() {
        let truth = [[0.0, 0.0], [10.0, -5.0], [1.0, 1.0]];
        let ours = [[3.0, 4.0], [10.0, -5.0], [1.0, 2.0]];
        assert!((ab_error(&ours, &truth) - f64::sqrt(26.0 / 6.0)).abs() < 1e-12);
        assert_eq!(ab_error(&truth, &truth), 0.0);
        assert!(ab_error(&[[f32::NAN, 0.0]], &[[0.0; 2]]).is_nan());
    }

    #[test]
    fn delta_e_of_one_pixel_and_of_poison() {
        let one = mean_delta_e(&[[0.0; 3]], &[[1.0; 3]]);
        assert!((one.percentile_95 - 100.0).abs() < 1e-9);
        let poisoned = mean_delta_e(&[[f32::NAN; 3]], &[[1.0; 3]]);
        assert!(poisoned.mean.is_nan() && poisoned.percentile_95.is_nan());
    }
}
