//! Depths by matching patches of photos.
//!
//! A patch is compared with other photos at depths along its ray, by normalized cross-correlation,
//! as plane sweeps do (Collins 1996; the photos that are compared stay as they are). It faces the
//! camera, or is slanted: ground changes its shape between photos. A depth holds where the photo
//! that agrees best finds it as well.

use glam::{DMat3, DVec3};

use super::TrainingView;
use crate::capture::{Camera, Photo};

/// Longer side of the photos that are matched, at most: enough to find a depth by.
const SIDE: u32 = 480;

/// Depths that are tried, evenly spaced in 1 / depth.
const DEPTHS: usize = 24;

/// Steps between two of them at which the best is tried again.
const FINER: [f64; 4] = [-0.5, -0.25, 0.25, 0.5];

/// Pixels from the middle of a patch to its sides.
const REACH: i32 = 3;
const SPAN: usize = 2 * REACH as usize + 1;

/// Standard deviation of a patch, in gray levels, from which on it has texture.
const TEXTURE: f64 = 4.0;

/// A photo denies a match where its patch has less than this share of the texture: a third drops
/// most wrong ones along silhouettes, few on a lawn (docs/experiments.md).
const PLAIN: f64 = 1.0 / 3.0;

/// Largest slant: relative change of 1 / depth per pixel. A steeper plane comes from points on
/// several surfaces.
const STEEPEST: f64 = 0.03;

/// Tolerance of the depth found from another photo, relative.
const SAME: f64 = 0.02;

/// A small photo with its camera.
pub struct SmallPhoto {
    /// Camera at the size of the photo.
    pub camera: Camera,
    /// Encoded.
    pub gray: Vec<u8>,
    /// Pixels below 128 do not count.
    pub mask: Option<Vec<u8>>,
}

