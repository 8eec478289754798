//! Pixels that show something else than the scene: dust, scratches, passers-by.
//!
//! A pixel that the picture misses by far may be one that is not learned yet; but then
//! other views miss the same place as far. So each Gaussian is given the mean residual of
//! the pixels that it is drawn to in all other views (the adjoint of blending), these
//! means are drawn like a color, and a pixel is taken for a defect where its residual is
//! far above what the others lead to expect.

use std::sync::Arc;

use super::{LumaError, TrainingViews, view};
use crate::{
    capture::{Camera, Exposure},
    gpu::{Buffer, GpuError, Recorder},
    raster::{
        AdjointScratch, COLOR_FIGURES, ChromaAdjoint, ChromaSums, Field, Geometry, Layer, Lists,
        Raster, ViewUniform,
    },
    splats::{ShField, sh},
};

/// Residuals, in gray, that noise and texture reach anywhere: smaller ones harm nobody.
const RESIDUAL_MIN: f32 = 0.1;

/// A defect's residual is so many times what the scene leads to expect.
const EXCESS: f32 = 4.0;

/// Residuals are averaged over squares this far from a pixel, and what is found grows by
/// as much: single pixels are noise, and defects have soft borders.
const REACH: usize = 1;

/// A view with more than this share of defects is not seen through dust: it is posed
/// wrongly, or its part of the scene is not learned yet.
const SHARE_MAX: f64 = 0.3;

/// The others have seen a Gaussian when it covers so many of their pixels.
const SEEN_MIN: f32 = 0.5;

/// They know a pixel when Gaussians that they have seen cover so much of it.
const KNOWN_MIN: f32 = 0.5;

/// A photo with its camera, mask and exposure.
struct Photo {
    /// Camera of the photo.
    camera: Camera,
    /// 8-bit gray, `[height, width]`.
    gray: Vec<u8>,
    /// 255 where a pixel counts, `[height, width]`.
    mask: Vec<u8>,
    /// Exposure of the photo.
    exposure: Exposure,
}

impl Photo {
    fn load(views: &dyn TrainingViews, view: usize) -> Result<Self, LumaError> {
        let mut view = view::load(views, view)?;
        Ok(Self {
            mask: view.whole_mask(),
            camera: view.camera,
            gray: view.gray,
            exposure: view.exposure,
        })
    }
}

/// The scene as it is learned so far.
pub struct Scene<'a> {
    /// The rasterizer.
    pub raster: &'a Arc<Raster>,
    /// Its Gaussians.
    pub geometry: &'a Geometry,
    /// Their luma.
    pub field: &'a Field,
    /// Nothing nearer is drawn, in world units.
    pub near: f64,
    /// Room for tile lists, at first.
    pub capacity: usize,
}

impl Scene<'_> {
    /// Hands `take` a mask for each view: its own, and 0 where it shows something else.
    ///
    /// # Errors
    /// [`LumaError`].
    pub fn masks(
        &self,
        views: &dyn TrainingViews,
        mut take: impl FnMut(usize, Vec<u8>),
    ) -> Result<(), LumaError> {
        let gpu = &self.raster.gpu;
        let mut capacity = self.capacity;
        let drawing = loop {
            let drawing = Drawing::new(self, views, capacity)?;
            match drawing.gather(self, views)? {
                None => break drawing,
                Some(needed) => capacity = needed + needed / 4,
            }
        };
        let all = drawing.sums.read(gpu)?;
        for view in 0..views.count() {
            let photo = Photo::load(views, view)?;
            let residuals = residuals(&photo, &drawing.draw_luma(self, &photo)?);
            let expected = drawing.expected(self, &photo, &residuals, &all)?;
            take(view, mask(&photo, &residuals, &expected));
        }
        Ok(())
    }
}

/// Luma and a pair of channels on the same tile lists.
struct Drawing {
    lists: Lists,
    luma: Layer,
    pair: Layer,
    pair_field: Field,
    /// Result of the adjoints, `[pixels, 4]`; the last two are not used.
    image_gradient: Buffer<f32>,
    /// Sums over all views, `[2, N]`.
    sums: Buffer<f32>,
    to_sums: ChromaAdjoint,
    /// Sums of one view, `[2, N]`.
    of_one: Buffer<f32>,
    to_one: ChromaAdjoint,
}

