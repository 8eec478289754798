//! The rows of the linear problem that one view at one scale contributes: drawing
//! it is A, the adjoint of that Aᵀ.

use std::rc::Rc;

use super::{
    correction::Corrections,
    lbfgs::{System, UNBOUNDED},
    loss::{ChromaLossWeights, LOSS_BLOCK},
    view::ChromaView,
};
use crate::{
    gpu::{Bindings, Buffer, Gpu, GpuError, Kernel, Recorder},
    raster::{
        AdjointScratch, Canvas, ColorKind, Field, Geometry, Layer, LayerAdjoint, Lists, LossLog,
        Outcome, Raster, Status, Storage, ViewUniform,
    },
};

/// What all rows share.
pub struct Shared {
    /// The frozen geometry.
    pub geometry: Geometry,
    /// The chroma that is solved for; its planes are the system's unknowns.
    pub field: Field,
    /// The system.
    pub system: System,
    /// The losses.
    pub log: LossLog,
    /// Corrections of the views.
    pub corrections: Corrections,
    /// What the pictures of each scale are drawn on, full size first.
    pub canvases: Vec<(Canvas, Buffer<f32>)>,
    /// What adjoints write on the way.
    pub scratch: AdjointScratch,
    loss: Kernel,
}

/// Sizes that [`Shared`] must have room for.
pub struct Room {
    /// Pixels of the largest picture of each scale, full size first.
    pub pixels: Vec<usize>,
    /// Entries of the longest tile lists.
    pub capacity: usize,
}

impl Shared {
    /// Buffers for rows of `room`.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        gpu: &Gpu,
        geometry: Geometry,
        field: Field,
        log: LossLog,
        views: usize,
        room: &Room,
    ) -> Result<Self, GpuError> {
        let zeros = |label| Buffer::<f32>::zeros(gpu, label, field.planes.len());
        let system = System {
            unknowns: field.planes.clone(),
            gradient: zeros("gradient")?,
            diagonal: zeros("diagonal")?,
            floors: Buffer::from_slice(gpu, "floors", &vec![UNBOUNDED; field.planes.len()])?,
            losses: log.losses.clone(),
        };
        let canvases = (room.pixels.iter())
            .map(|&pixels| {
                Ok((
                    Canvas::new(gpu, ColorKind::Chroma, geometry.count, pixels)?,
                    Buffer::zeros(gpu, "image gradient", 2 * pixels)?,
                ))
            })
            .collect::<Result<_, GpuError>>()?;
        Ok(Self {
            system,
            log,
            corrections: Corrections::new(gpu, views)?,
            canvases,
            scratch: AdjointScratch::new(
                gpu,
                ColorKind::Chroma,
                Storage::Full,
                geometry.count,
                room.capacity,
            )?,
            geometry,
            field,
            loss: super::loss::curvature_kernel(gpu),
        })
    }
}

/// One view at one scale.
pub struct Rows {
    /// The camera at this scale.
    pub view: ViewUniform,
    lists: Rc<Lists>,
    /// Whether the lists are this view's alone, and hold it already.
    own_lists: Option<bool>,
    chroma: Layer,
    weights: Buffer<ChromaLossWeights>,
    loss_weights: ChromaLossWeights,
    loss: Bindings,
    sums: Bindings,
    gradient: LayerAdjoint,
    diagonal: LayerAdjoint,
}

