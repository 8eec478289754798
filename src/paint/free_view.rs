//! Strokes on the scene as a free camera shows it, to strokes on the photos that show the same.

use glam::{DMat3, DVec3};
use serde::Deserialize;

use super::{
    layer::{Mask, Paint, Way},
    scene::PaintScene,
};
use crate::{
    capture::Camera, color::gray_to_lightness, frames::places, raster::SceneRenderer, run::RunError,
};

/// Longer side in pixels at which the scene's depth is looked at.
const SIDE: f64 = 800.0;

/// Photos that a stroke comes to, and those that are looked at for it.
const PHOTOS: usize = 3;
const TRIED: usize = 8;

/// Depths that differ by a smaller share are of one place.
const SAME: f64 = 0.05;

/// Pixels of a photo that have to show what is painted.
const FEWEST: f32 = 6.0;

/// Places under a stroke by which photos are chosen.
const SAMPLES: usize = 300;

/// What a distance that is e times another counts beside angles, in radians.
const FARTHER: f64 = 0.3;

/// A stroke on what a camera of the page shows, in pixels of it.
#[derive(Clone, Debug, Deserialize)]
pub struct ViewStroke {
    pub paint: Paint,
    pub points: Way,
    pub camera: PageCamera,
}

/// A camera as the page has it; the rows lead from the world to it.
#[derive(Clone, Debug, Deserialize)]
pub struct PageCamera {
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    rotation: [f64; 9],
    translation: [f64; 3],
}

impl PageCamera {
    fn camera(&self) -> Option<Camera> {
        let rotation = DMat3::from_cols_array(&self.rotation).transpose();
        let turns = (rotation * rotation.transpose() - DMat3::IDENTITY).to_cols_array();
        let lens = [self.fx, self.fy, self.cx, self.cy];
        let far = lens.iter().chain(&self.translation);
        let sound = turns.iter().all(|v| v.abs() < 1e-3)
            && far.into_iter().all(|v| v.abs() < 1e9)
            && lens[..2].iter().all(|&v| v > 0.0)
            && [self.width, self.height]
                .iter()
                .all(|side| (1..=16384).contains(side));
        sound.then_some(Camera {
            width: self.width,
            height: self.height,
            fx: self.fx,
            fy: self.fy,
            cx: self.cx,
            cy: self.cy,
            rotation,
            translation: self.translation.into(),
        })
    }
}

/// What a camera shows under a stroke.
struct Stroked {
    camera: Camera,
    depth: Vec<f32>,
    mask: Mask,
}

/// What a photo shows of it: the photo, the part of it, and the mean `L*` there.
type OnPhoto = (usize, Mask, f32);

impl ViewStroke {
    /// The camera, no larger than needed, and the way on its picture; none where either is unsound.
    fn sized(&self) -> Option<(Camera, Way)> {
        let camera = self.camera.camera().filter(|_| self.points.is_sound())?;
        let longer = f64::from(camera.width.max(camera.height));
        let scale = (SIDE / longer).min(1.0);
        let side = |side: u32| ((scale * f64::from(side)).round() as u32).max(1);
        let small = camera.resized(side(camera.width), side(camera.height));
        let points = self
            .points
            .0
            .iter()
            .map(|point| point.map(|v| scale as f32 * v));
        Some((small, Way(points.collect())))
    }

    /// Returns true if it can be drawn.
    pub fn is_sound(&self) -> bool {
        self.sized().is_some()
    }

    /// The parts of photos that show what it covers: of those whose viewpoints are nearest, among
    /// those that `may_be`.
    ///
    /// # Errors
    /// [`RunError`] of a photo or the device.
    pub fn on_photos(
        &self,
        scene: &PaintScene,
        may_be: &dyn Fn(usize) -> bool,
    ) -> Result<Vec<OnPhoto>, RunError> {
        let Some((camera, way)) = self.sized() else {
            return Ok(Vec::new());
        };
        let Some(mask) = way.mask([camera.width, camera.height]) else {
            return Ok(Vec::new());
        };
        let (luma, extent) = (&scene.luma, scene.dataset.extent);
        let mut renderer = SceneRenderer::of(&scene.raster, luma, &[&luma.sh], extent)?;
        let stroked = Stroked {
            depth: renderer.depth(&camera)?,
            camera,
            mask,
        };
        let mut found = Vec::new();
        let nearest = nearest(scene, &stroked).into_iter();
        for photo in nearest.filter(|&photo| may_be(photo)).take(TRIED) {
            found.extend(stroked.on(scene, &mut renderer, photo)?);
            if found.len() == PHOTOS {
                break;
            }
        }
        Ok(found)
    }
}

