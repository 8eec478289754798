//! Exposures of the views, from the same points seen by several.

use std::iter;

use super::{soundness::median, tracks::Sample};
use crate::capture::{Exposure, View};

/// Alternations between the points' lumas and the views' exposures. Each takes a few
/// hundredths of a second for a large model. Where all photos overlap they settle after some ten;
/// along a flight the first ones tell neighbors apart, and later ones its ends.
const ROUNDS: usize = 40;

/// Exposures drift where photos that see the same points differ by less than this share of what
/// any two photos differ by: Geary's C, which is 1 on average for exposures that have nothing to do
/// with places (Geary, "The contiguity ratio and statistical mapping", 1954). Three drone scenes
/// have 0.64 to 0.83, random gains on the bundled scene 1.11.
const DRIFT: f64 = 0.9;

/// Samples that speak for no exposure at all: a view with as few is hardly moved.
const PRIOR_SAMPLES: f64 = 10.0;

/// Standard deviation of the prior's samples at least, in gray: where points have one luma
/// they say nothing about gains.
const PRIOR_SPREAD: f64 = 0.03;

/// Residuals beyond so many standard deviations count less and less (Huber's
/// constant, 95 % efficient for normal noise).
const HUBER: f64 = 1.345;

/// A view's gain stays between this and its inverse: two stops.
const GAIN_MIN: f64 = 0.25;

/// Each view's exposure, and how sure it is.
#[derive(Clone, Debug, PartialEq)]
pub struct Exposures {
    /// By view. Over the training views, or photos, the median gain is 1 and the median offset
    /// 0: the scene is as bright as the typical photo shows it.
    pub views: Vec<Exposure>,
    /// By view, how bright it shows a scene that is to look like its photos: [`Self::views`], but
    /// where exposures drift along the capture, each place is as bright as the photos that see it
    /// show it on average.
    pub local: Vec<Exposure>,
    /// True if photos that see the same points are exposed more alike than any two. Changes by
    /// place may be light on a surface; changes from photo to photo are not.
    pub drifts: bool,
    /// Effect of the exposures on the training views, root mean square in gray.
    pub spread: f64,
    /// Expected spread by chance, from the noise of the samples.
    pub noise: f64,
}

/// Finds the exposures under which the views agree best about the points: each view
/// shows gain · luma + offset of a point's luma, up to noise with outliers.
pub fn find_exposures(tracks: &[Vec<Sample>], views: usize, train: &[usize]) -> Exposures {
    let mut exposures = vec![Exposure::NONE; views];
    let mut scale = f64::INFINITY;
    let mut lumas: Vec<f64> = Vec::new();
    let mut local = Vec::new();
    for round in 0..ROUNDS {
        lumas = (tracks.iter())
            .map(|track| luma_of(track, &exposures, scale))
            .collect();
        let sizes = with_lumas(tracks, &lumas)
            .map(|(sample, luma)| residual(sample, luma, &exposures).abs());
        scale = deviation(sizes.collect());
        exposures = regress(tracks, &lumas, &exposures, scale);
        center(&mut exposures, train);
        if round == 0 {
            // Against the mean of what photos show of each point.
            local.clone_from(&exposures);
        }
    }
    let drifts = drifts(tracks, &lumas, &exposures, train);
    if !drifts {
        local.clone_from(&exposures);
    }
    // Of each view its samples, and the squares of how far they are moved.
    let mut sums = vec![[0.0; 2]; views];
    for (sample, luma) in with_lumas(tracks, &lumas) {
        let Exposure { gain, offset } = exposures[sample.view];
        let [count, squares] = &mut sums[sample.view];
        *count += 1.0;
        *squares += ((gain - 1.0) * luma + offset).powi(2);
    }
    let (mut moved, mut expected, mut counted) = (0.0, 0.0, 0.0);
    for &view in train {
        let [count, squares] = sums[view];
        if count > 0.0 {
            moved += squares / count;
            // Two numbers are fitted to a view's samples.
            expected += 2.0 * scale * scale / count;
            counted += 1.0;
        }
    }
    let mean_root = |sum: f64| (sum / f64::max(counted, 1.0)).sqrt();
    Exposures {
        views: exposures,
        local,
        drifts,
        spread: mean_root(moved),
        noise: mean_root(expected),
    }
}

