//! View dependence of luma, from points seen by several views.

use glam::DVec3;

use super::{soundness::median, tracks::Sample};
use crate::{
    capture::Exposure,
    splats::sh::{basis, coefficient_count},
};

/// Points with fewer samples say nothing about a slope.
const SAMPLES_MIN: usize = 5;

/// Maximum number of samples per track, the first ones: the work grows with their cube.
const SAMPLES_MAX: usize = 24;

/// Standard deviations of a harmonic's coefficient that are tried, in gray.
const DEVIATIONS: [f64; 4] = [0.02, 0.05, 0.12, 0.3];

/// Standard deviation of a sample that no direction explains, in gray: interpolation
/// and the sensor.
const SAMPLE_NOISE: f64 = 0.03;

/// Variance of a point's constant luma: as good as unknown.
const CONSTANT_VARIANCE: f64 = 1.0;

/// A sample farther off than this, in gray, is a wrong match or an occlusion.
const OUTLIER: f64 = 0.2;

/// Leave-one-out error of harmonics of each degree, 0 to 3: root mean square in gray; `None` if no
/// point has enough samples.
pub fn left_out_errors(tracks: &[Vec<Sample>], exposures: &[Exposure]) -> Option<[f64; 4]> {
    let long: Vec<Vec<(DVec3, f64)>> = (tracks.iter())
        .filter_map(|track| {
            let samples: Vec<_> = (track.iter().take(SAMPLES_MAX))
                .map(|sample| {
                    let Exposure { gain, offset } = exposures[sample.view];
                    (sample.direction, (sample.value - offset) / gain)
                })
                .collect();
            let middle = median(samples.iter().map(|&(_, luma)| luma).collect())?;
            let near: Vec<_> = (samples.into_iter())
                .filter(|&(_, luma)| (luma - middle).abs() < OUTLIER)
                .collect();
            (near.len() >= SAMPLES_MIN).then_some(near)
        })
        .collect();
    let count: usize = long.iter().map(Vec::len).sum();
    if count == 0 {
        return None;
    }
    let error = |degree: u32, deviation: f64| {
        let squares: f64 = (long.iter())
            .map(|track| left_out_squares(track, degree, deviation))
            .sum();
        (squares / count as f64).sqrt()
    };
    Some(std::array::from_fn(|degree| match degree {
        0 => error(0, 0.0),
        _ => (DEVIATIONS.iter())
            .map(|&deviation| error(degree as u32, deviation))
            .fold(f64::INFINITY, f64::min),
    }))
}

/// Sum of the squared errors of foretelling each sample from the others, by Gaussian
/// process regression: with C the samples' covariance under the prior, the error at i is
/// `(C⁻¹ y)ᵢ / (C⁻¹)ᵢᵢ` (Rasmussen and Williams 2006, equation 5.12).
fn left_out_squares(track: &[(DVec3, f64)], degree: u32, deviation: f64) -> f64 {
    let n = track.len();
    let harmonics: Vec<Vec<f64>> = (track.iter())
        .map(|&(direction, _)| {
            basis(degree, direction.to_array())[1..coefficient_count(degree)].to_vec()
        })
        .collect();
    let mean = track.iter().map(|&(_, luma)| luma).sum::<f64>() / n as f64;
    let covariance = |i: usize, j: usize| {
        let along: f64 = (harmonics[i].iter().zip(&harmonics[j]))
            .map(|(a, b)| a * b)
            .sum();
        let own = if i == j {
            SAMPLE_NOISE * SAMPLE_NOISE
        } else {
            0.0
        };
        CONSTANT_VARIANCE + deviation * deviation * along + own
    };
    let inverse = inverse(n, covariance);
    (0..n)
        .map(|i| {
            let row = &inverse[i * n..][..n];
            let pull: f64 = (row.iter().zip(track))
                .map(|(entry, &(_, luma))| entry * (luma - mean))
                .sum();
            (pull / row[i]).powi(2)
        })
        .sum()
}

/// The inverse of a symmetric positive definite matrix, by Gauss and Jordan: no pivots
/// are needed.
fn inverse(n: usize, matrix: impl Fn(usize, usize) -> f64) -> Vec<f64> {
    let mut left: Vec<f64> = (0..n * n).map(|k| matrix(k / n, k % n)).collect();
    let mut right: Vec<f64> = (0..n * n)
        .map(|k| f64::from(u8::from(k / n == k % n)))
        .collect();
    for pivot in 0..n {
        let scale = 1.0 / left[pivot * n + pivot];
        for column in 0..n {
            left[pivot * n + column] *= scale;
            right[pivot * n + column] *= scale;
        }
        for row in (0..n).filter(|&row| row != pivot) {
            let factor = left[row * n + pivot];
            for column in 0..n {
                left[row * n + column] -= factor * left[pivot * n + column];
                right[row * n + column] -= factor * right[pivot * n + column];
            }
        }
    }
    right
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points on a plane seen from an arc of cameras; `gloss` brightens one side.
    fn tracks(gloss: f64) -> Vec<Vec<Sample>> {
        let mut random = fastrand::Rng::with_seed(8);
        (0..200)
            .map(|_| {
                let base = 0.3 + 0.4 * random.f64();
                (0..9)
                    .map(|view| {
                        let angle = 0.15 * (f64::from(view) - 4.0);
                        let direction = DVec3::new(angle.sin(), 0.0, angle.cos());
                        Sample {
                            view: view as usize,
                            value: base + gloss * direction.x + 0.02 * (random.f64() - 0.5),
                            direction,
                        }
                    })
                    .collect()
            })
            .collect()
    }

    #[test]
    fn gloss_is_foretold_from_direction_and_noise_is_not() {
        let exposures = [Exposure::NONE; 9];
        let [constant, linear, ..] = left_out_errors(&tracks(0.2), &exposures).unwrap();
        assert!(linear < 0.3 * constant, "{linear} {constant}");
        let errors @ [constant, ..] = left_out_errors(&tracks(0.0), &exposures).unwrap();
        assert!(
            errors.iter().all(|error| *error > 0.97 * constant),
            "{errors:?}"
        );
    }

    #[test]
    fn short_tracks_say_nothing() {
        let short: Vec<Vec<Sample>> = (tracks(0.2).into_iter())
            .map(|track| track[..4].to_vec())
            .collect();
        assert_eq!(left_out_errors(&short, &[Exposure::NONE; 9]), None);
    }

    #[test]
    fn inverses_invert() {
        let matrix =
            |i: usize, j: usize| 1.0 / (1.0 + i.abs_diff(j) as f64) + f64::from(u8::from(i == j));
        let inverse = inverse(6, matrix);
        for i in 0..6 {
            for j in 0..6 {
                let product: f64 = (0..6).map(|k| matrix(i, k) * inverse[k * 6 + j]).sum();
                assert!((product - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
    }
}
