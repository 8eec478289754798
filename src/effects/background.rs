//! What no point explains: sky, and backdrops too far away to be triangulated.

use glam::DVec3;

use crate::{
    capture::{Camera, Capture, Photo},
    splats::{Splats, dome::dome},
};

/// Cells across a photo. Points are sparse where there is little to match; a hole of
/// three cells is wider than the gaps between them.
const CELLS_ACROSS: u32 = 16;

/// Radius of the dome in extents, at least: the cameras then see its places at most
/// 1/15 rad apart from each other, and the means' rate, a share of the extent, leaves it
/// where it is.
const DOME_EXTENTS: f64 = 30.0;

/// Radius of the dome by the distance of the farthest points, at least: behind all of them.
const DOME_BEYOND_POINTS: f64 = 2.0;

/// Gaussians on the whole sphere, 3.2° apart: a photo of 60° sees some 300.
const DOME_COUNT: usize = 4_000;

/// The parts of the photos that no point explains.
#[derive(Clone, Debug)]
pub struct Backdrop<'a> {
    photos: &'a [(Photo, Camera)],
    /// One a photo.
    holes: Vec<Holes>,
}

/// The cells of one photo.
#[derive(Clone, Debug)]
struct Holes {
    /// Side of a cell in pixels.
    side: f64,
    columns: usize,
    /// Whether no point lies in the cell or a neighbour of it, row by row.
    empty: Vec<bool>,
}

impl Holes {
    fn of(capture: &Capture, camera: &Camera) -> Self {
        let side = (f64::from(camera.width) / f64::from(CELLS_ACROSS)).max(1.0);
        let [columns, rows] =
            [camera.width, camera.height].map(|length| (f64::from(length) / side).ceil() as usize);
        let mut empty = vec![true; columns * rows];
        for point in &capture.points {
            let Some(pixel) = camera.pixel_of(point.position) else {
                continue;
            };
            let [column, row] = pixel.map(|at| (at / side) as usize);
            for row in row.saturating_sub(1)..(row + 2).min(rows) {
                for column in column.saturating_sub(1)..(column + 2).min(columns) {
                    empty[row * columns + column] = false;
                }
            }
        }
        Self {
            side,
            columns,
            empty,
        }
    }

    fn holds(&self, pixel: [f64; 2]) -> bool {
        let [column, row] = pixel.map(|at| (at / self.side) as usize);
        let index = row * self.columns + column.min(self.columns - 1);
        self.empty[index.min(self.empty.len() - 1)]
    }
}

impl<'a> Backdrop<'a> {
    /// Looks where points lie in the photos, those of the capture's views at working size.
    pub fn of(capture: &Capture, photos: &'a [(Photo, Camera)]) -> Self {
        let holes = photos.iter().map(|(_, camera)| Holes::of(capture, camera));
        Self {
            photos,
            holes: holes.collect(),
        }
    }

    /// Share of all photos' area that no point explains, 0 to 1.
    pub fn share(&self) -> f64 {
        let cells = || self.holes.iter().flat_map(|holes| &holes.empty);
        cells().filter(|&&empty| empty).count() as f64 / cells().count().max(1) as f64
    }

    /// Gaussians far behind the scene that show what no point explains, at most `max`; one
    /// channel of degree `sh_degree`. `extent` is the scene's.
    pub fn dome(&self, capture: &Capture, extent: f64, max: usize, sh_degree: u32) -> Splats {
        let center = capture.center();
        let mut distances: Vec<f64> = (capture.points.iter())
            .map(|point| point.position.distance(center))
            .collect();
        distances.sort_unstable_by(f64::total_cmp);
        // The last percent may be failures of the triangulation.
        let farthest = distances.get(distances.len() * 99 / 100);
        let beyond = DOME_BEYOND_POINTS * farthest.copied().unwrap_or_default();
        let radius = (DOME_EXTENTS * extent).max(beyond);
        let count = DOME_COUNT.min(max);
        dome(center, radius, count, sh_degree, |place| {
            self.gray_at(place)
        })
    }

