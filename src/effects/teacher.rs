//! Whether a teacher colours the same place alike in all views.

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

/// Compares the answers at COLMAP's points. `answers` are a/b `[height, width]` of the
/// capture's views in the size of `cameras`, where the teacher has one.
///
/// `None` where no point is seen in two of them.
pub fn teacher_spread(
    capture: &Capture,
    cameras: &[&Camera],
    answers: &[Option<&[[f32; 2]]>],
) -> Option<TeacherSpread> {
    let taught: Vec<usize> = (0..answers.len())
        .filter(|&v| answers[v].is_some())
        .collect();
    let (mut spread, mut noise) = (0.0, 0.0);
    for channel in 0..2 {
        let tracks: Vec<Vec<Sample>> = (capture.points.iter())
            .map(|point| {
                (point.track.iter())
                    .filter_map(|seen| {
                        let camera = cameras[seen.view];
                        let [x, y] = place_in(camera, &capture.views[seen.view].camera, seen.pixel);
                        let inside = x >= 0.0
                            && y >= 0.0
                            && x < f64::from(camera.width)
                            && y < f64::from(camera.height);
                        let pixel = y as usize * camera.width as usize + x as usize;
                        let ab = answers[seen.view].filter(|_| inside)?[pixel];
                        Some(Sample {
                            view: seen.view,
                            value: 0.5 + f64::from(ab[channel]) / UNITS,
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
        let found = find_exposures(&tracks, answers.len(), &taught);
        spread += found.spread * found.spread;
        noise += found.noise * found.noise;
    }
    Some(TeacherSpread {
        spread: UNITS * spread.sqrt(),
        noise: UNITS * noise.sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::{
        capture::Observation,
        effects::fixtures::{capture, looking_along_z, photo},
    };

    /// Four views of points on a plane, coloured by place; `tint` is added to each view's a.
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
        let cameras: Vec<&Camera> = photos.iter().map(|(_, camera)| camera).collect();
        let answers: Vec<Option<&[[f32; 2]]>> = answers.iter().map(|a| Some(&a[..])).collect();
        teacher_spread(&capture, &cameras, &answers)
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
