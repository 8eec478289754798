//! The kernels of stage 2, compiled once for all that is solved.

use super::{correction::CorrectionKernels, lbfgs::LbfgsKernels};
use crate::{
    gpu::{Gpu, Kernel, shaders},
    raster::{AdamKernel, SumLossKernel},
};

/// The compiled kernels.
pub struct ChromaKernels {
    pub(super) chroma_loss: Kernel,
    /// With the agreement with a coarser scale.
    pub(super) agreeing_loss: Kernel,
    pub(super) rgb_loss: Kernel,
    pub(super) lab_loss: Kernel,
    /// The same with the agreement with a coarser scale.
    pub(super) agreeing_lab_loss: Kernel,
    pub(super) sum_loss: SumLossKernel,
    pub(super) correction: CorrectionKernels,
    pub(super) lbfgs: LbfgsKernels,
    pub(super) adam: AdamKernel,
}

impl ChromaKernels {
    /// Compiles them.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            chroma_loss: Kernel::new(gpu, "chroma_loss", shaders::CHROMA_LOSS),
            agreeing_loss: Kernel::new(gpu, "chroma_loss", shaders::CHROMA_LOSS_AGREEING),
            rgb_loss: Kernel::new(gpu, "rgb_loss", shaders::RGB_LOSS),
            lab_loss: Kernel::new(gpu, "lab_loss", shaders::LAB_LOSS),
            agreeing_lab_loss: Kernel::new(gpu, "lab_loss", shaders::LAB_LOSS_AGREEING),
            sum_loss: SumLossKernel::new(gpu),
            correction: CorrectionKernels::new(gpu),
            lbfgs: LbfgsKernels::new(gpu),
            adam: AdamKernel::new(gpu),
        }
    }
}
