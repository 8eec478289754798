//! Unknowns that wait on the host: planes `[planes, N]` of which the Gaussians of
//! one view go onto the device, and whose gradient comes back from there.

use super::ChromaError;
use crate::{
    gpu::{Buffer, Gpu},
    raster::{field_of, planes_of},
    splats::{ShField, sh},
};

/// A system of which the device holds what one view shows.
pub(super) struct HostSystem {
    degree: u32,
    channels: usize,
    count: usize,
    /// The harmonics.
    pub unknowns: Vec<f32>,
    /// Gradient of the first so many planes.
    pub gradient: Vec<f32>,
    /// See [`ChromaSums::diagonal`](crate::raster::ChromaSums).
    pub diagonal: Vec<f32>,
}

impl HostSystem {
    /// Begins with `start`, whose first `planes` planes are solved for.
    pub fn new(start: &ShField, planes: usize, diagonals: usize) -> Self {
        let stride = start.channels * sh::coefficient_count(start.degree);
        let count = start.coefficients.len() / stride;
        Self {
            degree: start.degree,
            channels: start.channels,
            count,
            unknowns: planes_of(start, count),
            gradient: vec![0.0; planes * count],
            diagonal: vec![0.0; diagonals * count],
        }
    }

    /// Takes harmonics like those that it began with.
    pub fn put(&mut self, field: &ShField) {
        self.unknowns = planes_of(field, self.count);
    }

    /// The harmonics.
    pub fn field(&self) -> ShField {
        field_of(&self.unknowns, self.degree, self.channels)
    }

    /// Forgets gradient and curvature.
    pub fn clear(&mut self) {
        self.gradient.fill(0.0);
        self.diagonal.fill(0.0);
    }

    /// Puts the unknowns of some Gaussians on the device.
    pub fn send(&self, gpu: &Gpu, shown: &[usize], to: &Buffer<f32>) {
        let planes = self.unknowns.len() / self.count;
        let room = to.len() / planes;
        let mut some = vec![0.0; to.len()];
        let planes = some.chunks_exact_mut(room);
        for (some, all) in planes.zip(self.unknowns.chunks_exact(self.count)) {
            for (value, &i) in some.iter_mut().zip(shown) {
                *value = all[i];
            }
        }
        to.write(gpu, &some);
    }

    /// Adds what the device found of the gradient and the curvature of some Gaussians.
    pub fn receive(
        &mut self,
        gpu: &Gpu,
        shown: &[usize],
        [gradient, diagonal]: [&Buffer<f32>; 2],
    ) -> Result<(), ChromaError> {
        let found = [gradient.read_later(gpu), diagonal.read_later(gpu)];
        for (all, found) in [&mut self.gradient, &mut self.diagonal]
            .into_iter()
            .zip(found)
        {
            let found = found.wait(gpu)?;
            let room = found.len() / (all.len() / self.count);
            for (all, some) in all
                .chunks_exact_mut(self.count)
                .zip(found.chunks_exact(room))
            {
                for (value, &i) in some.iter().zip(shown) {
                    all[i] += value;
                }
            }
        }
        Ok(())
    }
}
