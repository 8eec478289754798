//! Consistency of a teacher's colors between views.

use super::{
    exposure::find_exposures,
    tracks::{Sample, place_in},
};
use crate::capture::{Camera, Capture};

/// CIELAB units that become one, so that a/b are of the size of gray: -128 to 127. They are
/// counted from their mean over all points: a gain about another value would shift the views
/// against each other, and what pale teachers say would decide by how much.
const UNITS: f64 = 255.0;

/// Differences of the teacher's views in saturation and tint, in CIELAB units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TeacherSpread {
    /// Effect of the views' gains and offsets, root mean square over both channels.
    pub spread: f64,
    /// Expected spread by chance, from the noise at the points.
    pub noise: f64,
    /// Share of the mean square of a and b, 0 to 1, that the views agree on at the points: what
    /// one says times what another says, over what each says squared. Whims of single views
    /// cancel in the first.
    pub agreed: f64,
}

/// The teacher's colors at COLMAP's points, collected view by view.
pub struct TeacherSamples {
    /// For each view the points it shows, and their places in the points' tracks.
    seen: Vec<Vec<(usize, usize)>>,
    /// `[points][track]`: a/b of each observation, where it is known.
    ab: Vec<Vec<Option<[f32; 2]>>>,
    /// Cameras of the views that were taken.
    cameras: Vec<Option<Camera>>,
}

impl TeacherSamples {
    /// None yet.
    pub fn new(capture: &Capture) -> Self {
        let mut seen = vec![Vec::new(); capture.views.len()];
        for (index, point) in capture.points.iter().enumerate() {
            for (place, observation) in point.track.iter().enumerate() {
                seen[observation.view].push((index, place));
            }
        }
        Self {
            seen,
            ab: (capture.points.iter())
                .map(|point| vec![None; point.track.len()])
                .collect(),
            cameras: vec![None; capture.views.len()],
        }
    }

    /// Takes a view's a/b, `[height, width]` in the size of `camera`.
    pub fn take(&mut self, capture: &Capture, view: usize, camera: &Camera, ab: &[[f32; 2]]) {
        for &(point, place) in &self.seen[view] {
            let pixel = capture.points[point].track[place].pixel;
            let [x, y] = place_in(camera, &capture.views[view].camera, pixel);
            let inside =
                x >= 0.0 && y >= 0.0 && x < f64::from(camera.width) && y < f64::from(camera.height);
            let at = y as usize * camera.width as usize + x as usize;
            self.ab[point][place] = ab.get(at).copied().filter(|_| inside);
        }
        self.cameras[view] = Some(camera.clone());
    }

    /// Compares the views. `None` where no point is seen in two of them.
    pub fn spread(&self, capture: &Capture) -> Option<TeacherSpread> {
        let views = self.cameras.len();
        let taught: Vec<usize> = (0..views).filter(|&v| self.cameras[v].is_some()).collect();
        let (mut spread, mut noise) = (0.0, 0.0);
        for channel in 0..2 {
            let known = || {
                self.ab
                    .iter()
                    .flatten()
                    .flatten()
                    .map(|ab| f64::from(ab[channel]))
            };
            let mean = known().sum::<f64>() / known().count().max(1) as f64;
            let tracks: Vec<Vec<Sample>> = (capture.points.iter().zip(&self.ab))
                .map(|(point, ab)| {
                    (point.track.iter().zip(ab))
                        .filter_map(|(seen, ab)| {
                            let camera = self.cameras[seen.view].as_ref()?;
                            let value = f64::from((*ab)?[channel]);
                            Some(Sample {
                                view: seen.view,
                                value: (value - mean) / UNITS,
                                direction: (point.position - camera.center()).normalize_or_zero(),
                            })
                        })
                        .collect::<Vec<Sample>>()
                })
                .filter(|samples| samples.len() >= 2)
                .collect();
            if tracks.is_empty() {
                return None;
            }
            let found = find_exposures(&tracks, views, &taught);
            spread += found.spread * found.spread;
            noise += found.noise * found.noise;
        }
        Some(TeacherSpread {
            spread: UNITS * spread.sqrt(),
            noise: UNITS * noise.sqrt(),
            agreed: self.agreed(),
        })
    }

