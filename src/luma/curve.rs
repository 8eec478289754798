//! Held-out PSNR over the course of a training.

use serde::{Deserialize, Serialize};

/// Fewer points than this say nothing about a slope.
const POINTS_MIN: usize = 3;

/// Held-out score at one iteration of a training.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct CurvePoint {
    /// Iterations done.
    pub iteration: usize,
    /// Training by then, in seconds.
    ///
    /// Looking at views does not count.
    pub seconds: f64,
    /// Gaussians at that time.
    pub splats: usize,
    /// Mean of the views that are watched, in dB.
    pub psnr: f64,
}

/// Expected gain of twice the iterations, in dB: the slope of the least-squares line through PSNR
/// against log₂ of the iteration, over the last half of a curve. `None` while there are too few
/// points.
pub fn gain_of_doubling(curve: &[CurvePoint]) -> Option<f64> {
    let last = curve.last()?.iteration;
    let points: Vec<[f64; 2]> = curve
        .iter()
        .filter(|point| 2 * point.iteration >= last)
        .map(|point| [(point.iteration.max(1) as f64).log2(), point.psnr])
        .collect();
    let count = points.len() as f64;
    let mean = |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / count;
    let [x, y] = [mean(0), mean(1)];
    let spread: f64 = points.iter().map(|p| (p[0] - x).powi(2)).sum();
    let together: f64 = points.iter().map(|p| (p[0] - x) * (p[1] - y)).sum();
    (points.len() >= POINTS_MIN && spread > 0.0).then(|| together / spread)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(psnr: impl Fn(usize) -> f64, iterations: &[usize]) -> Vec<CurvePoint> {
        let point = |&iteration: &usize| CurvePoint {
            iteration,
            seconds: iteration as f64 / 10.0,
            splats: 100,
            psnr: psnr(iteration),
        };
        iterations.iter().map(point).collect()
    }

    const EVEN: [usize; 8] = [100, 200, 300, 400, 500, 600, 700, 800];

    #[test]
    fn a_logarithm_gains_the_same_with_every_doubling() {
        let gain = gain_of_doubling(&curve(|i| 20.0 + 1.5 * (i as f64).log2(), &EVEN));
        assert!((gain.unwrap() - 1.5).abs() < 1e-9, "{gain:?}");
    }

    #[test]
    fn only_the_last_half_counts() {
        let stalled = |i: usize| 20.0 + 5.0 * (i.min(300) as f64).log2();
        let gain = gain_of_doubling(&curve(stalled, &EVEN)).unwrap();
        assert!(gain.abs() < 1e-9, "{gain}");
    }

    /// By the best so far nothing would be gained.
    #[test]
    fn a_look_that_stands_out_hides_no_gain() {
        let noisy = |i: usize| 20.0 + (i as f64).log2() + if i == 300 { 1.5 } else { 0.0 };
        let gain = gain_of_doubling(&curve(noisy, &EVEN)).unwrap();
        assert!((gain - 1.0).abs() < 1e-9, "{gain}");
    }

    #[test]
    fn few_points_say_nothing() {
        assert_eq!(gain_of_doubling(&[]), None);
        assert_eq!(gain_of_doubling(&curve(|_| 20.0, &EVEN[..2])), None);
        assert_eq!(gain_of_doubling(&curve(|_| 20.0, &[0, 0, 0])), None);
    }
}