impl Rows {
    /// The rows of `view`, which is at `scale` already. `lists` are its own or shared
    /// with others of which one is drawn at a time. `coarser` are the rows of the next
    /// coarser scale.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    #[allow(
        clippy::too_many_arguments,
        reason = "one for each thing it is made of"
    )]
    pub fn new(
        raster: &Raster,
        shared: &Shared,
        near: f64,
        view: &ChromaView,
        [index, scale]: [usize; 2],
        lists: (Rc<Lists>, bool),
        coarser: Option<&Self>,
    ) -> Result<Self, GpuError> {
        let gpu = &raster.gpu;
        let geometry = &shared.geometry;
        let uniform = ViewUniform::new(&view.camera, near, geometry.count, shared.field.degree);
        let (lists, own) = lists;
        let tiles = uniform.tile_count();
        let (canvas, image_gradient) = &shared.canvases[scale];
        let canvas = canvas.clone();
        let chroma = Layer::on(raster, geometry, &lists, &shared.field, canvas, tiles);
        let wanted = Buffer::from_slice(gpu, "wanted a/b", &view.wanted.ab)?;
        let pixel_weights = Buffer::from_slice(
            gpu,
            "pixel weights",
            view.weights.as_deref().unwrap_or(&[0.0]),
        )?;
        let curvatures = Buffer::<f32>::zeros(gpu, "curvatures", 2 * uniform.pixel_count())?;
        let loss_weights = ChromaLossWeights {
            coarser_size: coarser.map_or([1, 1], |rows| rows.view.size),
            teacher: 1.0,
            view_index: index as u32,
            weighted: u32::from(view.weights.is_some()),
            ..ChromaLossWeights::default()
        };
        let weights = Buffer::uniform(gpu, "chroma loss weights", &loss_weights)?;
        let loss = shared.loss.bind(
            gpu,
            &[
                lists.view.raw(),
                chroma.image.raw(),
                wanted.raw(),
                coarser.map_or(&chroma, |rows| &rows.chroma).image.raw(),
                weights.raw(),
                shared.log.block_losses.raw(),
                image_gradient.raw(),
                pixel_weights.raw(),
                shared.corrections.corrections.raw(),
                curvatures.raw(),
            ],
        );
        let sums = shared.corrections.bind(
            gpu,
            index,
            [
                lists.view.raw(),
                chroma.image.raw(),
                wanted.raw(),
                curvatures.raw(),
            ],
            (&pixel_weights, view.weights.is_some()),
        )?;
        let adjoint = |from: &Buffer<f32>, to: &Buffer<f32>| {
            LayerAdjoint::on(
                raster,
                geometry,
                &lists,
                &shared.field,
                &chroma,
                from.clone(),
                shared.scratch.clone(),
                &Outcome::Sum(to),
            )
        };
        Ok(Self {
            gradient: adjoint(image_gradient, &shared.system.gradient)?,
            diagonal: adjoint(&curvatures, &shared.system.diagonal)?,
            view: uniform,
            lists,
            own_lists: own.then_some(false),
            chroma,
            weights,
            loss_weights,
            loss,
            sums,
        })
    }

    /// What the lists counted.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn status(&self, gpu: &Gpu) -> Result<Status, GpuError> {
        self.lists.status(gpu)
    }

    /// Blocks of the loss.
    pub fn blocks(&self) -> u32 {
        self.view.pixel_count().div_ceil(LOSS_BLOCK) as u32
    }

    /// Makes the lists hold this view.
    fn list(&mut self, raster: &Raster, recorder: &mut Recorder) {
        if self.own_lists != Some(true) {
            self.lists.set_view(&raster.gpu, &self.view);
            self.lists.record(raster, recorder);
            if let Some(listed) = &mut self.own_lists {
                *listed = true;
            }
        }
    }

    /// Sets how the next [`Rows::draw`] weighs the coarser scale and at which residual
    /// its loss levels off.
    pub fn weigh_by(&mut self, gpu: &Gpu, agreement: f32, robust: Option<f32>) {
        if self.loss_weights.coarser_size != [1, 1] {
            self.loss_weights.agreement = agreement;
        }
        let ChromaLossWeights { decline, joint, .. } = ChromaLossWeights::robust(robust);
        (self.loss_weights.decline, self.loss_weights.joint) = (decline, joint);
        self.weights.write(gpu, &[self.loss_weights]);
    }

    /// Records the present picture, its loss and curvature.
    pub fn draw(&mut self, raster: &Raster, shared: &Shared, recorder: &mut Recorder) {
        self.list(raster, recorder);
        self.chroma.record(raster, recorder);
        recorder.dispatch(&shared.loss, &self.loss, self.blocks());
    }

    /// Records what adds the gradient and the curvature's adjoint to those of the other
    /// rows; after [`Rows::draw`].
    pub fn add_gradient(&self, raster: &Raster, recorder: &mut Recorder) {
        self.gradient.record(raster, recorder);
        self.diagonal.record(raster, recorder);
    }

    /// Records the sums for this view's correction; after [`Rows::draw`].
    pub fn sum_correction(&self, shared: &Shared, recorder: &mut Recorder) {
        shared.corrections.sum(&self.sums, recorder);
    }
}