    /// Disagreement of the views at the points after the correction `corrected`: the mean square of
    /// a and b about their point's mean, over that about the mean of all. It does not fall if
    /// corrections make all paler or tint all alike. `None` if no point is seen in two views, or
    /// all agree.
    pub fn disagreement(
        &self,
        capture: &Capture,
        corrected: impl Fn(usize, [f32; 2]) -> [f32; 2],
    ) -> Option<f64> {
        let (mut within, mut freedom) = (0.0, 0.0);
        let (mut count, mut sums, mut squares) = (0.0, [0.0; 2], 0.0);
        for (point, ab) in capture.points.iter().zip(&self.ab) {
            let known: Vec<[f64; 2]> = (point.track.iter().zip(ab))
                .filter_map(|(seen, ab)| Some(corrected(seen.view, (*ab)?).map(f64::from)))
                .collect();
            if known.len() < 2 {
                continue;
            }
            let views = known.len() as f64;
            for channel in 0..2 {
                let sum: f64 = known.iter().map(|ab| ab[channel]).sum();
                let square: f64 = known.iter().map(|ab| ab[channel] * ab[channel]).sum();
                within += square - sum * sum / views;
                sums[channel] += sum;
                squares += square;
            }
            freedom += views - 1.0;
            count += views;
        }
        let about_all = squares - sums.iter().map(|sum| sum * sum / count).sum::<f64>();
        (about_all > 0.0).then(|| within / freedom / (about_all / count))
    }