impl Stroked {
    /// The stroke's share of the pixel that shows a place, where it shows that one.
    fn share(&self, place: DVec3) -> f32 {
        let Some([x, y]) = self.camera.pixel_of(place) else {
            return 0.0;
        };
        let [x, y] = [x, y].map(|v| v as u32);
        let there = f64::from(self.depth[(y * self.camera.width + x) as usize]);
        // NaN is nowhere.
        match (self.camera.depth(place) - there).abs() <= SAME * there {
            true => self.mask.at(x, y),
            false => 0.0,
        }
    }

    /// Some of the places under it.
    fn places(&self) -> Vec<DVec3> {
        let [left, top, width, _] = self.mask.region;
        let covered = (0..)
            .zip(&self.mask.shares)
            .filter(|(_, share)| **share > 0.5);
        let all: Vec<DVec3> = covered
            .filter_map(|(k, _)| {
                let (x, y) = (left + k % width, top + k / width);
                let z = self.depth[(y * self.camera.width + x) as usize];
                let pixel = [x, y].map(|v| f64::from(v) + 0.5);
                z.is_finite().then(|| place(&self.camera, pixel, z.into()))
            })
            .collect();
        let step = all.len().div_ceil(SAMPLES).max(1);
        all.into_iter().step_by(step).collect()
    }

    /// What a photo shows of it; none where that is next to nothing.
    fn on(
        &self,
        scene: &PaintScene,
        renderer: &mut SceneRenderer<'_>,
        photo: usize,
    ) -> Result<Option<OnPhoto>, RunError> {
        let views = scene.views(photo);
        let upright = views[0].view.stance.upright;
        let size = upright.inverse().size(scene.photos[photo].size);
        let mut shares = vec![0.0_f32; size[0] as usize * size[1] as usize];
        let mut light = 0.0;
        for (seen, view) in views.iter().zip(scene.photos[photo].views.clone()) {
            let depth = renderer.depth(seen.camera)?;
            let gray = scene.dataset.photo(view)?;
            for (share, &[x, y]) in shares.iter_mut().zip(&places(seen, size)) {
                let within =
                    x >= 0.0 && x < gray.width as f32 && y >= 0.0 && y < gray.height as f32;
                if !within || *share > 0.0 {
                    continue;
                }
                let at = y as usize * gray.width as usize + x as usize;
                let shown = place(seen.camera, [x.into(), y.into()], depth[at].into());
                *share = self.share(shown);
                light += *share * gray_to_lightness(f64::from(gray.gray[at]) / 255.0) as f32;
            }
        }
        let sum: f32 = shares.iter().sum();
        let shares = upright.turned(shares, 1, size);
        let [width, height] = upright.size(size);
        let region = [0, 0, width, height];
        Ok((sum >= FEWEST).then(|| (photo, Mask { region, shares }, light / sum)))
    }
}

/// The place at a depth that a pixel of a camera shows.
fn place(camera: &Camera, [x, y]: [f64; 2], depth: f64) -> DVec3 {
    let ray = DVec3::new(
        (x - camera.cx) / camera.fx,
        (y - camera.cy) / camera.fy,
        1.0,
    );
    camera.rotation.transpose() * (depth * ray - camera.translation)
}

/// Photos that have the stroke in their picture: those first that show it most from where the
/// camera is.
fn nearest(scene: &PaintScene, stroked: &Stroked) -> Vec<usize> {
    let under = stroked.places();
    let own = stroked.camera.center();
    let cost = |camera: &Camera| {
        let center = camera.center();
        let shown = under
            .iter()
            .filter(|&&place| camera.pixel_of(place).is_some());
        let costs = shown.map(|&place| {
            let (a, b) = (place - own, place - center);
            a.angle_between(b) + FARTHER * (b.length() / a.length()).ln().abs()
        });
        let costs: Vec<f64> = costs.collect();
        let share = costs.len() as f64 / under.len().max(1) as f64;
        let mean = costs.iter().sum::<f64>() / costs.len() as f64;
        (share > 0.0).then_some(mean + 2.0 * (1.0 - share))
    };
    let of = |photo: usize| {
        let views = scene.photos[photo].views.clone();
        let costs = views.filter_map(|view| cost(&scene.dataset.cameras[view]));
        let least = costs.min_by(f64::total_cmp)?;
        Some((least, photo))
    };
    let mut found: Vec<(f64, usize)> = (0..scene.photos.len()).filter_map(of).collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.into_iter().map(|(_, photo)| photo).collect()
}
