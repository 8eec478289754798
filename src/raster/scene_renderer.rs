//! Pictures of a scene that may be larger than what the device has room for.

use std::sync::Arc;

use super::{
    Field, Geometry, Raster, RenderedImage, Renderer, Streamed,
    constants::NEAR_SHARE,
    depth::{UNREACHED, depths},
};
use crate::{
    capture::Camera,
    gpu::GpuError,
    splats::{ShField, Splats},
};

/// Draws fields over the geometry of one scene: from the device where the adapter binds as much,
/// else from the host ([`Streamed`]).
pub struct SceneRenderer<'a> {
    raster: Arc<Raster>,
    splats: &'a Splats,
    fields: Vec<&'a ShField>,
    near: f64,
    place: SceneLocation,
}

/// Location of the scene.
enum SceneLocation {
    Device(Box<Renderer>),
    Host(Streamed),
}

impl<'a> SceneRenderer<'a> {
    /// A renderer of `fields` over the geometry of `splats` that shows nothing nearer to a
    /// camera than [`NEAR_SHARE`] of the capture's `extent`, in world units.
    ///
    /// # Errors
    /// [`GpuError::NoColor`].
    pub fn of(
        raster: &Arc<Raster>,
        splats: &'a Splats,
        fields: &[&'a ShField],
        extent: f64,
    ) -> Result<Self, GpuError> {
        Self::new(raster, splats, fields, NEAR_SHARE * extent)
    }

    /// The same, nearest depth shown `near` world units.
    ///
    /// # Errors
    /// [`GpuError::NoColor`].
    pub fn new(
        raster: &Arc<Raster>,
        splats: &'a Splats,
        fields: &[&'a ShField],
        near: f64,
    ) -> Result<Self, GpuError> {
        let whole = || {
            let gpu = &raster.gpu;
            let geometry = Geometry::upload(gpu, splats)?;
            let uploaded = fields.iter().map(|field| Field::upload(gpu, field));
            Renderer::new(
                raster.clone(),
                geometry,
                uploaded.collect::<Result<_, _>>()?,
                near,
            )
        };
        let place = match whole() {
            Ok(renderer) => SceneLocation::Device(Box::new(renderer)),
            Err(GpuError::TooLarge { .. }) => SceneLocation::Host(Streamed::new(splats, near)),
            Err(other) => return Err(other),
        };
        Ok(Self {
            raster: raster.clone(),
            splats,
            fields: fields.to_vec(),
            near,
            place,
        })
    }

    /// As [`Self::of`], but one that takes no more of the device than one view needs.
    pub fn on_host(
        raster: &Arc<Raster>,
        splats: &'a Splats,
        fields: &[&'a ShField],
        extent: f64,
    ) -> Self {
        let near = NEAR_SHARE * extent;
        Self {
            place: SceneLocation::Host(Streamed::new(splats, near)),
            raster: raster.clone(),
            splats,
            fields: fields.to_vec(),
            near,
        }
    }

    /// Draws all fields as `camera` sees them.
    ///
    /// # Errors
    /// [`GpuError`] when buffers do not fit or the device is lost.
    pub fn render(&mut self, camera: &Camera) -> Result<Vec<RenderedImage>, GpuError> {
        self.on_device_or_host(
            |renderer| renderer.render(camera),
            |scene, raster, fields| scene.render(raster, fields, camera),
        )
    }

    /// Median depth along the camera's z axis in world units, `[height, width]`: that of the
    /// Gaussian behind which at most half of the light is left. NaN where there is none.
    ///
    /// # Errors
    /// [`GpuError`] when buffers do not fit or the device is lost.
    pub fn depth(&mut self, camera: &Camera) -> Result<Vec<f32>, GpuError> {
        let unreached = vec![UNREACHED; camera.width as usize * camera.height as usize];
        let pixels = self.on_device_or_host(
            |renderer| renderer.depth(camera, &unreached),
            |scene, raster, _| scene.depth(raster, camera, &unreached),
        );
        pixels.map(depths)
    }

    /// Draws from the device, or from the host where it turns out to have no room.
    fn on_device_or_host<T>(
        &mut self,
        on_device: impl Fn(&mut Renderer) -> Result<T, GpuError>,
        on_host: impl Fn(&mut Streamed, &Arc<Raster>, &[&ShField]) -> Result<T, GpuError>,
    ) -> Result<T, GpuError> {
        loop {
            match &mut self.place {
                SceneLocation::Host(scene) => return on_host(scene, &self.raster, &self.fields),
                SceneLocation::Device(renderer) => match on_device(renderer) {
                    // Of the view's tile lists.
                    Err(GpuError::TooLarge { .. }) => {
                        self.place = SceneLocation::Host(Streamed::new(self.splats, self.near));
                    }
                    done => return done,
                },
            }
        }
    }
}
