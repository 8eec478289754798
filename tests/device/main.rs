//! Everything that needs a device: each kernel against the `f64` oracle, the scenes at which
//! rasterizers break, and other adapters and languages. A Vulkan, Metal or DirectX 12 adapter is
//! needed; a software one will do.

mod kernels;
mod portable;
mod stability;

use std::sync::LazyLock;

use gs_chroma::gpu::Gpu;

static GPU: LazyLock<Gpu> = LazyLock::new(|| Gpu::open().unwrap_or_else(|error| panic!("{error}")));

/// The device that all tests share; a lost one fails the test.
fn gpu() -> &'static Gpu {
    &GPU
}
