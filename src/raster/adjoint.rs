//! The adjoints of a [`Layer`]: `blend_backward` and `sum_instances`, which all share, then
//! `shade_backward` down to the field and, for luma, `project_backward` down to the geometry.

use super::{
    ColorKind, Falloff, Raster, StepBuffers, Storage,
    constants::*,
    groups::{Count, WorkKind},
    layer::Layer,
    lists::Lists,
    portions::TileBindings,
    splats::{Field, Geometry},
};
use crate::gpu::{Bindings, Buffer, Gpu, GpuError, Kernel, Recorder, groups_for};

/// Figures of a luma record: six of the geometry, the pull, the luma.
const LUMA_FIGURES: usize = 8;

/// Figures of a color record on frozen geometry: its gradient, then its curvature.
pub const COLOR_FIGURES: usize = 4;

/// Scratch buffers of an adjoint. Adjoints that run one after the other may share them.
#[derive(Clone)]
pub struct AdjointScratch {
    /// The gradient record of each list entry on the image plane, by emission slot, in
    /// words: with [`Storage::Half`](super::Storage), luma's have two figures a word.
    pub partials: Buffer<u32>,
    /// The gradient record of each Gaussian on the image plane; stale where not visible.
    pub gradients: Buffer<f32>,
    /// True if the records include geometry gradients.
    trains_geometry: bool,
}

impl AdjointScratch {
    /// For a [`LumaAdjoint`] of so many Gaussians and entries of the tile lists.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn luma(
        gpu: &Gpu,
        storage: Storage,
        splats: usize,
        capacity: usize,
    ) -> Result<Self, GpuError> {
        Self::new(
            gpu,
            [storage.words(LUMA_FIGURES), LUMA_FIGURES],
            splats,
            capacity,
        )
    }

    /// For a [`ChromaAdjoint`] of so many Gaussians and entries of the tile lists.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn color(gpu: &Gpu, splats: usize, capacity: usize) -> Result<Self, GpuError> {
        Self::new(gpu, [COLOR_FIGURES; 2], splats, capacity)
    }

    /// Bytes of [`AdjointScratch::color`].
    pub fn color_bytes(splats: usize, capacity: usize) -> u64 {
        4 * COLOR_FIGURES as u64 * (splats + capacity) as u64
    }

    pub(super) fn new(
        gpu: &Gpu,
        [words, figures]: [usize; 2],
        splats: usize,
        capacity: usize,
    ) -> Result<Self, GpuError> {
        Ok(Self {
            partials: Buffer::zeros(gpu, "instance gradients", capacity * words)?,
            gradients: Buffer::zeros(gpu, "projected gradients", splats * figures)?,
            trains_geometry: figures > COLOR_FIGURES,
        })
    }
}

/// From the gradient of the picture to a record of each Gaussian on the image plane.
pub(super) struct BlendAdjoint {
    pub(super) scratch: AdjointScratch,
    pub(super) count: usize,
    visible: Count,
    blend: TileBindings,
    sum: Bindings,
}

impl BlendAdjoint {
    pub(super) fn new(
        gpu: &Gpu,
        [blend, sum]: [&Kernel; 2],
        geometry: &Geometry,
        lists: &Lists,
        layer: &Layer,
        image_gradient: &Buffer<f32>,
        scratch: AdjointScratch,
    ) -> Self {
        let mut of_blend = vec![
            (0, lists.view.raw()),
            (1, lists.starts.raw()),
            (2, lists.slots().raw()),
            (3, lists.instance_splats.raw()),
            (4, lists.projected.raw()),
            (5, layer.lasts.raw()),
            (6, image_gradient.raw()),
            (7, scratch.partials.raw()),
        ];
        let mut of_sum = vec![
            lists.order().raw(),
            lists.offsets.raw(),
            lists.status.raw(),
            scratch.partials.raw(),
            scratch.gradients.raw(),
        ];
        if scratch.trains_geometry {
            of_blend.extend([(8, layer.colors.raw()), (9, layer.image.raw())]);
            of_sum.push(lists.projected.raw());
        }
        Self {
            blend: (lists.portions).bind(gpu, blend, &of_blend, 10, layer.max_tiles),
            sum: sum.bind(gpu, &of_sum),
            visible: lists.visible.clone(),
            scratch,
            count: geometry.count,
        }
    }

