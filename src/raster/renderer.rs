//! Pictures of a scene on the device, one camera after the other.

use std::sync::Arc;

use super::{Field, Geometry, Layer, Lists, Raster, ViewUniform, blend_depth};
use crate::{
    capture::Camera,
    gpu::{GpuError, Recorder},
};

/// Tile-list entries to begin with, for each Gaussian; grows on demand.
pub(super) const INSTANCES_PER_SPLAT: usize = 8;

/// A picture as the rasterizer gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderedImage {
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
    lists: Lists,
    /// The view that `lists` holds.
    listed: Option<ViewUniform>,
    layers: Vec<Layer>,
    max_pixels: usize,
    max_tiles: usize,
}

impl RenderedImage {
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
            lists,
            listed: None,
            layers: Vec::new(),
            max_pixels: 0,
            max_tiles: 0,
        })
    }

    /// Draws all fields as `camera` sees them.
    ///
    /// # Errors
    /// [`GpuError`] when buffers do not fit or the device is lost.
    pub fn render(&mut self, camera: &Camera) -> Result<Vec<RenderedImage>, GpuError> {
        let view = ViewUniform::new(camera, self.near, self.geometry.count, 0);
        self.listed = None;
        self.with_room(&view, |renderer| {
            for index in 0..renderer.fields.len() {
                // The degree is a property of the field, the rest of the view.
                let view = ViewUniform {
                    sh_degree: renderer.fields[index].degree,
                    ..view
                };
                renderer.over_lists(&view, |renderer, recorder| {
                    renderer.layers[index].record(&renderer.raster, recorder);
                });
            }
            Ok(())
        })?;
        self.layers
            .iter()
            .map(|layer| {
                Ok(RenderedImage {
                    width: camera.width,
                    height: camera.height,
                    channels: layer.kind.channels(),
                    pixels: layer.read_image(&self.raster.gpu, view.pixel_count())?,
                })
            })
            .collect()
    }

    /// Median depth as `camera` sees it, going on from `pixels` of [`blend_depth`]; over the lists
    /// of [`Renderer::render`] where it drew the same view last.
    pub(super) fn depth(&mut self, camera: &Camera, pixels: &[f32]) -> Result<Vec<f32>, GpuError> {
        let view = ViewUniform::new(camera, self.near, self.geometry.count, 0);
        self.with_room(&view, |renderer| {
            let blend = |renderer: &Self, recorder: &mut _| {
                let (raster, lists) = (&renderer.raster, &renderer.lists);
                blend_depth(raster, lists, pixels, view.tile_count(), recorder)
            };
            let drawn = renderer.over_lists(&view, blend)?;
            drawn.read(&renderer.raster.gpu)
        })
    }

    /// Records over the lists of a view, which are made where they hold another one: geometry
    /// decides about them, and no field.
    fn over_lists<T>(
        &mut self,
        view: &ViewUniform,
        record: impl FnOnce(&Self, &mut Recorder) -> T,
    ) -> T {
        let mut recorder = Recorder::new(&self.raster.gpu);
        self.lists.set_view(&self.raster.gpu, view);
        let geometric = ViewUniform {
            sh_degree: 0,
            ..*view
        };
        if self.listed != Some(geometric) {
            self.lists.record(&self.raster, &mut recorder);
            self.listed = Some(geometric);
        }
        let recorded = record(self, &mut recorder);
        recorder.submit();
        recorded
    }

    /// Draws, again where the lists turn out to have no room.
    fn with_room<T>(
        &mut self,
        view: &ViewUniform,
        draw: impl Fn(&mut Self) -> Result<T, GpuError>,
    ) -> Result<T, GpuError> {
        // Of two views, the one with fewer pixels may have more tiles.
        if view.pixel_count() > self.max_pixels || view.tile_count() > self.max_tiles {
            let least = self.geometry.count * INSTANCES_PER_SPLAT;
            self.resize(view, self.lists.capacity.max(least))?;
        }
        loop {
            let drawn = draw(self)?;
            match self.lists.status(&self.raster.gpu)?.overflow {
                None => return Ok(drawn),
                Some(needed) => self.resize(view, needed + needed / 4)?,
            }
        }
    }

    fn resize(&mut self, view: &ViewUniform, capacity: usize) -> Result<(), GpuError> {
        let raster = &self.raster;
        self.max_pixels = self.max_pixels.max(view.pixel_count());
        self.max_tiles = self.max_tiles.max(view.tile_count());
        self.listed = None;
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
