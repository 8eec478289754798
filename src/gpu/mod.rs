//! The device: adapter, typed buffers, kernels, command recording, read-back.

mod buffer;
mod device;
mod kernel;
pub mod shaders;
mod stopwatch;

pub use buffer::{Buffer, Readback};
pub use device::{Gpu, GpuError, STORAGE_BUFFERS};
pub use kernel::{Bindings, Kernel, Recorder, groups_for};
pub use stopwatch::KernelTime;
