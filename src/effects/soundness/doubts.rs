//! Doubts about a scene that do not depend on its model.

use super::photos::photos;
use crate::capture::{Camera, Capture, Photo};

/// Pixels along a side of a photo that shows anything.
const LEAST_SIDE: u32 = 8;

/// Focal lengths as a share of a photo's side: from a view of 169 degrees to that of a microscope.
const FOCAL: [f64; 2] = [0.05, 200.0];

/// Gray levels between which all but the darkest and the brightest pixels lie where photos show
/// nothing; and how many pixels these are.
const FEW_LEVELS: usize = 3;
const EXTREMES: f64 = 5e-4;

/// Warnings about a capture, a line each; `cameras` are those of its views at working size.
pub fn doubts(capture: &Capture, cameras: &[Camera]) -> Vec<String> {
    let mut doubts = Vec::new();
    let count = photos(capture).0.len();
    if count == 1 {
        doubts.push("there is one photo: depths cannot be found; add photos from elsewhere".into());
    } else if capture.is_panorama() {
        doubts.push(format!(
            "all {count} photos are taken from one place: the scene is a panorama without depth, right from there only"
        ));
    }
    let small = |camera: &&Camera| camera.width.min(camera.height) < LEAST_SIDE;
    if let Some(Camera { width, height, .. }) = cameras.iter().find(small) {
        let count = cameras.iter().filter(small).count();
        doubts.push(format!(
            "{count} views are smaller than {LEAST_SIDE} pixels, such as {width}×{height}: they show nothing"
        ));
    }
    let share = |camera: &Camera| camera.fx / f64::from(camera.width);
    let odd = |share: &f64| !(FOCAL[0]..=FOCAL[1]).contains(share);
    if let Some(share) = cameras.iter().map(share).find(odd) {
        doubts.push(format!(
            "a view has the impossible focal length of {share:.3e} times its width: cameras.txt holds it in pixels"
        ));
    }
    doubts
}

/// Histogram of gray levels over all photos.
#[derive(Default)]
pub struct Levels(Vec<usize>);

impl Levels {
    /// Takes a photo.
    pub fn look(&mut self, photo: &Photo) {
        self.0.resize(256, 0);
        for &gray in &photo.gray {
            self.0[usize::from(gray)] += 1;
        }
    }

    /// A warning if all photos together are of one gray.
    pub fn doubt(&self) -> Option<String> {
        let few = (self.0.iter().sum::<usize>() as f64 * EXTREMES) as usize;
        let is_end = |beyond: &mut usize, level: usize| {
            *beyond += self.0[level];
            *beyond > few
        };
        let (mut below, mut above) = (0, 0);
        let darkest = (0..self.0.len()).find(|&level| is_end(&mut below, level))?;
        let brightest = (0..self.0.len()).rfind(|&level| is_end(&mut above, level))?;
        (brightest < darkest + FEW_LEVELS).then(|| {
            format!(
                "all photos are of one gray, {darkest} to {brightest} of 255: they show nothing"
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::effects::fixtures::{capture, looking_along_z, photo};

    fn told(centers: &[DVec3], change: fn(&mut Camera)) -> Vec<String> {
        let cameras = centers.iter().map(|&at| {
            let mut camera = looking_along_z(at, 64);
            change(&mut camera);
            camera
        });
        let all: Vec<_> = cameras
            .map(|camera| (photo(&camera, |x, _| x as u8), camera))
            .collect();
        let cameras: Vec<_> = all.iter().map(|(_, camera)| camera.clone()).collect();
        doubts(&capture(&all, [DVec3::new(0.0, 0.0, 5.0)]), &cameras)
    }

    #[test]
    fn a_sound_scene_raises_none_and_each_kind_one() {
        let two = [DVec3::ZERO, DVec3::X];
        assert_eq!(told(&two, |_| {}), [""; 0]);
        let one_each = [
            (told(&two[..1], |_| {}), "one photo"),
            (told(&[DVec3::X; 3], |_| {}), "one place"),
            (told(&two, |c| (c.width, c.fx) = (1, 1.0)), "1×64"),
            (told(&two, |c| c.fx = 1e-6), "focal length"),
        ];
        for (told, part) in one_each {
            assert!(told.len() == 1 && told[0].contains(part), "{told:?}");
        }
    }

    #[test]
    fn photos_of_one_gray_show_nothing() {
        let camera = looking_along_z(DVec3::ZERO, 100);
        let doubt = |gray: fn(u32, u32) -> u8| {
            let mut levels = Levels::default();
            levels.look(&photo(&camera, gray));
            levels.doubt()
        };
        // One bright pixel is noise.
        let flat = doubt(|x, y| if x + y == 0 { 255 } else { 127 + (x % 2) as u8 });
        assert!(flat.is_some_and(|told| told.contains("127 to 128")));
        assert_eq!(doubt(|x, _| (x / 20) as u8), None);
    }
}
