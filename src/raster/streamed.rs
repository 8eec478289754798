//! Scenes that wait on the host: of each view what it may show goes onto the device.

use std::sync::Arc;

use glam::DVec3;

use super::{
    Field, Geometry, Raster, RenderedImage, Renderer,
    constants::{ALPHA_MIN, BLUR, FRUSTUM_MARGIN, TRANSMITTANCE_MIN},
};
use crate::{
    capture::Camera,
    gpu::GpuError,
    splats::{ShField, Splats, sh},
};

/// Bound on rounding errors of the device: a share of depths and extents, and pixels.
const SLACK: f64 = 1e-3;
const PIXEL_SLACK: f64 = 1.0;

/// View frustum of a camera.
pub struct Frustum<'a> {
    camera: &'a Camera,
    near: f64,
}

impl<'a> Frustum<'a> {
    /// Frustum of a camera with the near plane at `near` world units.
    pub fn new(camera: &'a Camera, near: f64) -> Self {
        Self { camera, near }
    }

    /// Returns true if `project` may find any of a Gaussian in the image: conservative, and nearly
    /// tight. `widest` is the largest standard deviation in world units. The bound is the largest
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
    /// Without harmonics.
    splats: Splats,
    /// Largest standard deviation of each Gaussian.
    widest: Vec<f64>,
    near: f64,
    /// Gaussians that a picture's parts are drawn from, at most.
    at_once: usize,
}

impl Streamed {
    /// The geometry of `splats`, of which nothing is shown that is nearer to a camera than `near`
    /// world units.
    pub fn new(splats: &Splats, near: f64) -> Self {
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
            near,
            at_once: usize::MAX,
        }
    }

    /// Number of Gaussians.
    pub fn len(&self) -> usize {
        self.splats.len()
    }

    /// Returns true if there are no Gaussians.
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

    /// Draws fields of this scene's Gaussians as a [`Renderer`] does that has them all. Where
    /// those that the camera may show have no room, they are drawn in parts, front to back. A
    /// part may draw the Gaussian that closes a pixel, which a [`Renderer`] leaves out: up to
    /// 1 % of its color more, in few pixels.
    ///
    /// # Errors
    /// [`GpuError`] when buffers do not fit or the device is lost.
    pub fn render(
        &mut self,
        raster: &Arc<Raster>,
        fields: &[&ShField],
        camera: &Camera,
    ) -> Result<Vec<RenderedImage>, GpuError> {
        self.with_room(camera, |scene, shown| {
            if shown.len() <= scene.at_once {
                return (scene.renderer(raster, fields, shown, false)?).render(camera);
            }
            let mut drawn = Vec::new();
            for part in scene.parts(shown, camera) {
                let behind = (scene.renderer(raster, fields, part, true)?).render(camera)?;
                if drawn.is_empty() {
                    drawn = behind;
                } else if !show_through(&mut drawn, &behind) {
                    break;
                }
            }
            drawn.pop();
            Ok(drawn)
        })
    }

    /// Median depth as `camera` sees it, going on from `pixels` of
    /// [`blend_depth`](super::blend_depth).
    pub(super) fn depth(
        &mut self,
        raster: &Arc<Raster>,
        camera: &Camera,
        pixels: &[f32],
    ) -> Result<Vec<f32>, GpuError> {
        self.with_room(camera, |scene, shown| {
            let mut pixels = pixels.to_vec();
            for part in scene.parts(shown, camera) {
                pixels = (scene.renderer(raster, &[], part, false)?).depth(camera, &pixels)?;
            }
            Ok(pixels)
        })
    }

    /// Draws what a camera may show, in smaller parts where there is no room.
    fn with_room<T>(
        &mut self,
        camera: &Camera,
        draw: impl Fn(&Self, &mut [usize]) -> Result<T, GpuError>,
    ) -> Result<T, GpuError> {
        let mut shown = self.shown(camera);
        loop {
            match draw(self, &mut shown) {
                Err(GpuError::TooLarge { .. }) if self.at_once.min(shown.len()) > 1 => {
                    self.at_once = self.at_once.min(shown.len()).div_ceil(2);
                }
                done => return done,
            }
        }
    }

    /// Gaussians front to back, as many at a time as have room.
    fn parts<'s>(
        &self,
        shown: &'s mut [usize],
        camera: &Camera,
    ) -> impl Iterator<Item = &'s [usize]> {
        let depth = |i: usize| camera.depth(DVec3::from(self.splats.means[i].map(f64::from)));
        shown.sort_by(|&a, &b| depth(a).total_cmp(&depth(b)));
        shown.chunks_mut(self.at_once).map(|part| {
            // Of equal depths the first comes first.
            part.sort_unstable();
            &*part
        })
    }

    /// A renderer of some Gaussians, and with `opacity` of how opaque they are.
    fn renderer(
        &self,
        raster: &Arc<Raster>,
        fields: &[&ShField],
        shown: &[usize],
        opacity: bool,
    ) -> Result<Renderer, GpuError> {
        let gpu = &raster.gpu;
        let chosen = fields.iter().map(|field| field.chosen(shown));
        let white = opacity.then(|| ShField {
            degree: 0,
            channels: 1,
            coefficients: vec![(0.5 / sh::C0) as f32; shown.len()],
        });
        let fields = chosen
            .chain(white)
            .map(|field| Field::upload(gpu, &field))
            .collect::<Result<_, _>>()?;
        let geometry = Geometry::upload(gpu, &self.chosen(shown))?;
        Renderer::new(raster.clone(), geometry, fields, self.near)
    }
}

/// Puts pictures behind others where these let light through. The last of each is opacity.
/// Whether there is light left: what the rasterizer ignores is none.
fn show_through(front: &mut [RenderedImage], behind: &[RenderedImage]) -> bool {
    let Some(opacity) = front.last() else {
        return false;
    };
    let left: Vec<f32> = opacity.pixels.iter().map(|opacity| 1.0 - opacity).collect();
    for (front, behind) in front.iter_mut().zip(behind) {
        let channels = front.channels;
        for (i, (front, behind)) in front.pixels.iter_mut().zip(&behind.pixels).enumerate() {
            *front += left[i / channels] * behind;
        }
    }
    let opacity = front.last().map_or(&[][..], |opacity| &opacity.pixels);
    opacity
        .iter()
        .any(|opacity| 1.0 - opacity >= TRANSMITTANCE_MIN)
}
