//! Points where photos have texture and COLMAP has none: without a Gaussian nothing is split, and
//! a lawn stays a blur.
//!
//! Photos are matched at depths around those of the points nearby, by normalized
//! cross-correlation, as plane sweeps do (Collins 1996; the photos that are compared stay as they
//! are, patches face the camera).

use std::{
    collections::{BTreeSet, HashMap},
    num::NonZero,
    thread,
};

use glam::DVec3;

use super::TrainingView;
use crate::capture::{Camera, Capture, CaptureError, Dataset, Photo};

/// Longer side of the photos that are matched, at most: enough to find a depth by.
const SIDE: u32 = 480;

/// Photos that are matched, at most, evenly chosen: each with so many of its nearest ones.
const MAX_VIEWS: usize = 48;
const NEIGHBORS: usize = 6;

/// Cells across a photo: in each without a point one may be found.
const CELLS: u32 = 80;

/// Distance in cells within which no point may lie: where there are some, splitting them is better.
const GAP: f64 = 2.5;

/// Points nearest to a cell in the photo, whose depths bound those that are tried, and by which
/// factors these reach beyond them.
const NEAREST: usize = 6;
const BEYOND: [f64; 2] = [0.7, 1.4];

/// Depths that are tried, evenly spaced in 1 / depth.
const DEPTHS: usize = 24;

/// Steps between two of them at which the best is tried again.
const FINER: [f64; 4] = [-0.5, -0.25, 0.25, 0.5];

/// Pixels from the middle of a patch to its sides.
const REACH: i32 = 3;
const PATCH: usize = ((2 * REACH + 1) * (2 * REACH + 1)) as usize;

/// Standard deviation of a patch, in gray levels, from which on it has texture.
const TEXTURE: f64 = 4.0;

/// Correlation with the photos nearby, the mean of the best two, from which a depth is believed:
/// at 0.6, woods get points that other views show to be wrong (docs/lab/16-ends-and-gaps.md).
const CORRELATED: f64 = 0.8;

/// A point that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GapPoint {
    /// World coordinates.
    pub position: DVec3,
    /// Encoded gray, 0 to 1.
    pub gray: f32,
}

/// A small photo with its camera.
struct Small {
    camera: Camera,
    gray: Vec<u8>,
    mask: Option<Vec<u8>>,
}

impl Small {
    fn of(camera: Camera, photo: &Photo) -> Self {
        let mut view = TrainingView {
            mask: photo.mask.clone(),
            ..TrainingView::new(camera, photo.gray.clone())
        };
        while view.camera.width.max(view.camera.height) > SIDE {
            view = view.halved();
        }
        Self {
            camera: view.camera,
            gray: view.gray,
            mask: view.mask,
        }
    }

    fn at(&self, x: i32, y: i32) -> Option<f64> {
        let (width, height) = (self.camera.width as i32, self.camera.height as i32);
        let inside = (0..width).contains(&x) && (0..height).contains(&y);
        let pixel = inside.then(|| (y * width + x) as usize)?;
        let counts = self.mask.as_ref().is_none_or(|mask| mask[pixel] >= 128);
        counts.then(|| f64::from(self.gray[pixel]))
    }

    /// Between four pixels, whose centers are at halves.
    fn between(&self, [x, y]: [f64; 2]) -> Option<f64> {
        let (x, y) = (x - 0.5, y - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (s, t) = (x - left, y - top);
        let at = |dx, dy| self.at(left as i32 + dx, top as i32 + dy);
        let above = at(0, 0)? * (1.0 - s) + at(1, 0)? * s;
        let below = at(0, 1)? * (1.0 - s) + at(1, 1)? * s;
        Some(above * (1.0 - t) + below * t)
    }

    /// The place at a depth along the ray of a pixel.
    fn place(&self, [x, y]: [f64; 2], depth: f64) -> DVec3 {
        let camera = &self.camera;
        let seen = DVec3::new(
            (x - camera.cx) / camera.fx,
            (y - camera.cy) / camera.fy,
            1.0,
        );
        camera.rotation.transpose() * (seen * depth - camera.translation)
    }

    fn project(&self, place: DVec3) -> Option<([f64; 2], f64)> {
        let pixel = self.camera.pixel_of(place)?;
        let depth = (self.camera.rotation * place + self.camera.translation).z;
        Some((pixel, depth))
    }
}

/// A patch of zero mean and unit length, and what it was before.
struct Patch {
    values: [f64; PATCH],
    mean: f64,
    deviation: f64,
}

impl Patch {
    fn of(mut value: impl FnMut(i32, i32) -> Option<f64>) -> Option<Self> {
        let mut values = [0.0; PATCH];
        let mut offsets = (-REACH..=REACH).flat_map(|y| (-REACH..=REACH).map(move |x| (x, y)));
        for to in &mut values {
            let (x, y) = offsets.next()?;
            *to = value(x, y)?;
        }
        let mean = values.iter().sum::<f64>() / PATCH as f64;
        let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
        let length = squares.sqrt().max(f64::MIN_POSITIVE);
        values
            .iter_mut()
            .for_each(|value| *value = (*value - mean) / length);
        let deviation = (squares / PATCH as f64).sqrt();
        Some(Self {
            values,
            mean,
            deviation,
        })
    }