impl SmallPhoto {
    /// A photo, scaled down.
    pub fn of(camera: Camera, photo: &Photo) -> Self {
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

    /// The place at a depth along the ray of a pixel.
    pub fn place(&self, [x, y]: [f64; 2], depth: f64) -> DVec3 {
        let camera = &self.camera;
        let seen = DVec3::new(
            (x - camera.cx) / camera.fx,
            (y - camera.cy) / camera.fy,
            1.0,
        );
        camera.rotation.transpose() * (seen * depth - camera.translation)
    }

    /// Pixel and depth of a place, if it is in the photo.
    pub fn project(&self, place: DVec3) -> Option<([f64; 2], f64)> {
        let pixel = self.camera.pixel_of(place)?;
        let depth = (self.camera.rotation * place + self.camera.translation).z;
        Some((pixel, depth))
    }

    /// Between four pixels that all count, whose centers are at halves.
    fn between(&self, [x, y]: [f64; 2]) -> Option<f64> {
        let (x, y) = (x - 0.5, y - 0.5);
        let (width, height) = (self.camera.width, self.camera.height);
        let inside = |at: f64, side: u32| at >= 0.0 && at < f64::from(side) - 1.0;
        if !(inside(x, width) && inside(y, height)) {
            return None;
        }
        // Rounded down, as they are not negative; 32 bits convert fastest.
        let (left, top) = (x as i32, y as i32);
        let (s, t) = (x - f64::from(left), y - f64::from(top));
        let first = top as usize * width as usize + left as usize;
        let pixels = [0, 1, width as usize, width as usize + 1].map(|step| first + step);
        if let Some(mask) = &self.mask
            && pixels.iter().any(|&pixel| mask[pixel] < 128)
        {
            return None;
        }
        let [a, b, c, d] = pixels.map(|pixel| f64::from(self.gray[pixel]));
        // Exact where all are the same: rounding must not look like texture.
        let (above, below) = (a + (b - a) * s, c + (d - c) * s);
        Some(above + (below - above) * t)
    }

    /// Patch around a pixel, if it has texture.
    pub fn textured(&self, [x, y]: [f64; 2]) -> Option<Patch> {
        let patch = Patch::of(|[dx, dy]| self.between([x + dx, y + dy]))?;
        (patch.deviation >= TEXTURE).then_some(patch)
    }

    /// Best match along the ray of a pixel between two depths, with one of these slants. `None`
    /// without texture, or if fewer than two other photos show the place.
    pub fn matched(
        &self,
        pixel: [f64; 2],
        depths: [f64; 2],
        slants: &[[f64; 2]],
        others: &[&Self],
    ) -> Option<Match> {
        let patch = self.textured(pixel)?;
        let sweeps = slants.iter().filter_map(|&slant| {
            let surface = |depth| Surface {
                pixel,
                depth,
                slant,
            };
            let (score, surface) = self.swept(&patch, surface, depths, others)?;
            Some(Match {
                score,
                surface,
                gray: patch.mean,
                deviation: patch.deviation,
            })
        });
        sweeps.max_by(|a, b| a.score.total_cmp(&b.score))
    }

    /// Returns true if the photo that agrees best confirms a match between two depths.
    pub fn found_back(&self, found: &Match, depths: [f64; 2], others: &[&Self]) -> bool {
        let Surface { pixel, depth, .. } = found.surface;
        let seen = || {
            let patch = self.textured(pixel)?;
            let scored = others.iter().enumerate().filter_map(|(k, other)| {
                Some((self.correlation(&patch, &found.surface, other)?, k))
            });
            let (_, best) = scored.max_by(|(a, _), (b, _)| a.total_cmp(b))?;
            let seen = found.surface.seen_from(self, others[best])?;
            let around: Vec<&Self> = std::iter::once(self)
                .chain((0..others.len()).filter(|&k| k != best).map(|k| others[k]))
                .collect();
            let depths = depths.map(|bound| bound * seen.depth / depth);
            let back = others[best].matched(seen.pixel, depths, &[seen.slant], &around)?;
            Some(back.surface.depth / seen.depth)
        };
        seen().is_some_and(|ratio| (ratio - 1.0).abs() <= SAME)
    }

    /// Returns true if another photo is untextured at a match. Along a silhouette before a plain
    /// backdrop two photos may agree at any depth; a third then sees through it.
    pub fn denied(&self, found: &Match, others: &[&Self]) -> bool {
        let seen = |other: &&Self| self.patch_in(&found.surface, other);
        let plain = |patch: Patch| patch.deviation < PLAIN * found.deviation;
        others.iter().filter_map(seen).any(plain)
    }

    fn swept(
        &self,
        patch: &Patch,
        surface: impl Fn(f64) -> Surface,
        [nearest, farthest]: [f64; 2],
        others: &[&Self],
    ) -> Option<(f64, Surface)> {
        let step = (1.0 / farthest - 1.0 / nearest) / (DEPTHS - 1) as f64;
        let at = |steps: f64| surface(1.0 / (1.0 / nearest + steps * step));
        let best = |tried: &mut dyn Iterator<Item = f64>| {
            let scored =
                tried.filter_map(|steps| Some((self.agreement(patch, &at(steps), others)?, steps)));
            scored.max_by(|(a, _), (b, _)| a.total_cmp(b))
        };
        let (_, coarse) = best(&mut (0..DEPTHS).map(|k| k as f64))?;
        let finer = FINER.iter().map(|finer| coarse + finer);
        let (score, steps) = best(&mut std::iter::once(coarse).chain(finer))?;
        Some((score, at(steps)))
    }

    /// The mean of a patch's best two correlations with other photos, if it lies on a surface.
    fn agreement(&self, patch: &Patch, surface: &Surface, others: &[&Self]) -> Option<f64> {
        let mut scores: Vec<f64> = (others.iter())
            .filter_map(|other| self.correlation(patch, surface, other))
            .collect();
        scores.sort_by(|a, b| b.total_cmp(a));
        match scores[..] {
            [first, second, ..] => Some((first + second) / 2.0),
            _ => None,
        }
    }

    /// Correlation of a patch with another photo if it lies on a surface, -1 to 1.
    fn correlation(&self, patch: &Patch, surface: &Surface, other: &Self) -> Option<f64> {
        Some(patch.correlation(&self.patch_in(surface, other)?))
    }

    /// Patch of another photo at the projection of a surface.
    fn patch_in(&self, surface: &Surface, other: &Self) -> Option<Patch> {
        let homography = surface.homography(&self.camera, &other.camera);
        Patch::of(|[dx, dy]| {
            let seen = homography * DVec3::new(dx, dy, 1.0);
            let scale = 1.0 / seen.z;
            (seen.z > 0.0).then(|| other.between([seen.x * scale, seen.y * scale]))?
        })
    }
}

/// Match along the ray of a pixel.
pub struct Match {
    /// Mean of the best two correlations, at most 1.
    pub score: f64,
    /// Position and slant.
    pub surface: Surface,
    /// Mean of the patch, in gray levels.
    pub gray: f64,
    /// Its standard deviation.
    deviation: f64,
}

/// A plane on the ray of a pixel: 1 / depth is linear across a photo.
#[derive(Clone, Copy)]
pub struct Surface {
    pixel: [f64; 2],
    /// Along the axis of the photo.
    pub depth: f64,
    slant: [f64; 2],
}

impl Surface {
    /// So many pixels beside the middle.
    fn place(&self, photo: &SmallPhoto, [dx, dy]: [f64; 2]) -> DVec3 {
        let ([x, y], [right, down]) = (self.pixel, self.slant);
        let depth = self.depth / (1.0 + right * dx + down * dy);
        photo.place([x + dx, y + dy], depth)
    }

