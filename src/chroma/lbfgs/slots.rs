//! Buffers of `shaders/lbfgs.wgsl` by their binding numbers.

use crate::gpu::{Bindings, Buffer, Gpu, Kernel};

/// An entry point and its buffers.
pub struct Bound(pub Kernel, pub Bindings);

// Binding numbers of `shaders/lbfgs.wgsl`.
pub const PARAMETERS: u32 = 0;
pub const PAIR: u32 = 1;
pub const UNKNOWNS: u32 = 2;
pub const GRADIENT: u32 = 3;
pub const DIAGONAL: u32 = 4;
pub const FLOORS: u32 = 5;
pub const LOSSES: u32 = 6;
pub const ACCEPTED_UNKNOWNS: u32 = 7;
pub const ACCEPTED_GRADIENT: u32 = 8;
pub const INVERSE: u32 = 9;
pub const DIRECTION: u32 = 10;
pub const DISPLACEMENT: u32 = 11;
pub const CHANGE: u32 = 12;
pub const SUMS: u32 = 13;
pub const SCALARS: u32 = 14;
pub const LEFT: u32 = 15;
pub const RIGHT: u32 = 16;
pub const ANCHORS: u32 = 17;
pub const PULLS: u32 = 18;

/// Buffers by binding number, of which each entry point takes some.
#[derive(Clone)]
pub struct Slots<'a> {
    pub gpu: &'a Gpu,
    buffers: [&'a wgpu::Buffer; 19],
}

impl<'a> Slots<'a> {
    /// The parameters alone: in the other slots, too, where wgpu refuses them as no storage.
    pub fn new(gpu: &'a Gpu, parameters: &'a wgpu::Buffer) -> Self {
        Self {
            gpu,
            buffers: [parameters; 19],
        }
    }

    /// The same with more buffers.
    pub fn with<const N: usize>(&self, more: [(u32, &'a Buffer<f32>); N]) -> Self {
        let put =
            |slots: Self, (slot, buffer): (u32, &'a Buffer<f32>)| slots.put(slot, buffer.raw());
        more.into_iter().fold(self.clone(), put)
    }

    /// The same with another buffer in `slot`.
    pub fn put(&self, slot: u32, buffer: &'a wgpu::Buffer) -> Self {
        let mut slots = self.clone();
        slots.buffers[slot as usize] = buffer;
        slots
    }

    /// The same with the buffer of `from` in `slot`, too.
    pub fn copy(&self, slot: u32, from: u32) -> Self {
        self.put(slot, self.buffers[from as usize])
    }

    /// Ties an entry point to the parameters and the buffers in `used`.
    pub fn bind(&self, kernel: &Kernel, used: &[u32]) -> Bound {
        let used = [PARAMETERS].iter().chain(used);
        let buffers: Vec<_> = used
            .map(|&slot| (slot, self.buffers[slot as usize]))
            .collect();
        Bound(kernel.clone(), kernel.bind_at(self.gpu, &buffers))
    }
}