    fn correlation(&self, other: &Self) -> f64 {
        self.values
            .iter()
            .zip(&other.values)
            .map(|(a, b)| a * b)
            .sum()
    }
}

/// At most `most` points where the training photos show something and the capture has none.
///
/// # Errors
/// [`CaptureError`] of a photo.
pub(super) fn gap_points(dataset: &Dataset, most: usize) -> Result<Vec<GapPoint>, CaptureError> {
    let train = &dataset.split.train;
    let count = train.len().min(MAX_VIEWS);
    let views: Vec<usize> = (0..count).map(|k| train[k * train.len() / count]).collect();
    let mut photos = Vec::new();
    dataset.visit(&views, |view, photo| {
        photos.push((view, Small::of(dataset.cameras[view].clone(), photo)));
        Ok::<_, CaptureError>(())
    })?;
    Ok(found(&dataset.capture, &photos, most))
}

fn found(capture: &Capture, photos: &[(usize, Small)], most: usize) -> Vec<GapPoint> {
    let mut found: Vec<GapPoint> = Vec::new();
    for ((number, photo), points) in photos.iter().zip(seen_points(capture, photos)) {
        let neighbors = nearest_photos(photo, photos, *number);
        let more = Gaps::of(photo, &points, &found).filled(&neighbors);
        found.extend(more);
    }
    let kept = found.len().min(most);
    (0..kept).map(|k| found[k * found.len() / kept]).collect()
}

/// Those taken from nearest by.
fn nearest_photos<'a>(
    photo: &Small,
    photos: &'a [(usize, Small)],
    number: usize,
) -> Vec<&'a Small> {
    let distance = |other: &Small| {
        other
            .camera
            .center()
            .distance_squared(photo.camera.center())
    };
    let mut others: Vec<&Small> = (photos.iter())
        .filter(|(other, _)| *other != number)
        .map(|(_, other)| other)
        .collect();
    others.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    others.truncate(NEIGHBORS);
    others
}

/// Of each photo, pixel and depth of the points that it shows: those that were found in it, or
/// all before it where the model does not say.
fn seen_points(capture: &Capture, photos: &[(usize, Small)]) -> Vec<Vec<([f64; 2], f64)>> {
    let tracked = capture.points.iter().any(|point| !point.track.is_empty());
    let places: HashMap<usize, usize> = (photos.iter().zip(0..))
        .map(|((number, _), place)| (*number, place))
        .collect();
    let mut seen = vec![Vec::new(); photos.len()];
    for point in &capture.points {
        let showing: BTreeSet<usize> = match tracked {
            true => (point.track.iter())
                .filter_map(|observation| places.get(&observation.view).copied())
                .collect(),
            false => (0..photos.len()).collect(),
        };
        for place in showing {
            seen[place].extend(photos[place].1.project(point.position));
        }
    }
    seen
}

/// The cells of a photo in which there is no point.
struct Gaps<'a> {
    photo: &'a Small,
    points: &'a [([f64; 2], f64)],
    /// Side of a cell in pixels.
    side: f64,
    columns: usize,
    occupied: Vec<bool>,
}

