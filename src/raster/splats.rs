//! Gaussians on the device, one plane an attribute.

use super::{ColorKind, constants::*};
use crate::{
    gpu::{Buffer, Gpu, GpuError},
    splats::{ShField, Splats, sh},
};

/// Opacity logit of what fills up room: e^-1000 is 0.
const UNSEEN_LOGIT: f32 = -1000.0;

/// Geometry planes `[11, N]`.
pub struct Geometry {
    /// Number of Gaussians.
    pub count: usize,
    /// Planes: mean, quaternion, log-scale, opacity logit.
    pub planes: Buffer<f32>,
}

impl Geometry {
    /// Bytes of so many Gaussians.
    pub fn bytes(count: usize) -> u64 {
        4 * (GEOMETRY_PLANES * count) as u64
    }

    /// Uploads the geometry of `splats`.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn upload(gpu: &Gpu, splats: &Splats) -> Result<Self, GpuError> {
        let geometry = Self::of_none(gpu, splats.len())?;
        geometry.put(gpu, splats);
        Ok(geometry)
    }

    /// Room for so many Gaussians.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn of_none(gpu: &Gpu, count: usize) -> Result<Self, GpuError> {
        Ok(Self {
            count,
            planes: Buffer::zeros(gpu, "geometry", GEOMETRY_PLANES * count)?,
        })
    }

    /// Takes the geometry of `splats`, of which there is room for so many. What is left of the
    /// room is Gaussians that no camera shows.
    ///
    /// # Panics
    /// Where there are more.
    pub fn put(&self, gpu: &Gpu, splats: &Splats) {
        let n = self.count;
        assert!(splats.len() <= n, "{} Gaussians into {n}", splats.len());
        let mut planes = vec![0.0; GEOMETRY_PLANES * n];
        for i in 0..splats.len() {
            for axis in 0..3 {
                planes[(PLANE_MEAN + axis) * n + i] = splats.means[i][axis];
                planes[(PLANE_LOG_SCALE + axis) * n + i] = splats.log_scales[i][axis];
            }
            for k in 0..4 {
                planes[(PLANE_QUAT + k) * n + i] = splats.quats[i][k];
            }
            planes[PLANE_OPACITY * n + i] = splats.opacity_logits[i];
        }
        // A direction, or they would count as poisoned.
        planes[PLANE_QUAT * n + splats.len()..(PLANE_QUAT + 1) * n].fill(1.0);
        planes[PLANE_OPACITY * n + splats.len()..][..n - splats.len()].fill(UNSEEN_LOGIT);
        self.planes.write(gpu, &planes);
    }

    /// Reads geometry and field back into host arrays.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn download(&self, gpu: &Gpu, field: &Field) -> Result<Splats, GpuError> {
        let planes = self.planes.read(gpu)?;
        let n = self.count;
        let at = |plane: usize, i: usize| planes[plane * n + i];
        Ok(Splats {
            means: (0..n)
                .map(|i| std::array::from_fn(|k| at(PLANE_MEAN + k, i)))
                .collect(),
            quats: (0..n)
                .map(|i| std::array::from_fn(|k| at(PLANE_QUAT + k, i)))
                .collect(),
            log_scales: (0..n)
                .map(|i| std::array::from_fn(|k| at(PLANE_LOG_SCALE + k, i)))
                .collect(),
            opacity_logits: (0..n).map(|i| at(PLANE_OPACITY, i)).collect(),
            sh: field.download(gpu)?,
        })
    }
}

/// Spherical-harmonic planes `[(degree + 1)², channels, N]`.
pub struct Field {
    /// Color space of the channels.
    pub kind: ColorKind,
    /// Degree that is stored.
    pub degree: u32,
    /// Coefficients, `[planes, N]`.
    pub planes: Buffer<f32>,
}

impl Field {
    /// Uploads a field.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`], [`GpuError::NoColor`].
    pub fn upload(gpu: &Gpu, field: &ShField) -> Result<Self, GpuError> {
        let kind = ColorKind::of_channels(field.channels);
        let kind = kind.ok_or(GpuError::NoColor(field.channels))?;
        let stride = sh::coefficient_count(field.degree) * field.channels;
        let planes = planes_of(field, field.coefficients.len() / stride);
        Ok(Self {
            kind,
            degree: field.degree,
            planes: Buffer::from_slice(gpu, "spherical harmonics", &planes)?,
        })
    }

    /// Reads the field back.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn download(&self, gpu: &Gpu) -> Result<ShField, GpuError> {
        let planes = self.planes.read(gpu)?;
        Ok(field_of(&planes, self.degree, self.kind.channels()))
    }
}

/// Harmonics as planes of `room` Gaussians, zeros behind those that there are.
pub fn planes_of(field: &ShField, room: usize) -> Vec<f32> {
    let stride = sh::coefficient_count(field.degree) * field.channels;
    let mut planes = vec![0.0; stride * room];
    for (i, of_splat) in field.coefficients.chunks_exact(stride).enumerate() {
        for (k, &coefficient) in of_splat.iter().enumerate() {
            planes[k * room + i] = coefficient;
        }
    }
    planes
}

/// Harmonics from planes without room.
pub fn field_of(planes: &[f32], degree: u32, channels: usize) -> ShField {
    let stride = sh::coefficient_count(degree) * channels;
    let n = planes.len() / stride;
    let mut coefficients = vec![0.0; planes.len()];
    for i in 0..n {
        for k in 0..stride {
            coefficients[i * stride + k] = planes[k * n + i];
        }
    }
    ShField {
        degree,
        channels,
        coefficients,
    }
}
