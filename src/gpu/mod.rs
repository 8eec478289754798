//! The device: adapter, typed buffers, kernels, command recording, read-back.

mod buffer;
mod device;
mod kernel;
pub mod shaders;
mod stopwatch;
mod tape;

pub use buffer::{Buffer, Readback};
pub use device::{
    Gpu, GpuError, STORAGE_BUFFERS, WORKGROUP_BYTES, WORKGROUP_THREADS, default_tiles_at_once,
};
pub use kernel::{Bindings, Kernel, LINEAR_WORKGROUP, MAX_GROUPS, Recorder, folded, groups_for};
pub use stopwatch::KernelTime;
pub use tape::{Dispatch, Step, Tape};
