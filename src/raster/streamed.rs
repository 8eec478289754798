//! Scenes that wait on the host: of each view what it may show goes onto the device.

use std::sync::Arc;

use glam::DVec3;

use super::{
    Field, Geometry, Picture, Raster, Renderer,
    constants::{ALPHA_MIN, BLUR, FRUSTUM_MARGIN, NEAR_SHARE},
};
use crate::{
    capture::Camera,
    gpu::GpuError,
    splats::{ShField, Splats},
};

/// How far rounding on the device may be off: a share of depths and extents, and pixels.
const SLACK: f64 = 1e-3;
const PIXEL_SLACK: f64 = 1.0;

/// What a camera may show.
pub struct Frustum<'a> {
    camera: &'a Camera,
    near: f64,
}

impl<'a> Frustum<'a> {
    /// Of a camera that shows nothing nearer than `near` world units.
    pub fn new(camera: &'a Camera, near: f64) -> Self {
        Self { camera, near }
    }

    /// Whether `project` may find any of a Gaussian in the picture: all that it finds, and little
    /// else. `widest` is the largest standard deviation in world units. The bound is the largest
    /// that the linearized projection can make of a ball, at an opacity of one.
    pub fn may_show(&self, mean: [f32; 3], widest: f64) -> bool {
        let camera = self.camera;
        let at = camera.rotation * DVec3::from(mean.map(f64::from)) + camera.translation;
        let cutoff = -2.0 * f64::from(ALPHA_MIN).ln();
        let inside = |at: f64, z: f64, focal: f64, center: f64, side: u32| {
            let side = f64::from(side);
            let margin = FRUSTUM_MARGIN * 0.5 * side / focal;
            let slope = (at / z).clamp(-center / focal - margin, (side - center) / focal + margin);
            let deviation = widest * focal / z;
            let variance = deviation * deviation * (1.0 + slope * slope) + f64::from(BLUR);
            let extent = (1.0 + SLACK) * (cutoff * variance).sqrt() + PIXEL_SLACK;
            let pixel = focal * at / z + center;
            pixel > -extent && pixel < side + extent
        };
        // NaN fails.
        at.z > self.near * (1.0 - SLACK)
            && inside(at.x, at.z, camera.fx, camera.cx, camera.width)
            && inside(at.y, at.z, camera.fy, camera.cy, camera.height)
    }
}

/// A scene on the host.
pub struct Streamed {
    splats: Splats,
    /// Largest standard deviation of each Gaussian.
    widest: Vec<f64>,
    near: f64,
}

impl Streamed {
    /// The geometry of `splats`, of a capture of this `extent` in world units.
    pub fn new(splats: &Splats, extent: f64) -> Self {
        let widest = splats.log_scales.iter().map(|scales| {
            let widest = scales.iter().copied().fold(f32::MIN, f32::max);
            f64::from(widest).exp()
        });
        Self {
            widest: widest.collect(),
            splats: Splats {
                // No channels: there is nothing to choose.
                sh: ShField::default(),
                means: splats.means.clone(),
                quats: splats.quats.clone(),
                log_scales: splats.log_scales.clone(),
                opacity_logits: splats.opacity_logits.clone(),
            },
            near: NEAR_SHARE * extent,
        }
    }

    /// Number of Gaussians.
    pub fn len(&self) -> usize {
        self.splats.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The Gaussians that a camera may show, ascending.
    pub fn shown(&self, camera: &Camera) -> Vec<usize> {
        let frustum = Frustum::new(camera, self.near);
        let means = self.splats.means.iter().zip(&self.widest).enumerate();
        means
            .filter(|(_, (mean, widest))| frustum.may_show(**mean, **widest))
            .map(|(i, _)| i)
            .collect()
    }

    /// Geometry of some Gaussians, without colors.
    pub fn chosen(&self, indices: &[usize]) -> Splats {
        self.splats.chosen(indices)
    }

    /// Draws fields of this scene's Gaussians as a [`Renderer`] does that has them all.
    ///
    /// # Errors
    /// [`GpuError`] when buffers do not fit or the device is lost.
    pub fn render(
        &self,
        raster: &Arc<Raster>,
        fields: &[&ShField],
        camera: &Camera,
    ) -> Result<Vec<Picture>, GpuError> {
        let (shown, gpu) = (self.shown(camera), &raster.gpu);
        let fields = fields
            .iter()
            .map(|field| Field::upload(gpu, &field.chosen(&shown)));
        let fields = fields.collect::<Result<_, _>>()?;
        let geometry = Geometry::upload(gpu, &self.chosen(&shown))?;
        Renderer::new(raster.clone(), geometry, fields, self.near)?.render(camera)
    }
}
