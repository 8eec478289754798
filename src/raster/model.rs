//! Trainable state: planes of parameters and Adam's moments, with one owner.

use super::{AdamMoments, Field, Geometry, constants::GEOMETRY_PLANES};
use crate::{
    gpu::{Buffer, Gpu, GpuError},
    splats::{Splats, sh},
};

/// Gaussians that are trained.
pub struct Model {
    /// Means, quaternions, log-scales and opacity logits.
    pub geometry: Geometry,
    /// Spherical harmonics of luma.
    pub field: Field,
    /// Adam's moments of the geometry.
    pub geometry_moments: AdamMoments,
    /// Adam's moments of the harmonics.
    pub field_moments: AdamMoments,
    /// Number of fixed Gaussians, the last ones; they are drawn but not trained.
    pub held: usize,
}

impl Model {
    /// Bytes of so many Gaussians with harmonics of `sh_degree`.
    pub fn bytes(count: usize, sh_degree: u32) -> u64 {
        let planes = GEOMETRY_PLANES + sh::coefficient_count(sh_degree);
        // Values and both moments.
        4 * (3 * planes * count) as u64
    }

    /// Uploads Gaussians; Adam starts from rest.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn upload(gpu: &Gpu, splats: &Splats) -> Result<Self, GpuError> {
        let geometry = Geometry::upload(gpu, splats)?;
        let field = Field::upload(gpu, &splats.sh)?;
        Ok(Self {
            geometry_moments: AdamMoments::zeros(gpu, geometry.planes.len())?,
            field_moments: AdamMoments::zeros(gpu, field.planes.len())?,
            geometry,
            field,
            held: 0,
        })
    }

    /// Adds Gaussians of the same degree behind the others, to be drawn and held as they are.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`], [`GpuError::Lost`].
    pub fn hold(&mut self, gpu: &Gpu, splats: &Splats) -> Result<(), GpuError> {
        let (mut all, more) = (
            self.snapshot(gpu)?,
            Self::upload(gpu, splats)?.snapshot(gpu)?,
        );
        for (planes, behind) in all.planes.iter_mut().zip(&more.planes) {
            let joined = (planes.chunks_exact(all.count)).zip(behind.chunks_exact(more.count));
            *planes = joined.flat_map(|(a, b)| [a, b].concat()).collect();
        }
        all.count += more.count;
        all.held += more.count;
        self.restore(gpu, &all)
    }

    /// Number of Gaussians.
    pub fn len(&self) -> usize {
        self.geometry.count
    }

    /// Returns true if there are no Gaussians.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Reads the Gaussians.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn download(&self, gpu: &Gpu) -> Result<Splats, GpuError> {
        self.geometry.download(gpu, &self.field)
    }

    /// A copy in host memory.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn snapshot(&self, gpu: &Gpu) -> Result<Snapshot, GpuError> {
        let mut planes = Vec::new();
        for buffer in self.buffers() {
            planes.push(buffer.read(gpu)?);
        }
        Ok(Snapshot {
            count: self.geometry.count,
            held: self.held,
            planes,
        })
    }

    /// Puts what a snapshot of this model holds in the place of what there is now.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn restore(&mut self, gpu: &Gpu, snapshot: &Snapshot) -> Result<(), GpuError> {
        self.geometry.count = snapshot.count;
        self.held = snapshot.held;
        let planes = snapshot.planes.iter();
        for (buffer, planes) in self.buffers_mut().into_iter().zip(planes) {
            *buffer = Buffer::from_slice(gpu, "restored model", planes)?;
        }
        Ok(())
    }

    fn buffers(&self) -> [&Buffer<f32>; 6] {
        let (geometry, field) = (&self.geometry_moments, &self.field_moments);
        [
            &self.geometry.planes,
            &self.field.planes,
            &geometry.first,
            &geometry.second,
            &field.first,
            &field.second,
        ]
    }

    fn buffers_mut(&mut self) -> [&mut Buffer<f32>; 6] {
        let (geometry, field) = (&mut self.geometry_moments, &mut self.field_moments);
        [
            &mut self.geometry.planes,
            &mut self.field.planes,
            &mut geometry.first,
            &mut geometry.second,
            &mut field.first,
            &mut field.second,
        ]
    }
}

/// A [`Model`] in host memory: what a training can go back to.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    count: usize,
    /// [`Model::held`].
    pub held: usize,
    /// In the order of the model's buffers.
    pub planes: Vec<Vec<f32>>,
}

impl Snapshot {
    /// Number of Gaussians.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Returns true if there are no Gaussians.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// A snapshot of these planes, whose last `held` Gaussians stay; `None` where they are those
    /// of no model.
    pub fn of(planes: impl Iterator<Item = Vec<f32>>, held: usize) -> Option<Self> {
        let planes: Vec<Vec<f32>> = planes.collect();
        let [geometry, field, moments @ ..] = &planes[..] else {
            return None;
        };
        let count = geometry.len() / GEOMETRY_PLANES;
        let whole = count > held
            && geometry.len() == count * GEOMETRY_PLANES
            && field.len().is_multiple_of(count);
        let sizes = [geometry.len(), geometry.len(), field.len(), field.len()];
        let fits = moments.iter().map(Vec::len).eq(sizes);
        (whole && fits).then_some(Self {
            count,
            held,
            planes,
        })
    }
}
