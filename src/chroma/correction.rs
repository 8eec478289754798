//! What brings each view's teacher into line with the others
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

/// Finds the corrections of all views.
pub struct Corrections {
    /// One for each view; they change nothing until the first are found.
    pub corrections: Buffer<Correction>,
    view_sums: Buffer<f32>,
    sums: Kernel,
    solve: Kernel,
    solve_bindings: Bindings,
    views: usize,
}

impl Corrections {
    /// For so many views.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(gpu: &Gpu, views: usize) -> Result<Self, GpuError> {
        let corrections =
            Buffer::from_slice(gpu, "view corrections", &vec![Correction::NONE; views])?;
        let view_sums = Buffer::zeros(gpu, "view sums", views * SUM_GROUPS * SUMS)?;
        let kernel = |name| Kernel::new(gpu, name, shaders::VIEW_CORRECTION);
        let [sums, solve] = [kernel("view_correction_sums"), kernel("view_correction")];
        let parameters = Self::parameters(gpu, views, 0, false)?;
        let solve_bindings = solve.bind_at(
            gpu,
            &[
                (4, parameters.raw()),
                (5, view_sums.raw()),
                (6, corrections.raw()),
            ],
        );
        Ok(Self {
            corrections,
            view_sums,
            sums,
            solve,
            solve_bindings,
            views,
        })
    }

    fn parameters(
        gpu: &Gpu,
        views: usize,
        view_index: usize,
        weighted: bool,
    ) -> Result<Buffer<CorrectionParameters>, GpuError> {
        Buffer::uniform(
            gpu,
            "correction parameters",
            &CorrectionParameters {
                views: views as u32,
                view_index: view_index as u32,
                weighted: u32::from(weighted),
                padding: 0,
            },
        )
    }

    /// Ties one view's picture, wanted a/b, curvature and, where there are any, weights
    /// of the pixels.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn bind(
        &self,
        gpu: &Gpu,
        view_index: usize,
        [view, image, wanted, curvatures]: [&wgpu::Buffer; 4],
        weights: (&Buffer<f32>, bool),
    ) -> Result<Bindings, GpuError> {
        let parameters = Self::parameters(gpu, self.views, view_index, weights.1)?;
        Ok(self.sums.bind_at(
            gpu,
            &[
                (0, view),
                (1, image),
                (2, wanted),
                (3, curvatures),
                (4, parameters.raw()),
                (5, self.view_sums.raw()),
                (7, weights.0.raw()),
            ],
        ))
    }

    /// Records one view's sums.
    pub fn sum(&self, bindings: &Bindings, recorder: &mut Recorder) {
        recorder.dispatch(&self.sums, bindings, SUM_GROUPS as u32);
    }

    /// Records the corrections that follow from all views' sums.
    pub fn solve(&self, recorder: &mut Recorder) {
        recorder.dispatch(&self.solve, &self.solve_bindings, 1);
    }
}
