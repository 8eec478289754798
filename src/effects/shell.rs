//! Shell far around the scene, for directions that no photo shows.

use glam::DVec3;

use crate::{
    capture::{Camera, Photo},
    splats::{Splats, dome::dome},
};

/// Gaussians on the whole sphere, 8° apart: all they show is a gray that changes slowly.
const COUNT: usize = 600;

/// Radius in extents of the capture, at least, and by the distance of the farthest points: behind
/// everything, but no farther than need be, for splat files store positions with few digits.
const EXTENTS: f64 = 10.0;
const BEYOND_POINTS: f64 = 2.0;

/// Radius by that of the background, where there is one.
const BEYOND_BACKGROUND: f64 = 1.2;

/// Other views look beyond the borders of the photos: so far, in shares of their sides.
const MARGIN: f64 = 0.4;

/// Side of the square whose mean gray a photo tells of a place, as a share of its longer side.
const PATCH: f64 = 1.0 / 14.0;

/// Places around the scene, and what photos show in their direction, however near that is.
#[derive(Clone, Debug)]
pub struct Shell {
    center: DVec3,
    radius: f64,
    places: Vec<ShellPoint>,
    /// The views whose photos tell, ascending, and their cameras.
    views: Vec<usize>,
    cameras: Vec<Camera>,
}

#[derive(Clone, Debug)]
struct ShellPoint {
    at: DVec3,
    /// True if a photo shows it, or would if it were larger by [`MARGIN`] on all sides.
    near: bool,
    /// One a photo that shows it, 0 to 1.
    grays: Vec<f32>,
}

/// Radius in world units around a capture of this extent, with points up to so far from its
/// center, and with the background there, if there is one.
pub(super) fn radius(extent: f64, farthest: f64, background: Option<f64>) -> f64 {
    let behind = (EXTENTS * extent).max(BEYOND_POINTS * farthest);
    background.map_or(behind, |radius| behind.max(BEYOND_BACKGROUND * radius))
}

impl Shell {
    /// At most `most` places on a sphere around `center`; `views` are those whose photos tell,
    /// ascending, by their `cameras` at working size.
    pub(super) fn new(
        center: DVec3,
        radius: f64,
        most: usize,
        (views, cameras): (&[usize], &[Camera]),
    ) -> Self {
        let mut places = Vec::new();
        let _: Splats = dome(center, radius, COUNT.min(most), 0, |at| {
            let near = cameras.iter().any(|camera| nearly_shows(camera, at));
            let grays = Vec::new();
            places.push(ShellPoint { at, near, grays });
            None
        });
        Self {
            center,
            radius,
            places,
            views: views.to_vec(),
            cameras: cameras.to_vec(),
        }
    }

    /// Takes what the photo of a view, at working size, shows of the places; of a view that is
    /// none of its views, nothing.
    pub fn look(&mut self, view: usize, photo: &Photo) {
        let Ok(index) = self.views.binary_search(&view) else {
            return;
        };
        let camera = &self.cameras[index];
        for place in &mut self.places {
            let pixel = camera.pixel_of(place.at);
            place
                .grays
                .extend(pixel.and_then(|pixel| mean_around(photo, pixel)));
        }
    }

    /// The Gaussians, one channel of degree `sh_degree`: each in the median of what photos show in
    /// its direction, or that of the nearest place of which one shows anything. None where no
    /// photo shows any.
    pub fn splats(&self, sh_degree: u32) -> Splats {
        let known: Vec<(DVec3, f32)> = (self.places.iter())
            .filter_map(|place| Some((place.at, median(place.grays.clone())?)))
            .collect();
        let nearest = |at: DVec3| {
            let by_distance = |(a, _): &&(DVec3, f32), (b, _): &&(DVec3, f32)| {
                at.distance_squared(*a).total_cmp(&at.distance_squared(*b))
            };
            known.iter().min_by(by_distance).map(|(_, gray)| *gray)
        };
        let mut places = self.places.iter();
        dome(
            self.center,
            self.radius,
            self.places.len(),
            sh_degree,
            |at| {
                places
                    .next()
                    .filter(|place| place.near)
                    .and_then(|_| nearest(at))
            },
        )
    }
}

