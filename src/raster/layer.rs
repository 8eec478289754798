//! One field of colour drawn over a view's tile lists: `shade` and `blend`, and
//! their adjoints down to the parameters.

use super::{
    ColorKind, Raster, StepBuffers, Storage,
    constants::*,
    lists::Lists,
    splats::{Field, Geometry},
};
use crate::gpu::{Bindings, Buffer, Gpu, GpuError, Kernel, Recorder, groups_for};

/// What a layer draws on. Layers that are drawn one after the other may share it.
#[derive(Clone)]
pub struct Canvas {
    colors: Buffer<f32>,
    image: Buffer<f32>,
    lasts: Buffer<u32>,
}

impl Canvas {
    /// A canvas for so many Gaussians and pixels.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        gpu: &Gpu,
        kind: ColorKind,
        splats: usize,
        max_pixels: usize,
    ) -> Result<Self, GpuError> {
        let stride = kind.stride();
        Ok(Self {
            colors: Buffer::zeros(gpu, "colors", splats * stride)?,
            image: Buffer::zeros(gpu, "image", max_pixels * stride)?,
            lasts: Buffer::zeros(gpu, "lasts", max_pixels)?,
        })
    }
}

/// Buffers and bindings that draw one field.
pub struct Layer {
    /// What is drawn.
    pub kind: ColorKind,
    /// Colour of each visible Gaussian, `[N]` of the kind's stride.
    pub colors: Buffer<f32>,
    /// The picture, `[pixels]` of the kind's stride.
    pub image: Buffer<f32>,
    /// Entries of its tile that each pixel used.
    pub lasts: Buffer<u32>,
    count: usize,
    max_tiles: usize,
    shade: Bindings,
    blend: Bindings,
}

impl Layer {
    /// A layer for views of at most `max_pixels` pixels and `max_tiles` tiles.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        raster: &Raster,
        geometry: &Geometry,
        lists: &Lists,
        field: &Field,
        max_pixels: usize,
        max_tiles: usize,
    ) -> Result<Self, GpuError> {
        let canvas = Canvas::new(&raster.gpu, field.kind, geometry.count, max_pixels)?;
        Ok(Self::on(raster, geometry, lists, field, canvas, max_tiles))
    }

    /// A layer on a canvas that is there, for views of at most `max_tiles` tiles.
    pub fn on(
        raster: &Raster,
        geometry: &Geometry,
        lists: &Lists,
        field: &Field,
        canvas: Canvas,
        max_tiles: usize,
    ) -> Self {
        let gpu = &raster.gpu;
        let Canvas {
            colors,
            image,
            lasts,
        } = canvas;
        let kernels = raster.layer(field.kind);
        let shade = kernels.shade.bind(
            gpu,
            &[
                lists.view.raw(),
                geometry.planes.raw(),
                field.planes.raw(),
                lists.ranks.raw(),
                lists.projected.raw(),
                colors.raw(),
                lists.status.raw(),
            ],
        );
        let blend = kernels.blend.bind(
            gpu,
            &[
                lists.view.raw(),
                lists.starts.raw(),
                lists.slots().raw(),
                lists.instance_splats.raw(),
                lists.projected.raw(),
                colors.raw(),
                image.raw(),
                lasts.raw(),
            ],
        );
        Self {
            kind: field.kind,
            colors,
            image,
            lasts,
            count: geometry.count,
            max_tiles,
            shade,
            blend,
        }
    }

    /// Records shading and blending; the lists must have been recorded before.
    pub fn record(&self, raster: &Raster, recorder: &mut Recorder) {
        let kernels = raster.layer(self.kind);
        recorder.dispatch(&kernels.shade, &self.shade, groups_for(self.count));
        recorder.dispatch(&kernels.blend, &self.blend, self.max_tiles as u32);
    }

    /// Reads the picture as `[pixels, channels]`.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn read_image(&self, gpu: &Gpu, pixels: usize) -> Result<Vec<f32>, GpuError> {
        let (stride, channels) = (self.kind.stride(), self.kind.channels());
        let image = self.image.read(gpu)?;
        Ok(image
            .chunks_exact(stride)
            .take(pixels)
            .flat_map(|pixel| &pixel[..channels])
            .copied()
            .collect())
    }
}

/// What an adjoint writes on the way. Adjoints that run one after the other may
/// share it.
#[derive(Clone)]
pub struct AdjointScratch {
    /// The gradient record of each list entry on the image plane, by emission slot, in
    /// words: with [`Storage::Half`](super::Storage), luma's have two figures a word.
    pub partials: Buffer<u32>,
    /// The gradient record of each Gaussian on the image plane; stale where not visible.
    pub gradients: Buffer<f32>,
}