    pub(super) fn record(&self, [blend, sum]: [&Kernel; 2], recorder: &mut Recorder) {
        self.blend.record(blend, recorder);
        self.visible
            .dispatch(WorkKind::Thread, sum, &self.sum, recorder);
    }
}

/// Use of the gradient of luma's parameters.
pub enum Outcome<'a> {
    /// It is written: that of the field to this buffer, which several adjoints may
    /// share, that of the geometry to planes of its own.
    Gradient(&'a Buffer<f32>),
    /// Adam takes a step with it, and it is never stored.
    Step {
        /// Step of the geometry.
        geometry: StepBuffers<'a>,
        /// Step of the field.
        field: StepBuffers<'a>,
    },
}

/// The adjoint of a luma [`Layer`]: from the gradient of the picture to gradients of the
/// field and of the geometry, or to a step of Adam along them.
pub struct LumaAdjoint {
    /// Gradient of the loss with respect to the picture, `[pixels]`; the loss writes it.
    pub image_gradient: Buffer<f32>,
    /// Gradient planes of the geometry, `[11, N]`; empty where Adam steps at once.
    pub geometry_gradient: Buffer<f32>,
    /// Densification statistics, planes `[2, N]`.
    pub statistics: Buffer<f32>,
    blend: BlendAdjoint,
    steps: bool,
    shade: Bindings,
    project: Bindings,
}

impl LumaAdjoint {
    /// Bytes of one that ends in a step, for so many Gaussians, entries of the tile lists
    /// (stored in full) and pixels.
    pub fn bytes(splats: usize, capacity: usize, max_pixels: usize) -> u64 {
        let of_splat = LUMA_FIGURES + 3 + STATISTICS_PLANES;
        4 * (of_splat * splats + LUMA_FIGURES * capacity + max_pixels) as u64
    }

    /// The adjoint of `layer`, which draws luma.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        raster: &Raster,
        geometry: &Geometry,
        lists: &Lists,
        field: &Field,
        layer: &Layer,
        outcome: &Outcome<'_>,
    ) -> Result<Self, GpuError> {
        let gpu = &raster.gpu;
        let n = geometry.count;
        let image_gradient = Buffer::zeros(gpu, "image gradient", layer.image.len())?;
        let scratch = AdjointScratch::luma(gpu, raster.numerics.storage, n, lists.capacity)?;
        let mean_gradient = Buffer::<f32>::zeros(gpu, "gradient of means", 3 * n)?;
        let statistics = Buffer::zeros(gpu, "statistics", STATISTICS_PLANES * n)?;
        let planes = match outcome {
            Outcome::Gradient(_) => geometry.planes.len(),
            Outcome::Step { .. } => 0,
        };
        let geometry_gradient = Buffer::zeros(gpu, "geometry gradient", planes)?;
        let mut of_shade: Vec<_> = (0..)
            .zip([
                lists.view.raw(),
                geometry.planes.raw(),
                lists.ranks.raw(),
                layer.colors.raw(),
                scratch.gradients.raw(),
            ])
            .collect();
        of_shade.extend([(6, field.planes.raw()), (7, mean_gradient.raw())]);
        let mut of_project: Vec<_> = (0..)
            .zip([
                lists.view.raw(),
                geometry.planes.raw(),
                lists.ranks.raw(),
                lists.projected.raw(),
                scratch.gradients.raw(),
            ])
            .collect();
        of_project.extend([
            (6, statistics.raw()),
            (7, mean_gradient.raw()),
            (8, lists.status.raw()),
        ]);
        match outcome {
            Outcome::Gradient(gradient) => {
                of_shade.push((5, gradient.raw()));
                of_project.push((5, geometry_gradient.raw()));
            }
            Outcome::Step { geometry, field } => {
                of_shade.push((8, lists.status.raw()));
                for (bindings, of) in [(&mut of_shade, field), (&mut of_project, geometry)] {
                    bindings.extend([
                        (9, of.parameters.raw()),
                        (10, of.moments.first.raw()),
                        (11, of.moments.second.raw()),
                    ]);
                }
            }
        }
        let steps = matches!(outcome, Outcome::Step { .. });
        let [shade, project] = raster.luma_ending(steps);
        Ok(Self {
            blend: BlendAdjoint::new(
                gpu,
                raster.blend_backward.luma(),
                geometry,
                lists,
                layer,
                &image_gradient,
                scratch.clone(),
            ),
            shade: shade.bind_at(gpu, &of_shade),
            project: project.bind_at(gpu, &of_project),
            image_gradient,
            geometry_gradient,
            statistics,
            steps,
        })
    }

    /// Its scratch buffers.
    pub fn scratch(&self) -> &AdjointScratch {
        &self.blend.scratch
    }

    /// Records the adjoint; lists, layer and loss must have been recorded before.
    ///
    /// # Panics
    /// Of a rasterizer with another falloff than a Gaussian's.
    pub fn record(&self, raster: &Raster, recorder: &mut Recorder) {
        raster.assert_gaussian();
        let [shade, project] = raster.luma_ending(self.steps);
        let groups = groups_for(self.blend.count);
        self.blend.record(raster.blend_backward.luma(), recorder);
        recorder.dispatch(shade, &self.shade, groups);
        recorder.dispatch(project, &self.project, groups);
    }
}