/// Returns true if a camera sees a place, or would with larger photos.
fn nearly_shows(camera: &Camera, place: DVec3) -> bool {
    let at = camera.rotation * place + camera.translation;
    let within = |at: f64, side: u32| {
        let side = f64::from(side);
        at > -MARGIN * side && at < (1.0 + MARGIN) * side
    };
    at.z > 0.0
        && within(camera.fx * at.x / at.z + camera.cx, camera.width)
        && within(camera.fy * at.y / at.z + camera.cy, camera.height)
}

/// Mean gray, 0 to 1, of the pixels that count around one; `None` where none does.
fn mean_around(photo: &Photo, pixel: [f64; 2]) -> Option<f32> {
    let [x, y] = pixel.map(|at| at as usize);
    let (width, height) = (photo.width as usize, photo.height as usize);
    let reach = (PATCH / 2.0 * width.max(height) as f64) as usize;
    let rows = y.saturating_sub(reach)..(y + reach + 1).min(height);
    let columns = x.saturating_sub(reach)..(x + reach + 1).min(width);
    let (mut sum, mut count) = (0.0, 0_u32);
    for pixel in rows.flat_map(|y| columns.clone().map(move |x| y * width + x)) {
        if photo.counts(pixel) {
            sum += f32::from(photo.gray[pixel]);
            count += 1;
        }
    }
    (count > 0).then(|| sum / (255.0 * count as f32))
}

fn median(mut grays: Vec<f32>) -> Option<f32> {
    let middle = grays.len() / 2;
    (!grays.is_empty()).then(|| *grays.select_nth_unstable_by(middle, f32::total_cmp).1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::fixtures::{looking_along_z, photo};

    /// Shell of a camera at the origin that looks along z: dark on the left, bright on the right.
    fn looked(masked: bool) -> Splats {
        let camera = looking_along_z(DVec3::ZERO, 64);
        let mut shown = photo(&camera, |x, _| if x < 32 { 51 } else { 204 });
        shown.mask = masked.then(|| vec![0; 64 * 64]);
        let mut shell = Shell::new(DVec3::ZERO, 10.0, 600, (&[3], &[camera]));
        assert_eq!(shell.views, [3]);
        shell.look(2, &shown);
        assert!(shell.splats(0).is_empty());
        shell.look(3, &shown);
        shell.splats(1)
    }

    #[test]
    fn it_shows_what_photos_show_in_its_direction_and_a_little_beyond_them() {
        let splats = looked(false);
        let (mut within, mut beyond) = (0, 0);
        for (i, mean) in splats.means.iter().enumerate() {
            let [x, y, z] = mean.map(f64::from);
            assert!((DVec3::new(x, y, z).length() - 10.0).abs() < 1e-4);
            let slopes = [x / z, y / z];
            // The focal length is the width: slopes of ±0.5 are on the border.
            assert!(z > 0.0 && slopes.iter().all(|s| s.abs() < 0.5 + MARGIN));
            match slopes.iter().all(|s| s.abs() < 0.5) {
                true => within += 1,
                false => beyond += 1,
            }
            let gray = 0.5 + f64::from(splats.sh.of(i)[0]) * crate::splats::sh::C0;
            if slopes[0].abs() > 0.1 {
                let wanted = if slopes[0] < 0.0 { 0.2 } else { 0.8 };
                assert!((gray - wanted).abs() < 0.02, "{slopes:?}: {gray}");
            }
        }
        assert!(within > 30 && beyond > 30, "{within}, {beyond}");
    }

    #[test]
    fn masked_photos_tell_nothing() {
        assert!(looked(true).is_empty());
    }

    #[test]
    fn it_stands_behind_everything() {
        assert_eq!(radius(1.0, 2.0, None), 10.0);
        assert_eq!(radius(1.0, 20.0, None), 40.0);
        assert_eq!(radius(1.0, 2.0, Some(300.0)), 360.0);
    }
}