/// The same for views of which some may be faces of one photo: they share its exposure, and
/// one that sees few points has it from the others. `views` are sorted by photo.
pub fn find_photo_exposures(tracks: &[Vec<Sample>], views: &[View], train: &[usize]) -> Exposures {
    let faces = views.chunk_by(|a, b| a.photo == b.photo).enumerate();
    let photo_of: Vec<usize> = faces
        .flat_map(|(photo, faces)| iter::repeat_n(photo, faces.len()))
        .collect();
    let of_photos: Vec<Vec<Sample>> = (tracks.iter())
        .map(|track| {
            let of_photo = |sample: &Sample| Sample {
                view: photo_of[sample.view],
                ..*sample
            };
            track.iter().map(of_photo).collect()
        })
        .collect();
    let mut trained: Vec<usize> = train.iter().map(|&view| photo_of[view]).collect();
    trained.dedup();
    let photos = photo_of.last().map_or(0, |last| last + 1);
    let found = find_exposures(&of_photos, photos, &trained);
    let of_views =
        |of_photos: &[Exposure]| photo_of.iter().map(|&photo| of_photos[photo]).collect();
    Exposures {
        views: of_views(&found.views),
        local: of_views(&found.local),
        ..found
    }
}

/// Returns true if training views of the same points are exposed more alike than any two are.
fn drifts(tracks: &[Vec<Sample>], lumas: &[f64], exposures: &[Exposure], train: &[usize]) -> bool {
    let typical = lumas.iter().sum::<f64>() / lumas.len().max(1) as f64;
    let brightness = |view: usize| exposures[view].gain * typical + exposures[view].offset;
    // Over ordered pairs, how many there are and the sum of their squared differences:
    // n Σ b² - (Σ b)², twice.
    let pairs = |views: &mut dyn Iterator<Item = usize>| {
        let [mut count, mut sum, mut squares] = [0.0; 3];
        for brightness in views.map(brightness) {
            count += 1.0;
            sum += brightness;
            squares += brightness * brightness;
        }
        [count * (count - 1.0), 2.0 * (count * squares - sum * sum)]
    };
    let mean = |[count, squares]: [f64; 2]| squares / f64::max(count, 1.0);
    let mut trained = vec![false; exposures.len()];
    train.iter().for_each(|&view| trained[view] = true);
    let near = (tracks.iter())
        .map(|track| pairs(&mut track.iter().map(|s| s.view).filter(|&view| trained[view])))
        .fold([0.0; 2], |sum, of_track| {
            [0, 1].map(|i| sum[i] + of_track[i])
        });
    mean(near) < DRIFT * mean(pairs(&mut train.iter().copied()))
}

/// A residual's weight.
fn weight(residual: f64, scale: f64) -> f64 {
    (HUBER * scale / residual.abs()).min(1.0)
}

/// The luma about which a point's views agree best: their median, then a weighted mean.
fn luma_of(track: &[Sample], exposures: &[Exposure], scale: f64) -> f64 {
    let mut lumas: Vec<f64> = (track.iter())
        .map(|sample| {
            let Exposure { gain, offset } = exposures[sample.view];
            (sample.value - offset) / gain
        })
        .collect();
    lumas.sort_by(f64::total_cmp);
    let middle = lumas[lumas.len() / 2];
    let (mut sum, mut weights) = (0.0, 0.0);
    for luma in lumas {
        let weight = match luma - middle {
            0.0 => 1.0,
            residual => weight(residual, scale),
        };
        sum += weight * luma;
        weights += weight;
    }
    sum / weights
}

/// All samples with the lumas of their points.
fn with_lumas<'a>(
    tracks: &'a [Vec<Sample>],
    lumas: &'a [f64],
) -> impl Iterator<Item = (&'a Sample, f64)> {
    let points = tracks.iter().zip(lumas);
    points.flat_map(|(track, &luma)| track.iter().map(move |sample| (sample, luma)))
}

/// Residual of a sample against a luma under its view's exposure, in gray.
fn residual(sample: &Sample, luma: f64, exposures: &[Exposure]) -> f64 {
    let Exposure { gain, offset } = exposures[sample.view];
    sample.value - gain * luma - offset
}

/// A robust standard deviation: 1.4826 times the median of the sizes.
fn deviation(sizes: Vec<f64>) -> f64 {
    // Photos in 256 levels are no more certain than this.
    median(sizes).map_or(0.0, |median| (1.4826 * median).max(0.3 / 255.0))
}

