//! Gain and offset that bring each view's teacher into line with the others
//! (`shaders/view_correction.wgsl`).

use bytemuck::{Pod, Zeroable};

use super::loss::Correction;
use crate::gpu::{Bindings, Buffer, Gpu, GpuError, Kernel, Recorder, shaders};

/// Workgroups that sum one view.
pub const SUM_GROUPS: usize = 64;

/// Sums of one workgroup.
pub const SUMS: usize = 12;

/// Twin of `struct CorrectionParameters`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct CorrectionParameters {
    /// Views in all.
    pub views: u32,
    /// The view whose sums are taken.
    pub view_index: u32,
    /// 1 where each pixel has a weight.
    pub weighted: u32,
    /// Unused; keeps the size a multiple of 16.
    pub padding: u32,
}

/// The compiled kernels of view corrections.
pub struct CorrectionKernels {
    sums: Kernel,
    solve: Kernel,
}

impl CorrectionKernels {
    /// Compiles them.
    pub fn new(gpu: &Gpu) -> Self {
        let kernel = |name| Kernel::new(gpu, name, shaders::VIEW_CORRECTION);
        Self {
            sums: kernel("view_correction_sums"),
            solve: kernel("view_correction"),
        }
    }
}

/// Finds the corrections of all views.
pub struct Corrections {
    /// One for each view; they change nothing until the first are found.
    pub corrections: Buffer<Correction>,
    /// Those before the last.
    before: Buffer<Correction>,
    view_sums: Buffer<f32>,
    solve: Bindings,
    views: usize,
}

impl Corrections {
    /// Bytes for so many views.
    pub fn bytes(views: usize) -> u64 {
        (4 * views * SUM_GROUPS * SUMS + 2 * views * size_of::<Correction>()) as u64
    }

    /// For so many views.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(gpu: &Gpu, kernels: &CorrectionKernels, views: usize) -> Result<Self, GpuError> {
        let none = || Buffer::from_slice(gpu, "view corrections", &vec![Correction::NONE; views]);
        let (corrections, before) = (none()?, none()?);
        let view_sums = Buffer::zeros(gpu, "view sums", views * SUM_GROUPS * SUMS)?;
        let parameters = CorrectionParameters::of(views, 0, false);
        let parameters = Buffer::uniform(gpu, "correction parameters", &parameters)?;
        let solve = kernels.solve.bind_at(
            gpu,
            &[
                (4, parameters.raw()),
                (5, view_sums.raw()),
                (6, corrections.raw()),
            ],
        );
        Ok(Self {
            corrections,
            before,
            view_sums,
            solve,
            views,
        })
    }

    /// Parameters that tell [`Corrections::sum`] its view.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn parameters(
        &self,
        gpu: &Gpu,
        view_index: usize,
        weighted: bool,
    ) -> Result<Buffer<CorrectionParameters>, GpuError> {
        let parameters = CorrectionParameters::of(self.views, view_index, weighted);
        Buffer::uniform(gpu, "correction parameters", &parameters)
    }

    /// Chooses another view for what is submitted next.
    pub fn choose(
        &self,
        gpu: &Gpu,
        parameters: &Buffer<CorrectionParameters>,
        view_index: usize,
        weighted: bool,
    ) {
        let chosen = CorrectionParameters::of(self.views, view_index, weighted);
        parameters.write(gpu, &[chosen]);
    }

    /// Ties view, picture and wanted a/b, what `chroma_loss` left, and the weights of the
    /// pixels.
    pub fn bind(
        &self,
        gpu: &Gpu,
        kernels: &CorrectionKernels,
        parameters: &Buffer<CorrectionParameters>,
        ([view, image, wanted], image_gradient, weights): (
            [&wgpu::Buffer; 3],
            &Buffer<f32>,
            &Buffer<f32>,
        ),
    ) -> Bindings {
        kernels.sums.bind_at(
            gpu,
            &[
                (0, view),
                (1, image),
                (2, wanted),
                (3, image_gradient.raw()),
                (4, parameters.raw()),
                (5, self.view_sums.raw()),
                (7, weights.raw()),
            ],
        )
    }

    /// Records one view's sums.
    pub fn sum(&self, kernels: &CorrectionKernels, bindings: &Bindings, recorder: &mut Recorder) {
        recorder.dispatch(&kernels.sums, bindings, SUM_GROUPS as u32);
    }

    /// Records the corrections that follow from all views' sums.
    pub fn solve(&self, kernels: &CorrectionKernels, recorder: &mut Recorder) {
        recorder.copy(self.corrections.raw(), self.before.raw());
        recorder.dispatch(&kernels.solve, &self.solve, 1);
    }

    /// Buffers that the next round goes by, by name.
    pub(super) fn kept(&self) -> [(&'static str, &Buffer<Correction>); 2] {
        [
            ("corrections", &self.corrections),
            ("corrections before", &self.before),
        ]
    }

    /// Records the return to those before the last.
    pub fn undo(&self, recorder: &mut Recorder) {
        recorder.copy(self.before.raw(), self.corrections.raw());
    }
}

impl CorrectionParameters {
    fn of(views: usize, view_index: usize, weighted: bool) -> Self {
        Self {
            views: views as u32,
            view_index: view_index as u32,
            weighted: u32::from(weighted),
            padding: 0,
        }
    }
}
