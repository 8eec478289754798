//! Contribution of each Gaussian to an image: the adjoint of an image whose every pixel has
//! gradient one.

use std::sync::Arc;

use super::{
    AdjointScratch, COLOR_FIGURES, ChromaAdjoint, ChromaSums, ColorKind, Field, Geometry, Layer,
    Lists, Raster, ViewUniform, constants::NEAR_SHARE, renderer::INSTANCES_PER_SPLAT,
};
use crate::{
    capture::Camera,
    gpu::{Buffer, GpuError, Recorder},
    splats::{ShField, Splats, sh},
};

/// Weighs the Gaussians of one scene, one camera after the other.
pub struct Contributions {
    raster: Arc<Raster>,
    geometry: Geometry,
    field: Field,
    near: f64,
    gradient: Buffer<f32>,
    diagonal: Buffer<f32>,
    room: Option<Buffers>,
}

/// Buffers for views up to a size.
struct Buffers {
    max_pixels: usize,
    max_tiles: usize,
    lists: Lists,
    layer: Layer,
    adjoint: ChromaAdjoint,
}

impl Contributions {
    /// Contributions of `splats` as `raster` draws them, nothing nearer to a camera than
    /// [`NEAR_SHARE`] of `extent`, in world units.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(raster: &Arc<Raster>, splats: &Splats, extent: f64) -> Result<Self, GpuError> {
        let gpu = &raster.gpu;
        let channels = ColorKind::Chroma.channels();
        let diagonals = COLOR_FIGURES - channels;
        Ok(Self {
            raster: raster.clone(),
            geometry: Geometry::upload(gpu, splats)?,
            field: Field::upload(gpu, &ShField::zeros(splats.len(), 0, channels))?,
            near: NEAR_SHARE * extent,
            gradient: Buffer::zeros(gpu, "contributions", channels * splats.len())?,
            diagonal: Buffer::zeros(gpu, "curvatures", diagonals * splats.len())?,
            room: None,
        })
    }

    /// The sum over the camera's pixels of each Gaussian's opacity there times the
    /// transmittance before it, `[N]`: how many pixels it fills.
    ///
    /// # Errors
    /// [`GpuError`] when buffers do not fit or the device is lost.
    ///
    /// # Panics
    /// Of a rasterizer with another falloff than a Gaussian's.
    pub fn of(&mut self, camera: &Camera) -> Result<Vec<f32>, GpuError> {
        let gpu = self.raster.gpu.clone();
        let view = ViewUniform::new(camera, self.near, self.geometry.count, 0);
        let (pixels, tiles) = (view.pixel_count(), view.tile_count());
        let mut room = match self.room.take() {
            Some(room) if pixels <= room.max_pixels && tiles <= room.max_tiles => room,
            Some(room) => {
                let [pixels, tiles] = [pixels.max(room.max_pixels), tiles.max(room.max_tiles)];
                self.room(pixels, tiles, room.lists.capacity)?
            }
            None => self.room(pixels, tiles, self.geometry.count * INSTANCES_PER_SPLAT)?,
        };
        loop {
            let mut recorder = Recorder::new(&gpu);
            recorder.clear(self.gradient.raw());
            room.lists.set_view(&gpu, &view);
            room.lists.record(&self.raster, &mut recorder);
            room.layer.record(&self.raster, &mut recorder);
            room.adjoint.record(&self.raster, &mut recorder);
            recorder.submit();
            match room.lists.status(&gpu)?.overflow {
                None => break,
                Some(needed) => {
                    room = self.room(room.max_pixels, room.max_tiles, needed + needed / 4)?;
                }
            }
        }
        self.room = Some(room);
        let gradient = self.gradient.read(&gpu)?;
        // The constant harmonic's gradient is the weight times its basis function.
        let weight = |gradient: &f32| (f64::from(*gradient) / sh::C0) as f32;
        Ok(gradient[..self.geometry.count].iter().map(weight).collect())
    }

    fn room(&self, pixels: usize, tiles: usize, capacity: usize) -> Result<Buffers, GpuError> {
        let (raster, gpu) = (&self.raster, &self.raster.gpu);
        let lists = Lists::new(raster, &self.geometry, tiles, capacity)?;
        let layer = Layer::new(raster, &self.geometry, &lists, &self.field, pixels, tiles)?;
        // Of each pixel a counts, b and the curvatures do not.
        let one = [1.0, 0.0, 0.0, 0.0];
        let ones = Buffer::from_slice(gpu, "image gradient", one.repeat(pixels).as_slice())?;
        let scratch = AdjointScratch::color(gpu, self.geometry.count, capacity)?;
        let sums = ChromaSums {
            gradient: &self.gradient,
            diagonal: &self.diagonal,
        };
        let adjoint =
            ChromaAdjoint::new(raster, &self.geometry, &lists, &layer, &ones, scratch, sums);
        Ok(Buffers {
            max_pixels: pixels,
            max_tiles: tiles,
            lists,
            layer,
            adjoint,
        })
    }
}
