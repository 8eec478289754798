//! One view at one scale: tile lists made once, drawn and pulled back many times.

use super::{
    ChromaView,
    loss::{ChromaLossWeights, Correction, LOSS_BLOCK},
};
use crate::{
    gpu::{Bindings, Buffer, Gpu, GpuError, Kernel, Recorder},
    raster::{
        Field, Geometry, Layer, LayerAdjoint, Lists, Load, LossLog, Outcome, Raster, ViewUniform,
    },
};

/// What all passes share.
pub struct Shared {
    /// The frozen geometry.
    pub geometry: Geometry,
    /// The chroma that is learnt.
    pub field: Field,
    /// Its gradient, written by whichever pass ran last.
    pub gradient: Buffer<f32>,
    /// The losses.
    pub log: LossLog,
    /// The loss kernel.
    pub loss: Kernel,
    /// A correction that changes nothing: this solver takes teachers as they are.
    pub corrections: Buffer<Correction>,
    /// Nearest depth shown, in world units.
    pub near: f64,
}

/// One view at one scale.
pub struct Pass {
    /// The camera at this scale.
    pub view: ViewUniform,
    lists: Lists,
    layer: Layer,
    adjoint: LayerAdjoint,
    loss: Bindings,
    /// Whether the lists hold this view already.
    listed: bool,
}

impl Pass {
    /// A pass towards `wanted`. `coarser` is the pass of the next coarser scale of the
    /// same view; without one `loss_weights` have no agreement.
    ///
    /// # Errors
    /// [`GpuError`] when it does not fit.
    pub fn new(
        raster: &Raster,
        shared: &Shared,
        wanted: &ChromaView,
        coarser: Option<&Self>,
        loss_weights: ChromaLossWeights,
    ) -> Result<Self, GpuError> {
        let gpu = &raster.gpu;
        let geometry = &shared.geometry;
        let view = ViewUniform::new(
            &wanted.camera,
            shared.near,
            geometry.count,
            shared.field.degree,
        );
        let (pixels, tiles) = (view.pixel_count(), view.tile_count());
        let lists = exact_lists(raster, geometry, &view)?;
        let layer = Layer::new(raster, geometry, &lists, &shared.field, pixels, tiles)?;
        let adjoint = LayerAdjoint::new(
            raster,
            geometry,
            &lists,
            &shared.field,
            &layer,
            &Outcome::Gradient(&shared.gradient),
        )?;
        let pixel_weights = wanted.weights.as_deref().unwrap_or(&[0.0]);
        let pixel_weights = Buffer::from_slice(gpu, "pixel weights", pixel_weights)?;
        let weights = Buffer::uniform(
            gpu,
            "chroma loss weights",
            &ChromaLossWeights {
                coarser_size: coarser.map_or([1, 1], |pass| pass.view.size),
                agreement: coarser.map_or(0.0, |_| loss_weights.agreement),
                weighted: u32::from(wanted.weights.is_some()),
                ..loss_weights
            },
        )?;
        let wanted = Buffer::from_slice(gpu, "wanted a/b", &wanted.wanted.ab)?;
        let loss = shared.loss.bind(
            gpu,
            &[
                lists.view.raw(),
                layer.image.raw(),
                wanted.raw(),
                coarser.map_or(&layer, |pass| &pass.layer).image.raw(),
                weights.raw(),
                shared.log.block_losses.raw(),
                adjoint.image_gradient.raw(),
                pixel_weights.raw(),
                shared.corrections.raw(),
            ],
        );
        Ok(Self {
            view,
            lists,
            layer,
            adjoint,
            loss,
            listed: false,
        })
    }

    /// Bytes on the device: the sum over the buffers of [`Lists`], [`Layer`] and
    /// [`LayerAdjoint`] for each Gaussian, list entry and pixel.
    pub fn bytes(&self) -> usize {
        let splats = self.view.splat_count as usize;
        80 * splats + 28 * self.lists.capacity + 28 * self.view.pixel_count()
    }

    /// Its share of [`Distiller::load`](super::Distiller::load).
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn load(&self, gpu: &Gpu) -> Result<Load, GpuError> {
        let status = self.lists.status(gpu)?;
        Ok(Load {
            visible: status.visible as f64,
            instances: status.instances as f64,
            pixels: self.view.pixel_count() as f64,
            tiles: self.view.tile_count() as f64,
            ..Load::default()
        })
    }

    /// Blocks of its loss.
    pub fn blocks(&self) -> u32 {
        self.view.pixel_count().div_ceil(LOSS_BLOCK) as u32
    }

    /// Records drawing, loss and adjoint.
    pub fn record(&mut self, raster: &Raster, shared: &Shared, recorder: &mut Recorder) {
        if !self.listed {
            self.lists.set_view(&raster.gpu, &self.view);
            self.lists.record(raster, recorder);
            self.listed = true;
        }
        self.layer.record(raster, recorder);
        recorder.dispatch(&shared.loss, &self.loss, self.blocks());
        self.adjoint.record(raster, recorder);
    }
}

/// Lists with just the room that this view needs; the geometry will not change.
fn exact_lists(
    raster: &Raster,
    geometry: &Geometry,
    view: &ViewUniform,
) -> Result<Lists, GpuError> {
    let needed = exact_capacity(raster, geometry, view)?;
    Lists::new(raster, geometry, view.tile_count(), needed)
}

/// Entries of the tile lists that this view needs.
///
/// # Errors
/// [`GpuError`] when the device is lost.
pub fn exact_capacity(
    raster: &Raster,
    geometry: &Geometry,
    view: &ViewUniform,
) -> Result<usize, GpuError> {
    // Nothing fits into no room: the device counts what it would have needed.
    let probe = Lists::new(raster, geometry, view.tile_count(), 0)?;
    let mut recorder = Recorder::new(&raster.gpu);
    probe.set_view(&raster.gpu, view);
    probe.record(raster, &mut recorder);
    recorder.submit();
    Ok(probe.status(&raster.gpu)?.overflow.unwrap_or(0))
}
