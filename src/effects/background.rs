//! Background that no point explains: sky, and backdrops too far away to be triangulated.

use glam::DVec3;

use super::{
    shell::{self, Shell},
    soundness::median,
};
use crate::{
    capture::{Camera, Capture, Photo},
    splats::{Splats, dome::dome},
};

/// Cells across a photo. Points are sparse where there is little to match; a hole of
/// three cells is wider than the gaps between them.
const CELLS_ACROSS: u32 = 16;

/// Radius of the dome in extents, at least: two cameras an extent apart then see a place
/// 1/300 rad apart, a pixel of a photo 300 wide. It must be right from the start: the
/// means' rate, a share of the extent, leaves it where it is.
const DOME_EXTENTS: f64 = 300.0;

/// Radius of the dome by the distance of the farthest points, at least: behind all of them.
const DOME_BEYOND_POINTS: f64 = 2.0;

/// Gaussians on the whole sphere, 3.2° apart: a photo of 60° sees some 300.
const DOME_COUNT: usize = 4_000;

/// Largest difference between photos of one far place, in gray levels: noise and the sun move less,
/// a textured wall that is not far moves more.
const AGREEMENT: f64 = 8.0;

/// Views that are looked at, at most: each place is looked up in all of them, and so many
/// photos around a scene show all of its background more than once.
const VIEWS_MAX: usize = 128;

/// Background of the scene: the parts of the photos that no point explains, if the photos agree
/// when these are put far away. A near wall without points does not agree, unless it has no texture
/// either; then its gray is right behind it as well.
#[derive(Clone, Debug)]
pub struct Backdrop {
    /// The views whose photos are looked at.
    views: Vec<usize>,
    /// Their cameras.
    cameras: Vec<Camera>,
    /// Their cells.
    holes: Vec<Holes>,
    /// The cameras' mean, and how far from it the background stands.
    center: DVec3,
    radius: f64,
    /// The capture's extent, and how far from the center its points reach.
    extent: f64,
    farthest: f64,
}

/// The cells of one photo.
#[derive(Clone, Debug)]
struct Holes {
    /// Side of a cell in pixels.
    side: f64,
    columns: usize,
    /// True if no point lies in the cell or a neighbor of it, row by row.
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

    /// The middle of each empty cell, in pixels.
    fn middles(&self) -> impl Iterator<Item = [f64; 2]> {
        let empty = self.empty.iter().enumerate().filter(|(_, empty)| **empty);
        empty.map(|(index, _)| {
            [index % self.columns, index / self.columns].map(|at| (at as f64 + 0.5) * self.side)
        })
    }
}

impl Backdrop {
    /// Looks where points lie in the training views `train`, in [`VIEWS_MAX`] of them at
    /// most; `cameras` are those of all the capture's views, at working size.
    pub fn of(capture: &Capture, cameras: &[Camera], train: &[usize]) -> Self {
        let count = train.len().min(VIEWS_MAX);
        let views: Vec<usize> = (0..count).map(|k| train[k * train.len() / count]).collect();
        let cameras: Vec<Camera> = views.iter().map(|&view| cameras[view].clone()).collect();
        let holes = cameras.iter().map(|camera| Holes::of(capture, camera));
        let center = capture.center();
        let mut distances: Vec<f64> = (capture.points.iter())
            .map(|point| point.position.distance(center))
            .collect();
        distances.sort_unstable_by(f64::total_cmp);
        // The last percent may be failures of the triangulation.
        let farthest = distances.get(distances.len() * 99 / 100);
        let farthest = farthest.copied().unwrap_or_default();
        let extent = capture.extent();
        Self {
            views,
            holes: holes.collect(),
            cameras,
            center,
            radius: (DOME_EXTENTS * extent).max(DOME_BEYOND_POINTS * farthest),
            extent,
            farthest,
        }
    }

    /// The views whose photos tell what lies behind, ascending.
    pub fn views(&self) -> &[usize] {
        &self.views
    }

    /// The middles of all empty cells, as far away as the background stands.
    pub(super) fn behind_cells(&self) -> FarPlaces {
        let cells = self.cameras.iter().zip(&self.holes);
        FarPlaces::of(cells.flat_map(|(camera, holes)| {
            let middles = holes.middles();
            middles.map(|pixel| self.far_along(camera, pixel))
        }))
    }

    /// Share of all photos' area that lies behind the scene, 0 to 1; `places` are
    /// [`Self::behind_cells`], once all photos have been looked at.
    pub(super) fn share(&self, places: &FarPlaces) -> f64 {
        let cells: usize = self.holes.iter().map(|holes| holes.empty.len()).sum();
        let behind = places.grays().flatten().count();
        behind as f64 / cells.max(1) as f64
    }