    /// The mean gray, encoded, 0 to 1, that the unexplained parts of the photos show at a
    /// place; `None` where no photo shows it there.
    pub fn gray_at(&self, position: DVec3) -> Option<f32> {
        let seen = self.photos.iter().zip(&self.holes);
        let grays = seen.filter_map(|((photo, camera), holes)| {
            let pixel = camera.pixel_of(position)?;
            let [x, y] = pixel.map(|at| at as usize);
            let index = y * photo.width as usize + x;
            let counts = photo.mask.as_ref().is_none_or(|mask| mask[index] > 0);
            (counts && holes.holds(pixel)).then(|| f32::from(photo.gray[index]) / 255.0)
        });
        let (sum, count) = grays.fold((0.0, 0.0), |(sum, count), gray| (sum + gray, count + 1.0));
        (count > 0.0).then(|| sum / count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::fixtures::{capture, looking_along_z, photo};

    /// 64 × 64 pixels, dark above and bright below, points in the lower half only.
    fn half_sky() -> (Capture, Vec<(Photo, Camera)>) {
        let camera = looking_along_z(DVec3::ZERO, 64);
        let photo = photo(&camera, |_, y| if y < 32 { 51 } else { 204 });
        let photos = vec![(photo, camera)];
        let points = (0..64 * 28).map(|i| {
            let [x, y] = [i % 64, 36 + i / 64].map(|at| f64::from(at) + 0.5);
            // A focal length of as many pixels as the photo is wide.
            DVec3::new((x - 32.0) / 64.0, (y - 32.0) / 64.0, 1.0) * 5.0
        });
        (capture(&photos, points), photos)
    }

    #[test]
    fn holes_are_what_is_away_from_points() {
        let (capture, photos) = half_sky();
        let backdrop = Backdrop::of(&capture, &photos);
        // 16 rows, points from the 10th on; the row beside them counts as explained.
        assert!((backdrop.share() - 8.0 / 16.0).abs() < 1e-12);
        let at = |x: f64, y: f64| backdrop.gray_at(DVec3::new(x, y, 1.0) * 1e3);
        assert_eq!(at(0.0, -0.4), Some(0.2));
        assert_eq!(at(0.0, 0.4), None);
        assert_eq!(at(2.0, 0.0), None);
    }

    #[test]
    fn the_dome_stands_where_there_is_sky_behind_everything() {
        let (capture, photos) = half_sky();
        let backdrop = Backdrop::of(&capture, &photos);
        let dome = backdrop.dome(&capture, 2.0, 100_000, 1);
        assert!(dome.len() > 50, "{}", dome.len());
        for mean in &dome.means {
            let place = DVec3::from(mean.map(f64::from));
            assert!(
                (place.length() - 60.0).abs() < 1e-3,
                "behind the cameras' mean"
            );
            assert!(place.y < 0.0 && place.z > 0.0);
        }
        assert!(backdrop.dome(&capture, 2.0, 50, 1).len() <= 50);
        // Points farther than the extents ask for.
        let far = backdrop.dome(&capture, 0.1, 4_000, 1).means[0];
        let far = DVec3::from(far.map(f64::from)).length();
        assert!((10.0..15.0).contains(&far), "{far}");
    }

    #[test]
    fn masked_pixels_say_nothing() {
        let (capture, mut photos) = half_sky();
        photos[0].0.mask = Some(vec![0; 64 * 64]);
        let backdrop = Backdrop::of(&capture, &photos);
        assert_eq!(backdrop.gray_at(DVec3::new(0.0, -0.4, 1.0)), None);
    }

    #[test]
    fn photos_of_any_size_have_cells() {
        for width in [1, 2, 17] {
            let camera = looking_along_z(DVec3::ZERO, width);
            let photos = vec![(photo(&camera, |_, _| 255), camera)];
            let empty = capture(&photos, [DVec3::new(0.0, 0.0, -1.0)]);
            let backdrop = Backdrop::of(&empty, &photos);
            assert_eq!(backdrop.share(), 1.0);
            assert_eq!(backdrop.gray_at(DVec3::new(0.0, 0.0, 9.0)), Some(1.0));
        }
    }
}
