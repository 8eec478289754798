//! The best on the way, which a training goes back to when what came after was not worth
//! its time.

use super::LumaTrainer;
use crate::{
    gpu::{Buffer, GpuError},
    raster::{AdamState, Geometry},
};

/// All that a training changes but what it leaves out as outliers, in host memory: the
/// device may have no room for a second set.
pub(super) struct Best {
    iteration: usize,
    psnr: f64,
    count: usize,
    geometry: Vec<f32>,
    field: Vec<f32>,
    /// Of geometry and field, the first and the second.
    moments: [[Vec<f32>; 2]; 2],
}

impl LumaTrainer {
    /// Remembers the present set if none was better by the looks so far, the last of which
    /// was at it.
    pub(super) fn keep_best(&mut self, iteration: usize) -> Result<(), GpuError> {
        let Some(psnr) = self.watch.last().map(|look| look.psnr) else {
            return Ok(());
        };
        let best = self.watch.best.as_ref();
        if best.is_some_and(|best| best.psnr >= psnr) {
            return Ok(());
        }
        let moments = |adam: &AdamState| -> Result<_, GpuError> {
            Ok([adam.first.read(&self.gpu)?, adam.second.read(&self.gpu)?])
        };
        let workspace = self.workspace();
        self.watch.best = Some(Best {
            iteration,
            psnr,
            count: self.geometry.count,
            geometry: self.geometry.planes.read(&self.gpu)?,
            field: self.field.planes.read(&self.gpu)?,
            moments: [
                moments(&workspace.adam_geometry)?,
                moments(&workspace.adam_field)?,
            ],
        });
        Ok(())
    }

    /// Puts the best set in the place of the present one, of `iteration`: that of the best,
    /// unless it is the present one.
    pub(super) fn back_to_best(&mut self, iteration: usize) -> Result<Option<usize>, GpuError> {
        let best = self.watch.best.take();
        let Some(best) = best.filter(|best| best.iteration < iteration) else {
            return Ok(None);
        };
        let upload = |data: &Vec<f32>| Buffer::from_slice(&self.gpu, "best set", data);
        let [[g1, g2], [f1, f2]] = best.moments.each_ref().map(|of| of.each_ref().map(upload));
        let moments = [[g1?, g2?], [f1?, f2?]];
        self.field.planes = upload(&best.field)?;
        self.geometry = Geometry {
            count: best.count,
            planes: upload(&best.geometry)?,
        };
        self.renew(self.workspace().lists.capacity, best.iteration, moments)?;
        self.watch.given_up = Some(iteration);
        Ok(Some(best.iteration))
    }
}