impl<'a> Gaps<'a> {
    fn of(photo: &'a Small, points: &'a [([f64; 2], f64)], found: &[GapPoint]) -> Self {
        let camera = &photo.camera;
        let side = (f64::from(camera.width.max(camera.height)) / f64::from(CELLS)).max(2.0);
        let [columns, rows] =
            [camera.width, camera.height].map(|length| (f64::from(length) / side).ceil() as usize);
        let mut gaps = Self {
            photo,
            points,
            side,
            columns,
            occupied: vec![false; columns * rows],
        };
        let before = found
            .iter()
            .filter_map(|point| photo.project(point.position));
        for (pixel, _) in points.iter().copied().chain(before) {
            let [column, row] = pixel.map(|at| (at / side) as usize);
            gaps.occupied[row * columns + column] = true;
        }
        gaps
    }

    /// What the photos around show in them.
    fn filled(&self, neighbors: &[&Small]) -> Vec<GapPoint> {
        if self.points.len() < NEAREST || neighbors.len() < 2 {
            return Vec::new();
        }
        let empty = self
            .occupied
            .iter()
            .enumerate()
            .filter(|(_, taken)| !**taken);
        let pixels: Vec<[f64; 2]> = empty
            .map(|(index, _)| {
                let cell = [index % self.columns, index / self.columns];
                cell.map(|at| ((at as f64 + 0.5) * self.side).floor() + 0.5)
            })
            .collect();
        let threads = thread::available_parallelism().map_or(1, NonZero::get);
        let share = pixels.len().div_ceil(threads).max(1);
        // In the order of the cells, however many threads there are.
        thread::scope(|scope| {
            let parts: Vec<_> = (pixels.chunks(share))
                .map(|part| {
                    let found = |&pixel: &[f64; 2]| self.point_at(pixel, neighbors);
                    scope.spawn(move || part.iter().filter_map(found).collect::<Vec<_>>())
                })
                .collect();
            let joined = parts
                .into_iter()
                .map(|part| part.join().unwrap_or_default());
            joined.flatten().collect()
        })
    }

    /// The point on the ray of a pixel.
    fn point_at(&self, pixel: [f64; 2], neighbors: &[&Small]) -> Option<GapPoint> {
        let [x, y] = pixel.map(|at| at as i32);
        let patch = Patch::of(|dx, dy| self.photo.at(x + dx, y + dy))?;
        if patch.deviation < TEXTURE {
            return None;
        }
        let [nearest, farthest] = self.depths_around(pixel)?;
        let step = (1.0 / farthest - 1.0 / nearest) / (DEPTHS - 1) as f64;
        let at = |steps: f64| 1.0 / (1.0 / nearest + steps * step);
        let score = |steps: &f64| self.agreement(&patch, pixel, at(*steps), neighbors);
        let best = |tried: &mut dyn Iterator<Item = f64>| {
            let scored = tried.filter_map(|steps| Some((score(&steps)?, steps)));
            scored.max_by(|(a, _), (b, _)| a.total_cmp(b))
        };
        let (_, coarse) = best(&mut (0..DEPTHS).map(|k| k as f64))?;
        let finer = FINER.iter().map(|finer| coarse + finer);
        let (score, steps) = best(&mut std::iter::once(coarse).chain(finer))?;
        (score > CORRELATED).then(|| GapPoint {
            position: self.photo.place(pixel, at(steps)),
            gray: (patch.mean / 255.0) as f32,
        })
    }

    /// The mean of a patch's best two correlations with other photos, if it is at a depth.
    fn agreement(
        &self,
        patch: &Patch,
        pixel: [f64; 2],
        depth: f64,
        neighbors: &[&Small],
    ) -> Option<f64> {
        let mut scores: Vec<f64> = (neighbors.iter())
            .filter_map(|other| self.correlation(patch, pixel, depth, other))
            .collect();
        scores.sort_by(|a, b| b.total_cmp(a));
        match scores[..] {
            [first, second, ..] => Some((first + second) / 2.0),
            _ => None,
        }
    }