/// Buffers that a [`ChromaAdjoint`] adds to.
#[derive(Clone, Copy)]
pub struct ChromaSums<'a> {
    /// Gradient of the field, planes `[harmonics, channels, N]`: of as many harmonics as
    /// there are planes for, at most those that are drawn.
    pub gradient: &'a Buffer<f32>,
    /// The constant harmonic times the pixels' curvatures, each weighed as it is drawn:
    /// planes `[2, N]` of a and b, `[1, N]` of RGB.
    pub diagonal: &'a Buffer<f32>,
}

/// The adjoint of a [`Layer`] of a/b or RGB on frozen geometry: adds the gradient of the
/// field, and the sums of the curvatures, to those of other views.
pub struct ChromaAdjoint {
    kind: ColorKind,
    blend: BlendAdjoint,
    shade: Bindings,
}

impl ChromaAdjoint {
    /// The adjoint of `layer`, which draws a/b or RGB, from `image_gradient`
    /// `[pixels, 4]`: of each pixel the gradient (a, b or R, G, B), then the curvature (of
    /// a and b, or one for R, G and B).
    pub fn new(
        raster: &Raster,
        geometry: &Geometry,
        lists: &Lists,
        layer: &Layer,
        image_gradient: &Buffer<f32>,
        scratch: AdjointScratch,
        sums: ChromaSums<'_>,
    ) -> Self {
        let gpu = &raster.gpu;
        let shade = raster.shade_backward_color(layer.kind).bind(
            gpu,
            &[
                lists.view.raw(),
                geometry.planes.raw(),
                lists.ranks.raw(),
                layer.colors.raw(),
                scratch.gradients.raw(),
                sums.gradient.raw(),
                sums.diagonal.raw(),
            ],
        );
        Self {
            kind: layer.kind,
            blend: BlendAdjoint::new(
                gpu,
                raster.blend_backward.color(),
                geometry,
                lists,
                layer,
                image_gradient,
                scratch,
            ),
            shade,
        }
    }

    /// Records the adjoint; lists, layer and loss must have been recorded before.
    ///
    /// # Panics
    /// Of a rasterizer with another falloff than a Gaussian's.
    pub fn record(&self, raster: &Raster, recorder: &mut Recorder) {
        raster.assert_gaussian();
        self.blend.record(raster.blend_backward.color(), recorder);
        let shade = raster.shade_backward_color(self.kind);
        recorder.dispatch(shade, &self.shade, groups_for(self.blend.count));
    }
}

impl Raster {
    /// Kernels after luma's image-plane records, for the field and for the geometry.
    fn luma_ending(&self, steps: bool) -> [&Kernel; 2] {
        match steps {
            true => [&self.shade_step, &self.projection.step],
            false => [&self.shade_backward.luma, &self.projection.backward],
        }
    }

    /// The kernels of these adjoints know no other.
    fn assert_gaussian(&self) {
        assert_eq!(self.options.falloff, Falloff::Gaussian, "no adjoint");
    }

    fn shade_backward_color(&self, kind: ColorKind) -> &Kernel {
        match kind {
            ColorKind::Rgb => &self.shade_backward.rgb,
            ColorKind::Chroma | ColorKind::Luma => &self.shade_backward.chroma,
        }
    }
}