impl AdjointScratch {
    /// Scratch for so many Gaussians and entries of the tile lists; `storage` of luma's
    /// entries, chroma's are always stored in full.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        gpu: &Gpu,
        kind: ColorKind,
        storage: Storage,
        splats: usize,
        capacity: usize,
    ) -> Result<Self, GpuError> {
        let record = kind.channels() + if kind == ColorKind::Luma { 7 } else { 0 };
        let words = match kind {
            ColorKind::Luma => storage.words(record),
            ColorKind::Chroma | ColorKind::Rgb => record,
        };
        Ok(Self {
            partials: Buffer::zeros(gpu, "instance gradients", capacity * words)?,
            gradients: Buffer::zeros(gpu, "projected gradients", splats * record)?,
        })
    }
}

/// What the last kernels of an adjoint do with the gradient.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Ending {
    Replaces,
    Adds,
    Steps,
}

/// The adjoint of a [`Layer`]: from the gradient of the picture to gradients of
/// the field and, for luma, of the geometry.
pub struct LayerAdjoint {
    /// Gradient of the loss with respect to the picture; the loss writes it.
    pub image_gradient: Buffer<f32>,
    /// Gradient and statistics of the geometry, luma only.
    pub geometry: Option<GeometryAdjoint>,
    kind: ColorKind,
    ending: Ending,
    count: usize,
    max_tiles: usize,
    blend: Bindings,
    sum: Bindings,
    shade: Bindings,
}

