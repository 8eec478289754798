//! Whether a teacher colors the same place alike in all views.

use super::{
    exposure::find_exposures,
    tracks::{Sample, place_in},
};
use crate::capture::{Camera, Capture};

/// CIELAB units that become one, so that a/b are of the size of gray: -128 to 127.
const UNITS: f64 = 255.0;

/// How far the teacher's views differ in saturation and tint, in CIELAB units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TeacherSpread {
    /// What gains and offsets of the views explain, root mean square over both channels.
    pub spread: f64,
    /// How large that would be by chance, from the noise at the points.
    pub noise: f64,
}

/// What a teacher says at COLMAP's points, taken view by view.
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
            let tracks: Vec<Vec<Sample>> = (capture.points.iter().zip(&self.ab))
                .map(|(point, ab)| {
                    (point.track.iter().zip(ab))
                        .filter_map(|(seen, ab)| {
                            let camera = self.cameras[seen.view].as_ref()?;
                            let value = f64::from((*ab)?[channel]);
                            Some(Sample {
                                view: seen.view,
                                value: 0.5 + value / UNITS,
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
        })
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

    /// Four views of points on a plane, colored by place; `tint` is added to each view's a.
    fn spread(tint: [f32; 4]) -> Option<TeacherSpread> {
        let photos: Vec<_> = (0..4)
            .map(|k| {
                let camera = looking_along_z(DVec3::new(0.1 * f64::from(k), 0.0, -4.0), 32);
                (photo(&camera, |_, _| 128), camera)
            })
            .collect();
        let points = (0..400).map(|i| {
            DVec3::new(f64::from(i % 20), f64::from(i / 20), 0.0) * 0.05 - DVec3::splat(0.4)
        });
        let mut capture = capture(&photos, points);
        for point in &mut capture.points {
            point.track = (0..4)
                .filter_map(|view| {
                    let pixel = photos[view].1.pixel_of(point.position)?;
                    Some(Observation { view, pixel })
                })
                .collect();
        }
        let answers: Vec<Vec<[f32; 2]>> = photos
            .iter()
            .zip(tint)
            .map(|((_, camera), tint)| {
                let pixels = 0..camera.width * camera.height;
                pixels
                    .map(|p| [20.0 + tint, (p / camera.width) as f32])
                    .collect()
            })
            .collect();
        let mut samples = TeacherSamples::new(&capture);
        for (view, ((_, camera), ab)) in photos.iter().zip(&answers).enumerate() {
            samples.take(&capture, view, camera, ab);
        }
        samples.spread(&capture)
    }

    #[test]
    fn tints_are_found() {
        let found = spread([-9.0, 3.0, -3.0, 9.0]).unwrap();
        assert!((5.0..8.0).contains(&found.spread), "{found:?}");
        assert!(found.spread > 3.0 * found.noise, "{found:?}");
        let alike = spread([0.0; 4]).unwrap();
        assert!(alike.spread < 1.0, "{alike:?}");
    }
}
