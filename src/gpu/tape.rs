//! Recording of a device's commands for replay on another: WebGPU in a browser, say, whose answers
//! [`Gpu::answering`](super::Gpu::answering) then returns instead of the device's own.

use std::{
    collections::{HashMap, VecDeque},
    sync::Mutex,
};

use serde::Serialize;

use super::pipeline::Kernel;

/// One command of a device. Buffers and kernels are numbered from 0 in the order in which they are
/// made.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "do", rename_all = "snake_case")]
pub enum Step {
    /// Make a buffer of zeros.
    Buffer {
        /// Bytes.
        size: u64,
        /// True for a uniform buffer, false for storage.
        uniform: bool,
    },
    /// Write a span of [`Tape::bytes`] into a buffer.
    Write {
        /// The buffer.
        buffer: usize,
        /// Offset in the buffer, in bytes.
        offset: u64,
        /// Offset on the tape, in bytes.
        at: usize,
        /// Bytes.
        size: usize,
    },
    /// Compile an entry point.
    Kernel {
        /// Its name.
        name: &'static str,
        /// WGSL.
        source: &'static str,
        /// Values of overridable constants.
        constants: Vec<(String, f64)>,
    },
    /// Run a grid of workgroups.
    Dispatch {
        /// Kernel and its buffers.
        #[serde(flatten)]
        ran: Dispatch,
        /// Workgroups along x and y.
        groups: [u32; 2],
    },
    /// Run as many workgroups as a buffer says.
    DispatchIndirect {
        /// Kernel and its buffers.
        #[serde(flatten)]
        ran: Dispatch,
        /// The buffer.
        counts: usize,
        /// Offset in the buffer, in bytes.
        offset: u64,
    },
    /// Copy the front of a buffer to the front of another.
    Copy {
        /// The one.
        from: usize,
        /// The other.
        to: usize,
        /// Bytes.
        size: u64,
    },
    /// Fill a buffer with zeros.
    Clear {
        /// The buffer.
        buffer: usize,
    },
    /// Answer with what a buffer holds.
    Read {
        /// The buffer.
        buffer: usize,
        /// Bytes.
        size: u64,
    },
}

/// A kernel and its buffers.
#[derive(Clone, Debug, Serialize)]
pub struct Dispatch {
    /// The kernel.
    pub kernel: usize,
    /// Bindings of group 0 and their buffers.
    pub bindings: Vec<(u32, usize)>,
}

/// A recording, in order.
#[derive(Debug, Default)]
pub struct Tape {
    /// Recorded commands.
    pub steps: Vec<Step>,
    /// Bytes written into buffers, one after the other.
    pub bytes: Vec<u8>,
    buffers: HashMap<wgpu::Buffer, usize>,
    kernels: HashMap<wgpu::ComputePipeline, usize>,
}

impl Tape {
    pub(super) fn made(&mut self, buffer: &wgpu::Buffer) {
        let uniform = buffer.usage().contains(wgpu::BufferUsages::UNIFORM);
        let size = buffer.size();
        self.buffers.insert(buffer.clone(), self.buffers.len());
        self.steps.push(Step::Buffer { size, uniform });
    }

    pub(super) fn wrote(&mut self, buffer: &wgpu::Buffer, offset: u64, bytes: &[u8]) {
        let (at, size) = (self.bytes.len(), bytes.len());
        self.bytes.extend(bytes);
        let buffer = self.number(buffer);
        self.steps.push(Step::Write {
            buffer,
            offset,
            at,
            size,
        });
    }

    pub(super) fn read(&mut self, buffer: &wgpu::Buffer) {
        let (size, buffer) = (buffer.size(), self.number(buffer));
        self.steps.push(Step::Read { buffer, size });
    }

    /// Records a dispatch's kernel; the step is to be [`Self::submitted`] with those beside it.
    pub(super) fn ran(&mut self, kernel: &Kernel, buffers: &[(u32, wgpu::Buffer)]) -> Dispatch {
        let next = self.kernels.len();
        let kernel = match self.kernels.get(&kernel.pipeline) {
            Some(&known) => known,
            None => {
                self.kernels.insert(kernel.pipeline.clone(), next);
                self.steps.push(Step::Kernel {
                    name: kernel.name,
                    source: kernel.source,
                    constants: kernel.constants.clone(),
                });
                next
            }
        };
        let bindings = (buffers.iter()).map(|(binding, buffer)| (*binding, self.number(buffer)));
        Dispatch {
            kernel,
            bindings: bindings.collect(),
        }
    }

    pub(super) fn copy(&self, from: &wgpu::Buffer, to: &wgpu::Buffer, size: u64) -> Step {
        let (from, to) = (self.number(from), self.number(to));
        Step::Copy { from, to, size }
    }

    pub(super) fn clear(&self, buffer: &wgpu::Buffer) -> Step {
        let buffer = self.number(buffer);
        Step::Clear { buffer }
    }

    pub(super) fn submitted(&mut self, recorded: Vec<Step>) {
        self.steps.extend(recorded);
    }

    pub(super) fn number(&self, buffer: &wgpu::Buffer) -> usize {
        // A buffer made before the tape began would be missing; none of a taped device is.
        self.buffers[buffer]
    }
}

/// Mode of a device with a tape: recording commands, or answering instead of its device.
#[derive(Debug)]
pub(super) enum TapeMode {
    Recording(Mutex<Tape>),
    Answering(Mutex<VecDeque<Vec<u8>>>),
}
