//! The adjoint of a [`Layer`] of RGB down to field and geometry, with Adam's step.

use super::{
    AdjointScratch, Falloff, Field, Geometry, Layer, Lists, Raster, StepBuffers,
    adjoint::BlendAdjoint, constants::STATISTICS_PLANES, kernels::variant,
};
use crate::gpu::{Bindings, Buffer, GpuError, Kernel, Recorder, groups_for, shaders};

/// Figures of a record: six of the geometry, the pull, R, G, B, and of some falloffs the
/// opacity's own.
const FIGURES: usize = 11;

/// The kernels, for one falloff.
pub struct RgbAdjointKernels {
    blend: Kernel,
    sum: Kernel,
    shade: Kernel,
    project: Kernel,
}

impl RgbAdjointKernels {
    /// Compiles those of a rasterizer's falloff.
    ///
    /// # Panics
    /// Of an antialiased rasterizer: nothing needs its adjoint.
    pub fn new(raster: &Raster) -> Self {
        let options = raster.options();
        assert!(!options.antialiased, "no adjoint");
        let (gpu, cutoff) = (&raster.gpu, raster.numerics.alpha_cutoff());
        let [blend, sum, shade, project] = match options.falloff {
            Falloff::Gaussian => [
                variant(
                    gpu,
                    [
                        shaders::BLEND_BACKWARD_RGB,
                        shaders::BLEND_BACKWARD_RGB_SIMD,
                    ],
                ),
                shaders::SUM_INSTANCES_RGB,
                shaders::SHADE_BACKWARD_RGB_STEP,
                shaders::PROJECT_BACKWARD_RGB_STEP,
            ],
            Falloff::PlayCanvas => [
                variant(
                    gpu,
                    [
                        shaders::BLEND_BACKWARD_RGB_PLAYCANVAS,
                        shaders::BLEND_BACKWARD_RGB_PLAYCANVAS_SIMD,
                    ],
                ),
                shaders::SUM_INSTANCES_RGB_PLAYCANVAS,
                shaders::SHADE_BACKWARD_RGB_STEP_PLAYCANVAS,
                shaders::PROJECT_BACKWARD_RGB_STEP_PLAYCANVAS,
            ],
        };
        Self {
            blend: Kernel::with(gpu, "blend_backward", blend, &cutoff),
            sum: Kernel::with(gpu, "sum_instances", sum, &cutoff),
            shade: Kernel::new(gpu, "shade_backward", shade),
            project: Kernel::new(gpu, "project_backward", project),
        }
    }
}

/// From the gradient of an RGB picture to a step of Adam along that of every parameter. The
/// constant harmonics stay between black and white, which most viewers' bytes end at.
pub struct RgbAdjoint {
    /// Gradient of the loss with respect to the picture, `[pixels, 4]`, of which the first
    /// three count; the loss writes it.
    pub image_gradient: Buffer<f32>,
    blend: BlendAdjoint,
    shade: Bindings,
    project: Bindings,
}

impl RgbAdjoint {
    /// The adjoint of `layer`, which draws `field` by the kernels' falloff.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        raster: &Raster,
        kernels: &RgbAdjointKernels,
        [geometry, field]: [StepBuffers<'_>; 2],
        (splats, harmonics): (&Geometry, &Field),
        lists: &Lists,
        layer: &Layer,
    ) -> Result<Self, GpuError> {
        let (gpu, n) = (&raster.gpu, splats.count);
        let image_gradient = Buffer::zeros(gpu, "image gradient", layer.image.len())?;
        let scratch = AdjointScratch::new(gpu, [FIGURES; 2], n, lists.capacity)?;
        let mean_gradient = Buffer::<f32>::zeros(gpu, "gradient of means", 3 * n)?;
        // The kernels count; nothing here asks.
        let statistics = Buffer::<f32>::zeros(gpu, "statistics", STATISTICS_PLANES * n)?;
        let shade = kernels.shade.bind_at(
            gpu,
            &[
                (0, lists.view.raw()),
                (1, splats.planes.raw()),
                (2, lists.ranks.raw()),
                (3, layer.colors.raw()),
                (4, scratch.gradients.raw()),
                (6, harmonics.planes.raw()),
                (7, mean_gradient.raw()),
                (8, lists.status.raw()),
                (9, field.parameters.raw()),
                (10, field.moments.first.raw()),
                (11, field.moments.second.raw()),
            ],
        );
        let project = kernels.project.bind_at(
            gpu,
            &[
                (0, lists.view.raw()),
                (1, splats.planes.raw()),
                (2, lists.ranks.raw()),
                (3, lists.projected.raw()),
                (4, scratch.gradients.raw()),
                (6, statistics.raw()),
                (7, mean_gradient.raw()),
                (8, lists.status.raw()),
                (9, geometry.parameters.raw()),
                (10, geometry.moments.first.raw()),
                (11, geometry.moments.second.raw()),
            ],
        );
        Ok(Self {
            blend: BlendAdjoint::new(
                gpu,
                [&kernels.blend, &kernels.sum],
                splats,
                lists,
                layer,
                &image_gradient,
                scratch,
            ),
            shade,
            project,
            image_gradient,
        })
    }

    /// Records the adjoint; lists, layer and loss must have been recorded before.
    pub fn record(&self, kernels: &RgbAdjointKernels, recorder: &mut Recorder) {
        let groups = groups_for(self.blend.count);
        self.blend.record([&kernels.blend, &kernels.sum], recorder);
        recorder.dispatch(&kernels.shade, &self.shade, groups);
        recorder.dispatch(&kernels.project, &self.project, groups);
    }
}