/// Each view's weighted regression of what it shows on the points' lumas.
fn regress(
    tracks: &[Vec<Sample>],
    lumas: &[f64],
    exposures: &[Exposure],
    scale: f64,
) -> Vec<Exposure> {
    // Weight, luma, shown, luma², luma·shown.
    let mut sums = vec![[0.0; 5]; exposures.len()];
    for (sample, luma) in with_lumas(tracks, lumas) {
        let weight = weight(residual(sample, luma, exposures), scale);
        let shown = sample.value;
        let terms = [1.0, luma, shown, luma * luma, luma * shown];
        for (sum, term) in sums[sample.view].iter_mut().zip(terms) {
            *sum += weight * term;
        }
    }
    let mean_luma = lumas.iter().sum::<f64>() / lumas.len().max(1) as f64;
    let variance =
        lumas.iter().map(|l| (l - mean_luma).powi(2)).sum::<f64>() / lumas.len().max(1) as f64;
    (sums.into_iter())
        .map(|[weights, luma, shown, square, product]| {
            // The prior's samples show what is there, at the scene's mean and spread.
            let prior = PRIOR_SAMPLES;
            let at = |sum: f64, of_prior: f64| (sum + prior * of_prior) / (weights + prior);
            let (luma, shown) = (at(luma, mean_luma), at(shown, mean_luma));
            let of_prior = variance.max(PRIOR_SPREAD * PRIOR_SPREAD) + mean_luma * mean_luma;
            let var = at(square, of_prior) - luma * luma;
            let covariance = at(product, of_prior) - luma * shown;
            // The prior has spread, so that its variance is positive.
            let gain = (covariance / var).clamp(GAIN_MIN, 1.0 / GAIN_MIN);
            Exposure {
                gain,
                offset: shown - gain * luma,
            }
        })
        .collect()
}