impl Drawing {
    fn new(scene: &Scene, views: &dyn TrainingViews, capacity: usize) -> Result<Self, GpuError> {
        let (raster, geometry) = (scene.raster, scene.geometry);
        let uniforms = || (0..views.count()).map(|view| scene.view(views.camera(view)));
        let pixels = uniforms().map(|view| view.pixel_count()).max().unwrap_or(0);
        let tiles = uniforms().map(|view| view.tile_count()).max().unwrap_or(0);
        let gpu = &raster.gpu;
        let pair_field = Field::upload(gpu, &ShField::zeros(geometry.count, 0, 2))?;
        let lists = Lists::new(raster, geometry, tiles, capacity)?;
        let luma = Layer::new(raster, geometry, &lists, scene.field, pixels, tiles)?;
        let pair = Layer::new(raster, geometry, &lists, &pair_field, pixels, tiles)?;
        let sums = Buffer::zeros(gpu, "sums of residuals", pair_field.planes.len())?;
        let of_one = Buffer::zeros(gpu, "sums of one view's residuals", sums.len())?;
        let image_gradient = Buffer::zeros(gpu, "residuals", COLOR_FIGURES * pixels)?;
        let scratch = AdjointScratch::color(gpu, geometry.count, capacity)?;
        let unused = Buffer::zeros(gpu, "sums of curvatures", sums.len())?;
        let adjoint = |gradient| {
            let sums = ChromaSums {
                gradient,
                diagonal: &unused,
            };
            let (image, scratch) = (&image_gradient, scratch.clone());
            ChromaAdjoint::new(raster, geometry, &lists, &pair, image, scratch, sums)
        };
        let [to_sums, to_one] = [adjoint(&sums), adjoint(&of_one)];
        Ok(Self {
            lists,
            luma,
            pair,
            pair_field,
            image_gradient,
            sums,
            to_sums,
            of_one,
            to_one,
        })
    }

    /// Adds up, for each Gaussian, the residuals of the pixels it is drawn to and how much
    /// it is drawn there. Gives the entries that the tile lists lacked, if they did.
    fn gather(&self, scene: &Scene, views: &dyn TrainingViews) -> Result<Option<usize>, LumaError> {
        let gpu = &scene.raster.gpu;
        for view in 0..views.count() {
            let photo = Photo::load(views, view)?;
            let luma = self.draw_luma(scene, &photo)?;
            if let Some(needed) = self.lists.status(gpu)?.overflow {
                return Ok(Some(needed));
            }
            self.pull_back(scene, &photo, &residuals(&photo, &luma), &self.to_sums);
        }
        Ok(None)
    }

    /// Brings a photo's residuals, and what counts of it, to the Gaussians.
    fn pull_back(&self, scene: &Scene, photo: &Photo, residuals: &[f32], adjoint: &ChromaAdjoint) {
        let gpu = &scene.raster.gpu;
        let figures: Vec<f32> = (residuals.iter().zip(&photo.mask))
            .flat_map(|(residual, &count)| {
                let count = f32::from(count) / 255.0;
                [count * residual, count, 0.0, 0.0]
            })
            .collect();
        self.image_gradient.write(gpu, &figures);
        let mut recorder = Recorder::new(gpu);
        adjoint.record(scene.raster, &mut recorder);
        recorder.submit();
    }

    /// The residuals that all views but this one lead to expect; `all` are the sums over
    /// all of them. Infinite where no other view sees anything.
    fn expected(
        &self,
        scene: &Scene,
        photo: &Photo,
        residuals: &[f32],
        all: &[f32],
    ) -> Result<Vec<f32>, GpuError> {
        let gpu = &scene.raster.gpu;
        let mut recorder = Recorder::new(gpu);
        recorder.clear(self.of_one.raw());
        recorder.submit();
        self.pull_back(scene, photo, residuals, &self.to_one);
        let own = self.of_one.read(gpu)?;
        let count = all.len() / 2;
        let of_others = |k: usize| (all[k] - own[k]).max(0.0);
        // Weighted by how much the others see of a Gaussian: who is seen by none says nothing.
        let seen = |i: usize| {
            let weight = of_others(count + i);
            (weight > SEEN_MIN).then(|| of_others(i) / weight)
        };
        let constant = (1.0 / sh::C0) as f32;
        let means = (0..count).map(|i| constant * seen(i).unwrap_or(0.0));
        let weights = (0..count).map(|i| constant * f32::from(u8::from(seen(i).is_some())));
        let planes: Vec<f32> = means.chain(weights).collect();
        self.pair_field.planes.write(gpu, &planes);
        let pair = self.draw_pair(scene, photo)?;
        Ok((pair.chunks_exact(2))
            .map(|pair| match pair[1] > KNOWN_MIN {
                true => pair[0] / pair[1],
                false => f32::INFINITY,
            })
            .collect())
    }

