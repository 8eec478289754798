//! Points where photos have texture and COLMAP has none: without a Gaussian nothing is split, and
//! a lawn stays a blur.

use std::{
    collections::{BTreeSet, HashMap},
    convert::Infallible,
};

use glam::DVec3;

use super::matching::{SmallPhoto, slant_through};
use crate::capture::{Capture, CaptureError, Dataset, in_order};

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

/// Points nearest to a cell through which the plane goes that a patch may lie in.
const PLANE: usize = 12;

/// Correlation with the photos nearby, the mean of the best two, from which a depth is believed
/// (docs/experiments.md).
const CORRELATED: f64 = 0.7;

/// Cells that a thread takes at a time: a sky takes less than a lawn.
const PART: usize = 64;

/// A point that was found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct GapPoint {
    /// World coordinates.
    pub position: DVec3,
    /// Encoded gray, 0 to 1.
    pub gray: f32,
    /// Width of the cell that it fills, in world units.
    pub width: f64,
}

/// At most `most` points where the training photos show something and the capture has none.
pub(super) fn gap_points(dataset: &Dataset, most: usize) -> Result<Vec<GapPoint>, CaptureError> {
    let train = &dataset.split.train;
    let count = train.len().min(MAX_VIEWS);
    let views: Vec<usize> = (0..count).map(|k| train[k * train.len() / count]).collect();
    let mut photos = Vec::new();
    dataset.visit(&views, |view, photo| {
        photos.push((view, SmallPhoto::of(dataset.cameras[view].clone(), photo)));
        Ok::<_, CaptureError>(())
    })?;
    Ok(found(&dataset.capture, &photos, most))
}

fn found(capture: &Capture, photos: &[(usize, SmallPhoto)], most: usize) -> Vec<GapPoint> {
    let mut found: Vec<GapPoint> = Vec::new();
    for ((number, photo), points) in photos.iter().zip(seen_points(capture, photos)) {
        let neighbors = nearest_photos(photo, photos, *number);
        let more = Gaps::of(photo, &points, &found).filled(&neighbors);
        found.extend(more);
    }
    let kept = found.len().min(most);
    // Each then stands for more of the photo.
    let wider = (found.len() as f64 / kept.max(1) as f64).sqrt();
    let chosen = (0..kept).map(|k| found[k * found.len() / kept]);
    chosen
        .map(|point| GapPoint {
            width: wider * point.width,
            ..point
        })
        .collect()
}

/// Those taken from nearest by.
fn nearest_photos<'a>(
    photo: &SmallPhoto,
    photos: &'a [(usize, SmallPhoto)],
    number: usize,
) -> Vec<&'a SmallPhoto> {
    let distance = |other: &SmallPhoto| {
        other
            .camera
            .center()
            .distance_squared(photo.camera.center())
    };
    let mut others: Vec<&SmallPhoto> = (photos.iter())
        .filter(|(other, _)| *other != number)
        .map(|(_, other)| other)
        .collect();
    others.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    others.truncate(NEIGHBORS);
    others
}

/// Pixel and depth of the points visible in each photo: those observed in it, or all in front of it
/// if the model has no tracks.
fn seen_points(capture: &Capture, photos: &[(usize, SmallPhoto)]) -> Vec<Vec<([f64; 2], f64)>> {
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
    photo: &'a SmallPhoto,
    points: &'a [([f64; 2], f64)],
    /// Side of a cell in pixels.
    side: f64,
    columns: usize,
    occupied: Vec<bool>,
}