    /// The places of at most `max` Gaussians far behind the scene.
    pub fn dome_places(&self, max: usize) -> FarPlaces {
        let mut places = Vec::new();
        let _: Splats = dome(self.center, self.radius, DOME_COUNT.min(max), 0, |place| {
            places.push(place);
            None
        });
        FarPlaces::of(places)
    }

    /// Gaussians far behind the scene; one channel of degree `sh_degree`. `places` are
    /// [`Self::dome_places`], once the photos of all [`Self::views`] have been looked at.
    pub fn dome(&self, places: &FarPlaces, sh_degree: u32) -> Splats {
        let mut grays = places.grays();
        let count = places.places.len();
        dome(self.center, self.radius, count, sh_degree, |_| {
            grays.next().flatten()
        })
    }

    /// A shell of at most `most` Gaussians behind the scene, and behind the dome where there is
    /// one; the photos of [`Self::views`] are to be shown to it.
    pub fn shell(&self, most: usize, behind_dome: bool) -> Shell {
        let dome = behind_dome.then_some(self.radius);
        let radius = shell::radius(self.extent, self.farthest, dome);
        Shell::new(self.center, radius, most, (&self.views, &self.cameras))
    }

    /// Takes what the photo of a view, at working size, shows of `places`; of a view that is
    /// none of [`Self::views`], nothing.
    pub fn look(&self, view: usize, photo: &Photo, places: &mut FarPlaces) {
        let Ok(index) = self.views.binary_search(&view) else {
            return;
        };
        let (camera, holes) = (&self.cameras[index], &self.holes[index]);
        for (place, grays) in places.places.iter().zip(&mut places.grays) {
            let pixel = camera.pixel_of(*place).filter(|&pixel| holes.holds(pixel));
            grays.extend(pixel.and_then(|pixel| gray_around(photo, pixel)));
        }
    }

    /// The place that far away which a camera sees at a pixel.
    fn far_along(&self, camera: &Camera, [u, v]: [f64; 2]) -> DVec3 {
        let ray = DVec3::new(
            (u - camera.cx) / camera.fx,
            (v - camera.cy) / camera.fy,
            1.0,
        );
        camera.center() + camera.rotation.transpose() * ray.normalize() * self.radius
    }
}

/// Places far away, and what the unexplained parts of photos show there, in gray levels.
#[derive(Clone, Debug)]
pub struct FarPlaces {
    places: Vec<DVec3>,
    /// Gray of each place in each photo that shows it.
    grays: Vec<Vec<f64>>,
}

impl FarPlaces {
    fn of(places: impl IntoIterator<Item = DVec3>) -> Self {
        let places: Vec<DVec3> = places.into_iter().collect();
        Self {
            grays: vec![Vec::new(); places.len()],
            places,
        }
    }

    /// The gray, encoded, 0 to 1, of each place: the median of what photos show there;
    /// `None` unless at least two of them, and two thirds, agree with it.
    fn grays(&self) -> impl Iterator<Item = Option<f32>> {
        self.grays.iter().map(|grays| agreed(grays))
    }
}

/// The median of gray levels that agree.
fn agreed(grays: &[f64]) -> Option<f32> {
    let median = median(grays.to_vec())?;
    let near = |gray: &&f64| (**gray - median).abs() <= AGREEMENT;
    let agree = grays.iter().filter(near).count();
    (agree >= 2 && 3 * agree >= 2 * grays.len()).then_some((median / 255.0) as f32)
}