    /// The depths between which the ray of a pixel may end; `None` where a point is near.
    fn depths_around(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        let mut near: Vec<(f64, f64)> = (self.points.iter())
            .map(|([u, v], depth)| ((u - x).powi(2) + (v - y).powi(2), *depth))
            .collect();
        near.select_nth_unstable_by(NEAREST - 1, |a, b| a.0.total_cmp(&b.0));
        let closest = near[..NEAREST]
            .iter()
            .fold(f64::INFINITY, |least, (d, _)| least.min(*d));
        if closest.sqrt() < GAP * self.side {
            return None;
        }
        let depths = near[..NEAREST].iter().map(|(_, depth)| *depth);
        let [closer, beyond] = BEYOND;
        Some([
            closer * depths.clone().fold(f64::INFINITY, f64::min),
            beyond * depths.fold(0.0, f64::max),
        ])
    }

    /// How a patch correlates with another photo if it is at a depth.
    fn correlation(
        &self,
        patch: &Patch,
        [x, y]: [f64; 2],
        depth: f64,
        other: &Small,
    ) -> Option<f64> {
        let seen = Patch::of(|dx, dy| {
            let place = self
                .photo
                .place([x + f64::from(dx), y + f64::from(dy)], depth);
            other.between(other.camera.pixel_of(place)?)
        })?;
        Some(patch.correlation(&seen))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::fixtures::{capture, looking_along_z, photo};

    /// What a textured wall at a depth of 4 shows at a place.
    fn texture(x: f64, y: f64) -> u8 {
        let wave = (25.0 * x).sin() + (31.0 * y + 9.0 * x).sin() + (17.0 * x - 23.0 * y).cos();
        (128.0 + 35.0 * wave) as u8
    }

    fn photos(flat: bool) -> (Capture, Vec<(usize, Small)>) {
        let shots: Vec<_> = [-0.4, 0.0, 0.4]
            .map(|x| {
                let camera = looking_along_z(DVec3::new(x, 0.0, 0.0), 160);
                let (fx, cx, cy) = (camera.fx, camera.cx, camera.cy);
                let show = |u: u32, v: u32| {
                    let at = [f64::from(u) + 0.5 - cx, f64::from(v) + 0.5 - cy];
                    let [right, down] = at.map(|at| at / fx * 4.0);
                    match flat {
                        true => 100,
                        false => texture(x + right, down),
                    }
                };
                (photo(&camera, show), camera)
            })
            .into();
        // Points on the upper half only.
        let points = (-20..20).flat_map(|x| (-10..-1).map(move |y| [x, y]));
        let points = points.map(|at| {
            let [x, y] = at.map(|at| f64::from(at) * 0.2);
            DVec3::new(x, y, 4.0)
        });
        let capture = capture(&shots, points);
        let small = shots.into_iter().enumerate();
        let small = small.map(|(k, (photo, camera))| (k, Small::of(camera, &photo)));
        (capture, small.collect())
    }

    #[test]
    fn a_wall_is_found_where_it_has_no_points() {
        let (capture, photos) = photos(false);
        let points = found(&capture, &photos, 100_000);
        let below: Vec<_> = points
            .iter()
            .filter(|point| point.position.y > 0.2)
            .collect();
        assert!(below.len() > 300, "{} of {}", below.len(), points.len());
        let off = |point: &&&GapPoint| (point.position.z - 4.0).abs() > 0.1;
        let wrong = below.iter().filter(off).count();
        assert!(wrong * 20 <= below.len(), "{wrong} of {}", below.len());
        // The mean of a patch that is about as wide as a wave.
        assert!(below.iter().all(|point| (point.gray - 0.5).abs() < 0.3));
        // However many threads there are, and evenly chosen.
        assert_eq!(points, found(&capture, &photos, 100_000));
        assert_eq!(found(&capture, &photos, 50).len(), 50);
    }

    #[test]
    fn nothing_is_found_without_texture_photos_or_points() {
        let (capture, flat) = photos(true);
        assert_eq!(found(&capture, &flat, 1_000), []);
        let (capture, textured) = photos(false);
        assert_eq!(found(&capture, &textured[..2], 1_000), []);
        let nothing = Capture {
            points: Vec::new(),
            ..capture
        };
        assert_eq!(found(&nothing, &textured, 1_000), []);
        assert_eq!(found(&nothing, &[], 1_000), []);
    }

    #[test]
    fn masked_pixels_are_not_matched() {
        let (capture, mut photos) = photos(false);
        for (_, photo) in &mut photos {
            photo.mask = Some(vec![0; photo.gray.len()]);
        }
        assert_eq!(found(&capture, &photos, 1_000), []);
    }
}