/// Brings the training views' medians to none: the scene is as bright as the typical photo
/// shows it, whatever a few others do.
fn center(exposures: &mut [Exposure], train: &[usize]) {
    let middle = |value: fn(&Exposure) -> f64, exposures: &[Exposure]| {
        let mut values: Vec<f64> = train.iter().map(|&v| value(&exposures[v])).collect();
        values.sort_by(f64::total_cmp);
        let (low, high) = (values.len().checked_sub(1)? / 2, values.len() / 2);
        Some((values[low] + values[high]) / 2.0)
    };
    let gain = middle(|exposure| exposure.gain, exposures).unwrap_or(1.0);
    for exposure in exposures.iter_mut() {
        exposure.gain /= gain;
    }
    let offset = middle(|exposure| exposure.offset, exposures).unwrap_or(0.0);
    for exposure in exposures {
        exposure.offset -= offset;
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::effects::fixtures::{capture, looking_along_z, photo};

    /// Points of random luma, each seen by four views from all over the capture, with noise.
    fn tracks(truth: &[Exposure], points: usize, noise: f64) -> Vec<Vec<Sample>> {
        tracks_of(truth, points, noise, |random| {
            let first = random.usize(..truth.len());
            [0, 3, 6, 9].map(|k| (first + k) % truth.len())
        })
    }

    fn tracks_of(
        truth: &[Exposure],
        points: usize,
        noise: f64,
        seen_by: impl Fn(&mut fastrand::Rng) -> [usize; 4],
    ) -> Vec<Vec<Sample>> {
        let mut random = fastrand::Rng::with_seed(5);
        (0..points)
            .map(|_| {
                let luma = 0.25 + 0.5 * random.f64();
                (seen_by(&mut random).into_iter())
                    .map(|view| {
                        // About normal; one in fifty is something else entirely.
                        let normal: f64 = (0..12).map(|_| random.f64()).sum::<f64>() - 6.0;
                        let shown = match random.u32(..50) {
                            0 => random.f64(),
                            _ => truth[view].gain * luma + truth[view].offset + noise * normal,
                        };
                        Sample {
                            view,
                            value: shown,
                            direction: DVec3::Z,
                        }
                    })
                    .collect()
            })
            .collect()
    }

    #[test]
    fn exposures_are_found_among_noise_and_outliers() {
        let truth: Vec<Exposure> = (0..10)
            .map(|v| Exposure {
                gain: (0.2 * (f64::from(v) - 4.5) / 4.5).exp(),
                offset: 0.03 * f64::from((v * 7) % 10 - 4) - 0.015,
            })
            .collect();
        let train: Vec<usize> = (0..10).collect();
        let found = find_exposures(&tracks(&truth, 3000, 0.02), 10, &train);
        for (found, truth) in found.views.iter().zip(&truth) {
            for luma in [0.3, 0.7] {
                let difference = found.shown(luma) - truth.shown(luma);
                assert!(difference.abs() < 0.008, "{found:?} {truth:?}");
            }
        }
        assert!(
            found.spread > 10.0 * found.noise,
            "{} {}",
            found.spread,
            found.noise
        );
        // Neighbors differ as much as any two.
        assert_eq!(found.local, found.views);
        assert!(!found.drifts);
    }

    /// A flight along which it gets darker: views next to each other see the same points.
    #[test]
    fn a_scene_follows_exposures_that_drift() {
        let train: Vec<usize> = (0..20).collect();
        let mut truth = [Exposure::NONE; 20];
        for (view, exposure) in truth.iter_mut().enumerate() {
            exposure.offset = 0.1 - 0.2 * view as f64 / 19.0;
        }
        let found = |truth: &[Exposure]| {
            let tracks = tracks_of(truth, 3000, 0.01, |random| {
                let first = random.usize(..17);
                [0, 1, 2, 3].map(|k| first + k)
            });
            find_exposures(&tracks, 20, &train)
        };
        let along = found(&truth);
        let away = |of: &[Exposure], view: usize| of[view].shown(0.5) - 0.5;
        for end in [0, 19] {
            assert!(away(&along.views, end).abs() > 0.05);
            assert!(away(&along.local, end).abs() < 0.02);
        }
        let between = (3..17).map(|view| away(&along.local, view).abs());
        assert!(between.fold(0.0, f64::max) < 0.005);
        // One photo that differs from the others does so still; a fourth of each mean is its own.
        truth[10].offset += 0.1;
        let one_off = found(&truth);
        assert!(along.drifts && one_off.drifts);
        let shown = away(&one_off.local, 10);
        assert!((0.05..0.08).contains(&shown), "{shown}");
    }

    #[test]
    fn equal_exposures_spread_no_more_than_noise() {
        let truth = [Exposure::NONE; 10];
        let train: Vec<usize> = (1..10).collect();
        let found = find_exposures(&tracks(&truth, 1000, 0.03), 10, &train);
        assert!(
            found.spread < 2.0 * found.noise,
            "{} {}",
            found.spread,
            found.noise
        );
        let above = |view: &&usize| found.views[**view].gain > 1.0;
        let below = |view: &&usize| found.views[**view].gain < 1.0;
        let count = |which: &dyn Fn(&&usize) -> bool| train.iter().filter(which).count();
        assert_eq!(count(&above), count(&below));
    }

    /// A mean would be off by 0.06.
    #[test]
    fn the_scene_is_as_bright_as_the_typical_photo() {
        let mut truth = [Exposure::NONE; 10];
        for dark in &mut truth[..2] {
            dark.offset = -0.2;
        }
        truth[4].gain = 0.5;
        let train: Vec<usize> = (0..10).collect();
        let found = find_exposures(&tracks(&truth, 3000, 0.01), 10, &train);
        for typical in [2, 3, 5, 6, 7, 8, 9] {
            let shown = found.views[typical].shown(0.5);
            assert!((shown - 0.5).abs() < 0.005, "{shown}");
        }
        assert!((found.views[0].shown(0.5) - 0.3).abs() < 0.01);
    }

    #[test]
    fn faces_of_a_photo_share_its_exposure() {
        let camera = looking_along_z(DVec3::ZERO, 10);
        let photos: Vec<_> = (0..6)
            .map(|_| (photo(&camera, |_, _| 0), camera.clone()))
            .collect();
        let mut views = capture(&photos, []).views;
        for (view, name) in views.iter_mut().zip(["a", "a", "b", "b", "c", "d"]) {
            view.photo = name.to_owned();
        }
        // The second face of `a` sees nothing that others see.
        let of_photo = [0.04, 0.04, -0.02, -0.02, 0.0, 0.0];
        let truth = of_photo.map(|offset| Exposure { gain: 1.0, offset });
        let mut tracks = tracks(&truth, 2000, 0.005);
        for track in &mut tracks {
            track.retain(|sample| sample.view != 1);
        }
        tracks.retain(|track| track.len() >= 2);
        let train = [0, 1, 2, 3, 4, 5];
        let found = find_photo_exposures(&tracks, &views, &train);
        assert_eq!(found.views[0], found.views[1]);
        assert_eq!(found.views[2], found.views[3]);
        assert_eq!(found.local[0], found.local[1]);
        for (found, truth) in found.views.iter().zip(&truth) {
            assert!(
                (found.shown(0.5) - truth.shown(0.5)).abs() < 0.005,
                "{found:?} {truth:?}"
            );
        }
        let apart = find_exposures(&tracks, 6, &train);
        assert!((apart.views[1].shown(0.5) - truth[1].shown(0.5)).abs() > 0.02);
    }

    #[test]
    fn without_tracks_there_is_nothing_to_find() {
        let found = find_exposures(&[], 3, &[0, 2]);
        assert_eq!(found.views, [Exposure::NONE; 3]);
        assert_eq!(found.local, found.views);
        assert_eq!(find_photo_exposures(&[], &[], &[]).views, []);
        assert_eq!((found.spread, found.noise), (0.0, 0.0));
    }
}