    /// See [`TeacherSpread::agreed`].
    fn agreed(&self) -> f64 {
        let (mut between, mut own) = (0.0, 0.0);
        for point in &self.ab {
            let known = || point.iter().flatten();
            let count = known().count() as f64;
            if count < 2.0 {
                continue;
            }
            for channel in 0..2 {
                let values = || known().map(|ab| f64::from(ab[channel]));
                let (sum, squares) = (values().sum::<f64>(), values().map(|v| v * v).sum::<f64>());
                // All products of two different views.
                between += (sum * sum - squares) / (count * (count - 1.0));
                own += squares / count;
            }
        }
        if own > 0.0 {
            (between / own).clamp(0.0, 1.0)
        } else {
            1.0
        }
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::{
        capture::Observation,
        effects::fixtures::{capture, looking_along_z, photo},
    };

    /// Views of points on a plane, and what each says of a point.
    fn spread(views: usize, says: impl Fn(usize, usize) -> [f32; 2]) -> TeacherSpread {
        let (capture, samples) = sampled(views, says);
        samples.spread(&capture).expect("points in many views")
    }

    fn sampled(views: usize, says: impl Fn(usize, usize) -> [f32; 2]) -> (Capture, TeacherSamples) {
        const SIDE: u32 = 32;
        let photos: Vec<_> = (0..views)
            .map(|k| {
                let camera = looking_along_z(DVec3::new(0.02 * k as f64, 0.0, -4.0), SIDE);
                (photo(&camera, |_, _| 128), camera)
            })
            .collect();
        let points = (0..400).map(|i| {
            DVec3::new(f64::from(i % 20), f64::from(i / 20), 0.0) * 0.05 - DVec3::splat(0.4)
        });
        let mut capture = capture(&photos, points);
        for point in &mut capture.points {
            point.track = (0..views)
                .filter_map(|view| {
                    let pixel = photos[view].1.pixel_of(point.position)?;
                    Some(Observation { view, pixel })
                })
                .collect();
        }
        let mut samples = TeacherSamples::new(&capture);
        for (view, (_, camera)) in photos.iter().enumerate() {
            let ab: Vec<[f32; 2]> = (0..camera.width * camera.height)
                .map(|p| says(view, p as usize))
                .collect();
            samples.take(&capture, view, camera, &ab);
        }
        (capture, samples)
    }

    /// A color by place, that changes from pixel to pixel by this much.
    fn by_place(pixel: usize, strength: f32) -> [f32; 2] {
        let [x, y] = [pixel % 32, pixel / 32].map(|v| v as f32 / 16.0 - 1.0);
        [strength * x, strength * y]
    }

    /// Noise of a teacher, -1 to 1.
    fn whim(view: usize, pixel: usize) -> f32 {
        fastrand::Rng::with_seed((view * 4096 + pixel) as u64).f32() * 2.0 - 1.0
    }

    #[test]
    fn tints_are_found() {
        let tints = [-9.0, 3.0, -3.0, 9.0];
        let found = spread(4, |view, p| {
            let [a, b] = by_place(p, 12.0);
            [20.0 + a + tints[view], b]
        });
        // Root mean square of the tints.
        assert!((found.spread - 6.7).abs() < 0.7, "{found:?}");
        assert!(found.spread > 3.0 * found.noise, "{found:?}");
        let alike = spread(4, |_, p| by_place(p, 12.0));
        assert!(alike.spread < 1.0, "{alike:?}");
    }

    #[test]
    fn what_views_agree_on() {
        for (color, amount) in [(12.0, 0.0), (12.0, 12.0), (6.0, 18.0), (0.0, 9.0)] {
            let found = spread(6, |view, p| {
                [0, 1].map(|c| color + amount * whim(view + 50 * c, p))
            });
            // Whims between -1 and 1 have a mean square of a third.
            let [own, whims] = [color, amount / 3.0_f32.sqrt()].map(|v| f64::from(v * v));
            let expected = own / (own + whims);
            assert!(
                (found.agreed - expected).abs() < 0.05,
                "{found:?} {expected}"
            );
        }
        assert_eq!(spread(4, |_, _| [0.0; 2]).agreed, 1.0);
        assert!(spread(4, |_, _| [3.0, -40.0]).agreed > 0.9999);
    }

    #[test]
    fn corrections_are_judged_by_what_they_bring() {
        let color = |p: usize| by_place(p, 20.0);
        let tint = |view: usize| [view as f32 - 1.5, 0.0];
        let says = |view, p| [0, 1].map(|c| color(p)[c] + tint(view)[c] + 0.1 * whim(c, p));
        let (capture, samples) = sampled(4, says);
        let disagreement = |corrected: &dyn Fn(usize, [f32; 2]) -> [f32; 2]| {
            let found = samples.disagreement(&capture, corrected);
            found.expect("points in many views")
        };
        let before = disagreement(&|_, ab| ab);
        let right = disagreement(&|view, [a, b]| [a - tint(view)[0], b]);
        let wrong = disagreement(&|view, [a, b]| [a + tint(view)[0], b]);
        assert!(
            right < 0.7 * before && wrong > 1.5 * before,
            "{right} {before} {wrong}"
        );
        // All paler and all of one tint agree no better.
        let pale = disagreement(&|_, [a, b]| [0.1 * a + 30.0, 0.1 * b]);
        assert!((pale / before - 1.0).abs() < 1e-3, "{pale} {before}");
        // One color everywhere says nothing.
        let (capture, samples) = sampled(4, |_, _| [5.0, 5.0]);
        assert_eq!(samples.disagreement(&capture, |_, ab| ab), None);
    }

    /// A teacher that hardly says anything, far from gray or not, does not differ from view
    /// to view.
    #[test]
    fn pale_and_constant_teachers_do_not_differ() {
        for far in [0.0, 60.0] {
            let constant = spread(12, |_, _| [far, -far]);
            assert!(constant.spread < 0.1, "{constant:?}");
            let pale = spread(12, |view, p| [far + whim(view, p), whim(view + 50, p)]);
            assert!(pale.spread < 3.0 * pale.noise.max(0.1), "{pale:?}");
        }
    }

    #[test]
    fn one_view_of_a_color_of_its_own_is_found() {
        let found = spread(12, |view, p| {
            let tint = if view == 4 { [30.0, 20.0] } else { [0.0; 2] };
            let own = by_place(p, 2.0);
            [0, 1].map(|c| own[c] + tint[c] + 0.5 * whim(view + 50 * c, p))
        });
        // Its tint about the mean of all. The prior holds what is so far off back a little.
        let expected = (1300.0_f64 * 11.0).sqrt() / 12.0;
        let share = found.spread / expected;
        assert!((0.75..1.05).contains(&share), "{found:?}");
    }
}