/// What becomes of the gradient of the parameters.
pub enum Outcome<'a> {
    /// It is written: that of the field to this buffer, which several adjoints may
    /// share, that of the geometry (luma only) to planes of its own.
    Gradient(&'a Buffer<f32>),
    /// It is added to what this buffer holds (chroma only).
    Sum(&'a Buffer<f32>),
    /// Adam takes a step with it, and it is never stored (luma only).
    Step {
        /// Of the geometry.
        geometry: StepBuffers<'a>,
        /// Of the field.
        field: StepBuffers<'a>,
    },
}

/// The part of the adjoint that reaches the geometry.
pub struct GeometryAdjoint {
    /// Gradient planes `[11, N]`; empty where Adam steps at once.
    pub gradient: Buffer<f32>,
    /// Densification statistics, planes `[2, N]`.
    pub statistics: Buffer<f32>,
    project: Bindings,
}

impl LayerAdjoint {
    /// The adjoint of `layer`.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    ///
    /// # Panics
    /// When chroma is to step at once, or luma to be added up.
    pub fn new(
        raster: &Raster,
        geometry: &Geometry,
        lists: &Lists,
        field: &Field,
        layer: &Layer,
        outcome: &Outcome<'_>,
    ) -> Result<Self, GpuError> {
        let image_gradient = Buffer::zeros(&raster.gpu, "image gradient", layer.image.len())?;
        let scratch = AdjointScratch::new(
            &raster.gpu,
            field.kind,
            raster.numerics.storage,
            geometry.count,
            lists.capacity,
        )?;
        Self::on(
            raster,
            geometry,
            lists,
            field,
            layer,
            image_gradient,
            scratch,
            outcome,
        )
    }

    /// The adjoint of `layer` from the picture's gradient in `image_gradient`, with
    /// scratch that is there.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    ///
    /// # Panics
    /// When chroma is to step at once, or luma to be added up.
    #[allow(
        clippy::too_many_arguments,
        reason = "what is drawn, what on, and what becomes of it"
    )]
    pub fn on(
        raster: &Raster,
        geometry: &Geometry,
        lists: &Lists,
        field: &Field,
        layer: &Layer,
        image_gradient: Buffer<f32>,
        scratch: AdjointScratch,
        outcome: &Outcome<'_>,
    ) -> Result<Self, GpuError> {
        let gpu = &raster.gpu;
        let n = geometry.count;
        let with_geometry = field.kind == ColorKind::Luma;
        let AdjointScratch {
            partials,
            gradients,
        } = scratch;
        let ending = match outcome {
            Outcome::Gradient(_) => Ending::Replaces,
            Outcome::Sum(_) => Ending::Adds,
            Outcome::Step { .. } => Ending::Steps,
        };
        assert!(
            with_geometry || ending != Ending::Steps,
            "only luma steps at once"
        );
        let kernels = raster.adjoint(field.kind);
        let mut buffers = vec![
            lists.view.raw(),
            lists.starts.raw(),
            lists.slots().raw(),
            lists.instance_splats.raw(),
            lists.projected.raw(),
            layer.lasts.raw(),
            image_gradient.raw(),
            partials.raw(),
        ];
        if with_geometry {
            buffers.extend([layer.colors.raw(), layer.image.raw()]);
        }
        let blend = kernels.blend.bind(gpu, &buffers);
        let mut buffers = vec![
            lists.order().raw(),
            lists.offsets.raw(),
            lists.status.raw(),
            partials.raw(),
            gradients.raw(),
        ];
        if with_geometry {
            buffers.push(lists.projected.raw());
        }
        let sum = kernels.sum.bind(gpu, &buffers);
        let mean_gradient = with_geometry
            .then(|| Buffer::<f32>::zeros(gpu, "gradient of means", 3 * n))
            .transpose()?;
        let mut bindings: Vec<_> = (0..)
            .zip([
                lists.view.raw(),
                geometry.planes.raw(),
                lists.ranks.raw(),
                layer.colors.raw(),
                gradients.raw(),
            ])
            .collect();
        if let Outcome::Gradient(field_gradient) | Outcome::Sum(field_gradient) = outcome {
            bindings.push((5, field_gradient.raw()));
        }
        if let Some(mean_gradient) = &mean_gradient {
            bindings.extend([(6, field.planes.raw()), (7, mean_gradient.raw())]);
        }
        if let Outcome::Step { field, .. } = outcome {
            bindings.extend([(8, field.parameters.raw()), (9, lists.status.raw())]);
            bindings.extend([
                (10, field.moments.first.raw()),
                (11, field.moments.second.raw()),
            ]);
        }
        let shade = raster
            .shade_backward(field.kind, ending)
            .bind_at(gpu, &bindings);
        let geometry = mean_gradient
            .map(|mean_gradient| -> Result<_, GpuError> {
                let statistics = Buffer::zeros(gpu, "statistics", STATISTICS_PLANES * n)?;
                let planes = match ending {
                    Ending::Steps => 0,
                    Ending::Replaces | Ending::Adds => geometry.planes.len(),
                };
                let gradient = Buffer::zeros(gpu, "geometry gradient", planes)?;
                let mut bindings: Vec<_> = (0..)
                    .zip([
                        lists.view.raw(),
                        geometry.planes.raw(),
                        lists.ranks.raw(),
                        lists.projected.raw(),
                        gradients.raw(),
                        gradient.raw(),
                        statistics.raw(),
                        lists.status.raw(),
                        mean_gradient.raw(),
                    ])
                    .collect();
                let project = match outcome {
                    Outcome::Gradient(_) | Outcome::Sum(_) => {
                        raster.projection.backward.bind_at(gpu, &bindings)
                    }
                    Outcome::Step { geometry, .. } => {
                        bindings.retain(|&(binding, _)| binding != 5);
                        bindings.extend([(9, geometry.parameters.raw())]);
                        bindings.extend([
                            (10, geometry.moments.first.raw()),
                            (11, geometry.moments.second.raw()),
                        ]);
                        raster.projection.step.bind_at(gpu, &bindings)
                    }
                };
                Ok(GeometryAdjoint {
                    gradient,
                    statistics,
                    project,
                })
            })
            .transpose()?;
        Ok(Self {
            image_gradient,
            geometry,
            kind: field.kind,
            ending,
            count: n,
            max_tiles: layer.max_tiles,
            blend,
            sum,
            shade,
        })
    }

    /// Records the adjoint; lists, layer and loss must have been recorded before.
    pub fn record(&self, raster: &Raster, recorder: &mut Recorder) {
        let kernels = raster.adjoint(self.kind);
        let groups = groups_for(self.count);
        recorder.dispatch(&kernels.blend, &self.blend, self.max_tiles as u32);
        recorder.dispatch(&kernels.sum, &self.sum, groups);
        let shade = raster.shade_backward(self.kind, self.ending);
        recorder.dispatch(shade, &self.shade, groups);
        if let Some(geometry) = &self.geometry {
            let project = match self.ending {
                Ending::Steps => &raster.projection.step,
                Ending::Replaces | Ending::Adds => &raster.projection.backward,
            };
            recorder.dispatch(project, &geometry.project, groups);
        }
    }
}

impl Raster {
    fn shade_backward(&self, kind: ColorKind, ending: Ending) -> &Kernel {
        let kernels = self.adjoint(kind);
        match ending {
            Ending::Replaces => &kernels.shade,
            Ending::Adds => (kernels.shade_add.as_ref()).expect("only chroma is added up"),
            Ending::Steps => &self.shade_step,
        }
    }
}
