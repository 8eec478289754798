//! Hard cases: the kernels on scenes at which rasterizers break, and whether
//! anyone would notice if they did.

mod architecture;
mod broken_kernels;
mod cases;
mod poison;
mod poison_capture;
mod shader_lint;
mod training;

use std::sync::LazyLock;

use gs_chroma::gpu::Gpu;

static GPU: LazyLock<Gpu> = LazyLock::new(|| Gpu::open().unwrap_or_else(|error| panic!("{error}")));

/// The device that all tests share.
fn gpu() -> &'static Gpu {
    &GPU
}
