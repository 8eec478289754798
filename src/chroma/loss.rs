//! The chroma loss (`shaders/chroma_loss.wgsl`).

use bytemuck::{Pod, Zeroable};

use crate::gpu::{Gpu, Kernel, shaders};

/// Twin of `struct ChromaLossWeights`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct ChromaLossWeights {
    /// Width and height of the coarser image.
    pub coarser_size: [u32; 2],
    /// Weight of the teacher.
    pub teacher: f32,
    /// Weight of the agreement with the coarser image; 0 where there is none.
    pub agreement: f32,
}

/// Compiles the kernel.
pub(super) fn kernel(gpu: &Gpu) -> Kernel {
    Kernel::new(gpu, "chroma_loss", shaders::CHROMA_LOSS)
}
