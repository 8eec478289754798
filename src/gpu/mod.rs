//! The device: adapter, typed buffers, kernels, command recording, read-back.

mod buffer;
mod device;
mod error;
mod kernel;
mod pipeline;
mod readback;
pub mod shaders;
mod stopwatch;
mod tape;

pub use buffer::{Buffer, Readback};
pub use device::{Gpu, STORAGE_BUFFERS, WORKGROUP_BYTES, WORKGROUP_THREADS, default_tiles_at_once};
pub use error::GpuError;
pub use kernel::{Bindings, LINEAR_WORKGROUP, MAX_GROUPS, Recorder, folded, groups_for};
pub use pipeline::Kernel;
pub use stopwatch::KernelTime;
pub use tape::{Dispatch, Step, Tape};
