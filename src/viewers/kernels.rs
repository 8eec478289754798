//! Kernels that draw a scene as one viewer does, and take a step toward the target pictures.

use std::sync::Arc;

use super::Viewer;
use crate::{
    chroma::RgbLossParameters,
    gpu::{Bindings, Buffer, GpuError, Kernel, Recorder, groups_for},
    raster::{AdamStep, Layer, Lists, Model, Raster, RgbAdjoint, RgbAdjointKernels, ViewUniform},
};

/// Largest number of pixels and of tiles of a view.
pub type Largest = [usize; 2];

/// One viewer's kernels.
pub struct ViewerKernels {
    raster: Arc<Raster>,
    kernels: RgbAdjointKernels,
}

/// Buffers for one viewer's pictures of a model.
pub struct Canvas {
    lists: Lists,
    layer: Layer,
    adjoint: RgbAdjoint,
    loss: Bindings,
}

impl ViewerKernels {
    pub fn new(raster: &Arc<Raster>, viewer: Viewer) -> Self {
        let raster = raster.drawing(viewer.drawing());
        Self {
            kernels: RgbAdjointKernels::new(&raster),
            raster,
        }
    }

    /// Buffers with room for so many entries of tile lists; steps move `model`.
    pub fn canvas(
        &self,
        loss: &Kernel,
        wanted: &Buffer<u32>,
        (model, steps): (&Model, &[AdamStep; 2]),
        [max_pixels, max_tiles]: Largest,
        capacity: usize,
    ) -> Result<Canvas, GpuError> {
        let (raster, gpu) = (&self.raster, &self.raster.gpu);
        let (geometry, field) = (&model.geometry, &model.field);
        let lists = Lists::new(raster, geometry, max_tiles, capacity)?;
        let layer = Layer::new(raster, geometry, &lists, field, max_pixels, max_tiles)?;
        let stepping = [
            steps[0].of(&model.geometry_moments),
            steps[1].of(&model.field_moments),
        ];
        let scene = (geometry, field);
        let adjoint = RgbAdjoint::new(raster, &self.kernels, stepping, scene, &lists, &layer)?;
        let parameters = Buffer::uniform(gpu, "rgb loss", &RgbLossParameters::default())?;
        // Every pixel counts alike, and nobody asks how large the loss is.
        let weights = Buffer::<f32>::zeros(gpu, "no weights", 1)?;
        let blocks = Buffer::<f32>::zeros(gpu, "block losses", groups_for(max_pixels) as usize)?;
        let loss = loss.bind(
            gpu,
            &[
                lists.view.raw(),
                layer.image.raw(),
                wanted.raw(),
                parameters.raw(),
                blocks.raw(),
                adjoint.image_gradient.raw(),
                weights.raw(),
            ],
        );
        Ok(Canvas {
            lists,
            layer,
            adjoint,
            loss,
        })
    }

    /// Draws a view, and takes a step of Adam.
    pub fn step(&self, canvas: &Canvas, loss: &Kernel, view: &ViewUniform) {
        let mut recorder = Recorder::new(&self.raster.gpu);
        canvas.lists.set_view(&self.raster.gpu, view);
        canvas.lists.record(&self.raster, &mut recorder);
        canvas.layer.record(&self.raster, &mut recorder);
        recorder.dispatch(loss, &canvas.loss, groups_for(view.pixel_count()));
        canvas.adjoint.record(&self.kernels, &mut recorder);
        recorder.submit();
    }

    /// Entries that the tile lists would have needed, where a view since they were made had too
    /// many: no step was taken since.
    pub fn overflow(&self, canvas: &Canvas) -> Result<Option<usize>, GpuError> {
        Ok(canvas.lists.status(&self.raster.gpu)?.overflow)
    }
}