/// Mean gray level of the pixels around a place in a photo; `None` where one is masked.
fn gray_around(photo: &Photo, pixel: [f64; 2]) -> Option<f64> {
    let [x, y] = pixel.map(|at| at as usize);
    let (width, height) = (photo.width as usize, photo.height as usize);
    let (mut sum, mut count) = (0.0, 0.0);
    for y in y.saturating_sub(1)..(y + 2).min(height) {
        for at in (x.saturating_sub(1)..(x + 2).min(width)).map(|x| y * width + x) {
            if photo.mask.as_ref().is_some_and(|mask| mask[at] == 0) {
                return None;
            }
            sum += f64::from(photo.gray[at]);
            count += 1.0;
        }
    }
    Some(sum / count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::fixtures::{capture, looking_along_z, photo};

    /// Two views of 64 × 64 pixels, side by side: a textured floor with points below; above,
    /// stripes that stand as far away as is said.
    fn half_sky(distance: f64) -> (Capture, Vec<(Photo, Camera)>) {
        let photos: Vec<_> = [-0.5, 0.5]
            .map(|x| {
                let camera = looking_along_z(DVec3::new(x, 0.0, 0.0), 64);
                let stripes = |u: u32, v: u32| {
                    let place = x + (f64::from(u) + 0.5 - 32.0) / 64.0 * distance;
                    let wave = (place / distance * 10.0).sin();
                    if v < 32 {
                        (128.0 + 90.0 * wave) as u8
                    } else {
                        204
                    }
                };
                (photo(&camera, stripes), camera)
            })
            .into();
        let points = (-40..64 + 40).flat_map(|x| (36..64).map(move |y| [x, y]));
        let points = points.map(|pixel| {
            let [x, y] = pixel.map(|at| f64::from(at) + 0.5 - 32.0);
            // A focal length of as many pixels as the photo is wide.
            DVec3::new(x / 64.0, y / 64.0, 1.0) * 5.0
        });
        (capture(&photos, points), photos)
    }

    /// The backdrop, with what photos show of the places that `of` gives.
    fn looked(
        capture: &Capture,
        photos: &[(Photo, Camera)],
        train: &[usize],
        of: impl Fn(&Backdrop) -> FarPlaces,
    ) -> (Backdrop, FarPlaces) {
        let cameras: Vec<Camera> = photos.iter().map(|(_, camera)| camera.clone()).collect();
        let backdrop = Backdrop::of(capture, &cameras, train);
        let mut places = of(&backdrop);
        for (view, (photo, _)) in photos.iter().enumerate() {
            backdrop.look(view, photo, &mut places);
        }
        (backdrop, places)
    }

    fn share(capture: &Capture, photos: &[(Photo, Camera)], train: &[usize]) -> f64 {
        let (backdrop, places) = looked(capture, photos, train, Backdrop::behind_cells);
        backdrop.share(&places)
    }

    fn dome_of(capture: &Capture, photos: &[(Photo, Camera)], max: usize, degree: u32) -> Splats {
        let (backdrop, places) = looked(capture, photos, &[0, 1], |b| b.dome_places(max));
        backdrop.dome(&places, degree)
    }

    #[test]
    fn far_stripes_lie_behind_near_ones_do_not() {
        let (capture, photos) = half_sky(1e4);
        let far = share(&capture, &photos, &[0, 1]);
        // 16 rows, points from the 10th on; the row beside them counts as explained.
        assert!((0.35..=0.5).contains(&far), "{far}");
        let (capture, photos) = half_sky(4.0);
        let near = share(&capture, &photos, &[0, 1]);
        assert!(near < 0.15, "{near}");
    }

    #[test]
    fn the_dome_stands_where_there_is_sky_behind_everything() {
        let (capture, photos) = half_sky(1e4);
        let dome = dome_of(&capture, &photos, 100_000, 1);
        assert!(dome.len() > 50, "{}", dome.len());
        let radius = DOME_EXTENTS * capture.extent();
        for mean in &dome.means {
            let place = DVec3::from(mean.map(f64::from));
            assert!((place.length() / radius - 1.0).abs() < 1e-3, "{place}");
            assert!(place.y < 0.0 && place.z > 0.0);
        }
        let few = dome_of(&capture, &photos, 50, 1);
        assert!(few.len() <= 50);
    }

    #[test]
    fn it_stands_beyond_points_that_are_farther_than_the_extents_ask_for() {
        let (mut capture, photos) = half_sky(1e4);
        for point in &mut capture.points {
            point.position *= 100.0;
        }
        let dome = dome_of(&capture, &photos, 4_000, 0);
        let place = DVec3::from(dome.means[0].map(f64::from));
        assert!(place.length() > 1_000.0, "{place}");
    }

    #[test]
    fn masked_pixels_and_single_views_say_nothing() {
        let (capture, mut photos) = half_sky(1e4);
        for (photo, _) in &mut photos {
            photo.mask = Some(vec![0; 64 * 64]);
        }
        assert_eq!(share(&capture, &photos, &[0, 1]), 0.0);
        let (capture, photos) = half_sky(1e4);
        assert_eq!(share(&capture, &photos, &[1]), 0.0);
    }

    #[test]
    fn photos_of_any_size_have_cells() {
        for width in [1, 2, 17] {
            let camera = looking_along_z(DVec3::ZERO, width);
            let photos = vec![(photo(&camera, |_, _| 255), camera); 2];
            let nothing = capture(&photos, [DVec3::new(0.0, 0.0, -1.0)]);
            assert_eq!(share(&nothing, &photos, &[0, 1]), 1.0);
        }
    }
}
