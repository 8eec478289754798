//! Pictures of a scene on the device, one camera after the other.

use std::sync::Arc;

use super::{Field, Geometry, Layer, Lists, Raster, ViewUniform};
use crate::{
    capture::Camera,
    gpu::{GpuError, Recorder},
};

/// Tile-list entries to begin with, for each Gaussian; grows on demand.
pub(super) const INSTANCES_PER_SPLAT: usize = 8;

/// A picture as the rasterizer gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Channels of a pixel.
    pub channels: usize,
    /// `[height, width, channels]`.
    pub pixels: Vec<f32>,
}

/// Draws fields over one geometry.
pub struct Renderer {
    raster: Arc<Raster>,
    geometry: Geometry,
    fields: Vec<Field>,
    near: f64,
    one_list: bool,
    lists: Lists,
    layers: Vec<Layer>,
    max_pixels: usize,
    max_tiles: usize,
}

impl Picture {
    /// The picture as viewers show it, sRGB in [0, 1], `[height, width]`: of one channel
    /// gray, of three RGB.
    pub fn shown(&self) -> Vec<[f32; 3]> {
        let pixels = self.pixels.chunks_exact(self.channels.max(1));
        pixels
            .map(|pixel| [0, 1, 2].map(|c| pixel[c.min(pixel.len() - 1)].clamp(0.0, 1.0)))
            .collect()
    }
}

impl Renderer {
    /// A renderer of `fields` over `geometry` that shows nothing nearer to a
    /// camera than `near` world units.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        raster: Arc<Raster>,
        geometry: Geometry,
        fields: Vec<Field>,
        near: f64,
    ) -> Result<Self, GpuError> {
        let lists = Lists::new(&raster, &geometry, 1, 1)?;
        Ok(Self {
            raster,
            geometry,
            fields,
            near,
            one_list: false,
            lists,
            layers: Vec::new(),
            max_pixels: 0,
            max_tiles: 0,
        })
    }

    /// Makes tile lists once a view, not once a field: for fields in which every
    /// Gaussian has a color that can be drawn. One that shading refuses would be missing
    /// in the fields behind.
    pub fn with_one_list(mut self) -> Self {
        self.one_list = true;
        self
    }

    /// Draws all fields as `camera` sees them.
    ///
    /// # Errors
    /// [`GpuError`] when buffers do not fit or the device is lost.
    pub fn render(&mut self, camera: &Camera) -> Result<Vec<Picture>, GpuError> {
        let view = ViewUniform::new(camera, self.near, self.geometry.count, 0);
        // Of two views, the one with fewer pixels may have more tiles.
        if view.pixel_count() > self.max_pixels || view.tile_count() > self.max_tiles {
            let capacity = self
                .lists
                .capacity
                .max(self.geometry.count * INSTANCES_PER_SPLAT);
            self.resize(&view, capacity)?;
        }
        loop {
            for (index, (layer, field)) in self.layers.iter().zip(&self.fields).enumerate() {
                // The degree is a property of the field, the rest of the view.
                let mut recorder = Recorder::new(&self.raster.gpu);
                self.lists.set_view(
                    &self.raster.gpu,
                    &ViewUniform {
                        sh_degree: field.degree,
                        ..view
                    },
                );
                if index == 0 || !self.one_list {
                    self.lists.record(&self.raster, &mut recorder);
                }
                layer.record(&self.raster, &mut recorder);
                recorder.submit();
            }
            match self.lists.status(&self.raster.gpu)?.overflow {
                None => break,
                Some(needed) => self.resize(&view, needed + needed / 4)?,
            }
        }
        self.layers
            .iter()
            .map(|layer| {
                Ok(Picture {
                    width: camera.width,
                    height: camera.height,
                    channels: layer.kind.channels(),
                    pixels: layer.read_image(&self.raster.gpu, view.pixel_count())?,
                })
            })
            .collect()
    }

    fn resize(&mut self, view: &ViewUniform, capacity: usize) -> Result<(), GpuError> {
        let raster = &self.raster;
        self.max_pixels = self.max_pixels.max(view.pixel_count());
        self.max_tiles = self.max_tiles.max(view.tile_count());
        self.lists = Lists::new(raster, &self.geometry, self.max_tiles, capacity)?;
        self.layers = self
            .fields
            .iter()
            .map(|field| {
                Layer::new(
                    raster,
                    &self.geometry,
                    &self.lists,
                    field,
                    self.max_pixels,
                    self.max_tiles,
                )
            })
            .collect::<Result<_, _>>()?;
        Ok(())
    }
}