impl<'a> Gaps<'a> {
    fn of(photo: &'a SmallPhoto, points: &'a [([f64; 2], f64)], found: &[GapPoint]) -> Self {
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

    /// Points in the empty cells, by matching with neighboring photos.
    fn filled(&self, neighbors: &[&SmallPhoto]) -> Vec<GapPoint> {
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
        let parts: Vec<&[[f64; 2]]> = pixels.chunks(PART).collect();
        let found = |part: &&[[f64; 2]]| {
            let points = part
                .iter()
                .filter_map(|&pixel| self.point_at(pixel, neighbors));
            points.collect::<Vec<_>>()
        };
        let mut all = Vec::new();
        let taken = in_order(&parts, found, |_, points| {
            all.extend(points);
            Ok::<_, Infallible>(())
        });
        match taken {
            Ok(()) => all,
            Err(never) => match never {},
        }
    }

    /// The point on the ray of a pixel.
    fn point_at(&self, pixel: [f64; 2], neighbors: &[&SmallPhoto]) -> Option<GapPoint> {
        self.photo.textured(pixel)?;
        let Neighborhood { depths, slant } = self.around(pixel)?;
        // It faces the camera, or lies in the plane of the points nearby.
        let slants: Vec<_> = std::iter::once([0.0; 2]).chain(slant).collect();
        let found = self.photo.matched(pixel, depths, &slants, neighbors)?;
        let believed = found.score > CORRELATED
            && !self.photo.denied(&found, neighbors)
            && self.photo.found_back(&found, depths, neighbors);
        believed.then(|| GapPoint {
            position: self.photo.place(pixel, found.surface.depth),
            gray: (found.gray / 255.0) as f32,
            width: found.surface.depth * self.side / self.photo.camera.fx,
        })
    }

    /// Depth range and slant from the points nearest to a pixel; `None` if one is too close.
    fn around(&self, [x, y]: [f64; 2]) -> Option<Neighborhood> {
        let mut near: Vec<(f64, [f64; 3])> = (self.points.iter())
            .map(|([u, v], depth)| {
                let [u, v] = [u - x, v - y];
                (u * u + v * v, [u, v, *depth])
            })
            .collect();
        let nearer = |a: &(f64, _), b: &(f64, _)| a.0.total_cmp(&b.0);
        if near.len() > PLANE {
            near.select_nth_unstable_by(PLANE - 1, nearer);
            near.truncate(PLANE);
        }
        near.sort_unstable_by(nearer);
        let (closest, _) = near.first()?;
        if near.len() < NEAREST || closest.sqrt() < GAP * self.side {
            return None;
        }
        let depths = near[..NEAREST].iter().map(|(_, [_, _, depth])| *depth);
        let [closer, beyond] = BEYOND;
        let plane = near.iter().map(|(_, point)| *point);
        Some(Neighborhood {
            depths: [
                closer * depths.clone().fold(f64::INFINITY, f64::min),
                beyond * depths.fold(0.0, f64::max),
            ],
            slant: slant_through(plane),
        })
    }
}

/// Depth range and slant from the points around a pixel.
struct Neighborhood {
    /// Range in which its ray may end.
    depths: [f64; 2],
    /// Slant of the plane through them, if there is one.
    slant: Option<[f64; 2]>,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::fixtures::{capture, looking_along_z, photo};

    /// Gray of a textured wall at a depth of 4.
    fn texture(x: f64, y: f64) -> u8 {
        let wave = (25.0 * x).sin() + (31.0 * y + 9.0 * x).sin() + (17.0 * x - 23.0 * y).cos();
        (128.0 + 35.0 * wave) as u8
    }

    fn photos(flat: bool) -> (Capture, Vec<(usize, SmallPhoto)>) {
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
        let small = small.map(|(k, (photo, camera))| (k, SmallPhoto::of(camera, &photo)));
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
        let few = found(&capture, &photos, 50);
        assert_eq!(few.len(), 50);
        // A cell of two pixels at a depth of 4; wider where fewer stand for as much.
        let width = |points: &[GapPoint]| {
            points.iter().map(|point| point.width).sum::<f64>() / points.len() as f64
        };
        let cell = 4.0 * 2.0 / photos[0].1.camera.fx;
        assert!(
            (width(&points) / cell - 1.0).abs() < 0.1,
            "{}",
            width(&points) / cell
        );
        let wider = (points.len() as f64 / 50.0).sqrt();
        assert!((width(&few) / cell / wider - 1.0).abs() < 0.1);
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