    /// Takes an offset from the middle, `(dx, dy, 1)`, to a pixel of another camera, homogeneous:
    /// between two views of a plane pixels move by a homography (Hartley and Zisserman 2004,
    /// section 13.1).
    fn homography(&self, camera: &Camera, other: &Camera) -> DMat3 {
        let ([x, y], [right, down]) = (self.pixel, self.slant);
        let turn = other.rotation * camera.rotation.transpose();
        let shift = (other.translation - turn * camera.translation) / self.depth;
        let ray = DVec3::new(
            (x - camera.cx) / camera.fx,
            (y - camera.cy) / camera.fy,
            1.0,
        );
        let seen = DMat3::from_cols(
            turn.x_axis / camera.fx + shift * right,
            turn.y_axis / camera.fy + shift * down,
            turn * ray + shift,
        );
        let intrinsics = DMat3::from_cols(
            DVec3::new(other.fx, 0.0, 0.0),
            DVec3::new(0.0, other.fy, 0.0),
            DVec3::new(other.cx, other.cy, 1.0),
        );
        intrinsics * seen
    }

    /// The same plane where another photo shows its middle.
    fn seen_from(&self, photo: &SmallPhoto, other: &SmallPhoto) -> Option<Self> {
        let reach = f64::from(REACH);
        let shown = |offset| other.project(self.place(photo, offset));
        let (pixel, depth) = shown([0.0, 0.0])?;
        let beside = [shown([reach, 0.0])?, shown([0.0, reach])?];
        let offset = |([u, v], depth): ([f64; 2], f64)| [u - pixel[0], v - pixel[1], depth];
        let corners = [(pixel, depth)].into_iter().chain(beside).map(offset);
        Some(Self {
            pixel,
            depth,
            slant: slant_through(corners).unwrap_or_default(),
        })
    }
}

/// The slant at the origin of the least-squares plane through points, which are offsets in pixels
/// and a depth: how much 1 / depth grows within a pixel to the right and down, as share of itself.
/// `None` where there is no such plane, or it is too steep.
pub fn slant_through(points: impl Iterator<Item = [f64; 3]>) -> Option<[f64; 2]> {
    let (mut normal, mut right) = (DMat3::ZERO, DVec3::ZERO);
    for [u, v, depth] in points {
        let row = DVec3::new(1.0, u, v);
        normal += DMat3::from_cols(row * row.x, row * row.y, row * row.z);
        right += row / depth;
    }
    let plane = normal.inverse() * right;
    let slant = [plane.y / plane.x, plane.z / plane.x];
    let sound = plane.x > 0.0 && slant.iter().all(|slant| slant.abs() <= STEEPEST);
    sound.then_some(slant)
}

/// The values of a patch, row by row.
type Grid = [[f64; SPAN]; SPAN];

/// A patch of zero mean and unit length, or of zeros if it is plain, and what it was before.
pub struct Patch {
    values: Grid,
    mean: f64,
    deviation: f64,
}

impl Patch {
    /// Normalized patch of a value at each offset from its center.
    fn of(value: impl Fn([f64; 2]) -> Option<f64>) -> Option<Self> {
        let mut values = Grid::default();
        for (row, y) in values.iter_mut().zip(-REACH..) {
            for (to, x) in row.iter_mut().zip(-REACH..) {
                *to = value([x, y].map(f64::from))?;
            }
        }
        let count = (SPAN * SPAN) as f64;
        let mean = dot(&values, &[[1.0; SPAN]; SPAN]) / count;
        let mut values = values.map(|row| row.map(|value| value - mean));
        let squares = dot(&values, &values);
        // A plain patch stays zero: it correlates with nothing.
        let scale = 1.0 / squares.sqrt().max(f64::MIN_POSITIVE);
        values = values.map(|row| row.map(|value| value * scale));
        Some(Self {
            values,
            mean,
            deviation: (squares / count).sqrt(),
        })
    }