    fn draw_luma(&self, scene: &Scene, photo: &Photo) -> Result<Vec<f32>, GpuError> {
        let (raster, gpu) = (scene.raster, &scene.raster.gpu);
        let view = scene.view(&photo.camera);
        let mut recorder = Recorder::new(gpu);
        self.lists.set_view(gpu, &view);
        self.lists.record(raster, &mut recorder);
        self.luma.record(raster, &mut recorder);
        // What the adjoints need of the pair.
        self.pair.record(raster, &mut recorder);
        recorder.submit();
        self.luma.read_image(gpu, view.pixel_count())
    }

    /// With the lists of the luma drawn last. The pair has the constant harmonic alone.
    fn draw_pair(&self, scene: &Scene, photo: &Photo) -> Result<Vec<f32>, GpuError> {
        let (raster, gpu) = (scene.raster, &scene.raster.gpu);
        let view = ViewUniform {
            sh_degree: 0,
            ..scene.view(&photo.camera)
        };
        self.lists.set_view(gpu, &view);
        let mut recorder = Recorder::new(gpu);
        self.pair.record(raster, &mut recorder);
        recorder.submit();
        self.pair.read_image(gpu, view.pixel_count())
    }
}

impl Scene<'_> {
    fn view(&self, camera: &Camera) -> ViewUniform {
        ViewUniform::new(camera, self.near, self.geometry.count, self.field.degree)
    }
}

/// Absolute residual of each pixel, averaged with its neighbors, in gray 0 to 1.
fn residuals(photo: &Photo, luma: &[f32]) -> Vec<f32> {
    let sizes: Vec<f32> = (luma.iter().zip(&photo.gray))
        .map(|(&luma, &gray)| {
            let shown = photo.exposure.shown(f64::from(luma)) as f32;
            (shown - f32::from(gray) / 255.0).abs()
        })
        .collect();
    around(&photo.camera, &sizes, |values| {
        let (sum, count) =
            values.fold((0.0, 0.0), |(sum, count), value| (sum + value, count + 1.0));
        sum / count
    })
}

/// The photo's mask without the pixels whose residual is not to be expected.
fn mask(photo: &Photo, residuals: &[f32], expectation: &[f32]) -> Vec<u8> {
    let found: Vec<f32> = (residuals.iter().zip(expectation))
        .map(|(&residual, &expected)| {
            let defect = residual > RESIDUAL_MIN && residual > EXCESS * expected;
            f32::from(u8::from(defect))
        })
        .collect();
    let share = f64::from(found.iter().sum::<f32>()) / found.len() as f64;
    if share > SHARE_MAX {
        return photo.mask.clone();
    }
    let grown = around(&photo.camera, &found, |values| values.fold(0.0, f32::max));
    (grown.iter().zip(&photo.mask))
        .map(|(&defect, &count)| if defect > 0.0 { 0 } else { count })
        .collect()
}

/// Applies `of` to the neighborhood of each pixel.
fn around(
    camera: &Camera,
    values: &[f32],
    of: impl Fn(&mut dyn Iterator<Item = f32>) -> f32,
) -> Vec<f32> {
    let [width, height] = [camera.width, camera.height].map(|side| side as usize);
    (0..values.len())
        .map(|pixel| {
            let (x, y) = (pixel % width, pixel / width);
            let rows = y.saturating_sub(REACH)..(y + REACH + 1).min(height);
            let columns = x.saturating_sub(REACH)..(x + REACH + 1).min(width);
            of(&mut rows.flat_map(|row| columns.clone().map(move |x| values[row * width + x])))
        })
        .collect()
}