    fn correlation(&self, other: &Self) -> f64 {
        dot(&self.values, &other.values)
    }
}

/// The sum of all products: one for each column first, for sums that wait for each other take
/// longer than what is summed.
fn dot(a: &Grid, b: &Grid) -> f64 {
    let mut columns = [0.0; SPAN];
    for (a, b) in a.iter().zip(b) {
        for ((sum, a), b) in columns.iter_mut().zip(a).zip(b) {
            *sum += a * b;
        }
    }
    columns.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::fixtures::{looking_along_z, photo};

    /// Slope of tilted ground: growth of its depth, 4 at y = 0, per unit of y.
    const GRADE: f64 = 1.5;

    fn photos() -> Vec<SmallPhoto> {
        let texture = |x: f64, y: f64| {
            let wave = (25.0 * x).sin() + (31.0 * y + 9.0 * x).sin() + (17.0 * x - 23.0 * y).cos();
            (128.0 + 35.0 * wave) as u8
        };
        let shoot = |center: DVec3| {
            let camera = looking_along_z(center, 160);
            let show = |u: u32, v: u32| {
                let [right, down] = [f64::from(u) - 79.5, f64::from(v) - 79.5].map(|at| at / 160.0);
                let depth = (4.0 + GRADE * center.y) / (1.0 - GRADE * down);
                texture(center.x + right * depth, center.y + down * depth)
            };
            SmallPhoto::of(camera.clone(), &photo(&camera, show))
        };
        let centers = [[0.0, 0.0], [-1.0, 0.2], [1.0, -0.2]];
        centers.map(|[x, y]| shoot(DVec3::new(x, y, 0.0))).into()
    }

    /// Slant at the center pixel.
    const SLANT: [f64; 2] = [0.0, -GRADE / 160.0];
    const MIDDLE: [f64; 2] = [80.5, 80.5];

    #[test]
    fn slanted_ground_agrees_better_in_its_own_plane() {
        let photos = photos();
        let others = [&photos[1], &photos[2]];
        let depths = [2.5, 6.0];
        let matched = |slants: &[_]| photos[0].matched(MIDDLE, depths, slants, &others).unwrap();
        let [facing, slanted] = [matched(&[[0.0; 2]]), matched(&[[0.0; 2], SLANT])];
        assert!(slanted.score > 0.95, "{}", slanted.score);
        assert!(slanted.score > facing.score + 0.02, "{}", facing.score);
        let off = slanted.surface.depth / 4.0 - 1.0;
        assert!(off.abs() < 0.02, "{off}");
        assert!(photos[0].found_back(&slanted, depths, &others));
    }

    #[test]
    fn a_depth_that_no_other_photo_finds_is_none() {
        let photos = photos();
        let others = [&photos[1], &photos[2]];
        let depths = [2.5, 6.0];
        let mut found = photos[0]
            .matched(MIDDLE, depths, &[SLANT], &others)
            .unwrap();
        for wrong in [0.9, 1.1] {
            let depth = found.surface.depth;
            found.surface.depth *= wrong;
            assert!(!photos[0].found_back(&found, depths, &others), "{wrong}");
            found.surface.depth = depth;
        }
    }

    #[test]
    fn a_photo_that_shows_something_plain_denies_a_match() {
        let photos = photos();
        let others = [&photos[1], &photos[2]];
        let found = photos[0]
            .matched(MIDDLE, [2.5, 6.0], &[SLANT], &others)
            .unwrap();
        let denied = |contrast: f64, mask: Option<u8>| {
            let dull = |&gray: &u8| (128.0 + contrast * (f64::from(gray) - 128.0)) as u8;
            let one = SmallPhoto {
                camera: photos[0].camera.clone(),
                gray: photos[0].gray.iter().map(dull).collect(),
                mask: mask.map(|value| vec![value; photos[0].gray.len()]),
            };
            photos[0].denied(&found, &[others[0], others[1], &one])
        };
        // Half of the contrast is a dull photo, a fifth something else.
        assert!(!photos[0].denied(&found, &others) && !denied(0.5, None));
        assert!(denied(0.2, None) && denied(0.2, Some(255)));
        // What is masked says nothing.
        assert!(!denied(0.2, Some(0)));
    }

    #[test]
    fn a_homography_takes_pixels_where_their_places_are_seen() {
        let photos = photos();
        let surface = Surface {
            pixel: [60.5, 90.5],
            depth: 4.5,
            slant: [0.01, -0.02],
        };
        let mut turned = photos[1].camera.clone();
        turned.rotation = DMat3::from_rotation_y(0.1) * turned.rotation;
        turned.fy *= 1.1;
        let homography = surface.homography(&photos[0].camera, &turned);
        for [dx, dy] in [[0.0, 0.0], [-3.0, 2.0], [1.5, 3.0]] {
            let seen = turned
                .pixel_of(surface.place(&photos[0], [dx, dy]))
                .unwrap();
            let moved = homography * DVec3::new(dx, dy, 1.0);
            let off = [moved.x / moved.z - seen[0], moved.y / moved.z - seen[1]];
            assert!(off.iter().all(|off| off.abs() < 1e-9), "{off:?}");
        }
    }

    #[test]
    fn nothing_agrees_with_a_plain_patch() {
        let mut photos = photos();
        let textured = photos[0].textured(MIDDLE).unwrap();
        photos[1].gray.fill(77);
        let plain = Patch::of(|[x, y]| photos[1].between([80.3 + 0.9 * x, 80.7 + 1.1 * y]));
        let plain = plain.unwrap();
        assert_eq!((plain.mean, plain.deviation), (77.0, 0.0));
        assert_eq!(textured.correlation(&plain), 0.0);
        assert!((textured.correlation(&textured) - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_slant_of_points_is_their_planes() {
        let point = |[u, v]: [f64; 2]| [u, v, 1.0 / (0.25 * (1.0 + 0.01 * u - 0.02 * v))];
        let around = [[-3.0, 5.0], [4.0, 1.0], [-2.0, -6.0], [7.0, 3.0]];
        let [right, down] = slant_through(around.iter().copied().map(point)).unwrap();
        assert!((right - 0.01).abs() < 1e-12 && (down + 0.02).abs() < 1e-12);
        // One line holds many planes.
        let line = [1.0, 2.0, 3.0].map(|u| point([u, 0.0]));
        assert_eq!(slant_through(line.into_iter()), None);
        let steep = |[u, v]: [f64; 2]| [u, v, 1.0 / (1.0 + 0.1 * u)];
        assert_eq!(slant_through(around.iter().copied().map(steep)), None);
        assert_eq!(slant_through(std::iter::empty()), None);
    }
}
