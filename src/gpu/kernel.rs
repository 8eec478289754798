//! Kernels with their buffers, and the recording of dispatches.

use std::time::Instant;

use super::{device::Gpu, pipeline::Kernel, stopwatch::Timing, tape::Step};

/// Threads in a workgroup of the kernels that give a thread to each element.
pub const LINEAR_WORKGROUP: u32 = 256;

/// WebGPU's limit on workgroups in one dimension; `shaders/common/numeric.wgsl` has it too.
pub const MAX_GROUPS: u32 = 65_535;

/// Workgroups that cover `elements` at one thread each.
pub fn groups_for(elements: usize) -> u32 {
    u32::try_from(elements.div_ceil(LINEAR_WORKGROUP as usize)).unwrap_or(u32::MAX)
}

/// So many workgroups in rows of at most [`MAX_GROUPS`].
pub fn folded(groups: u32) -> [u32; 2] {
    [groups.min(MAX_GROUPS), groups.div_ceil(MAX_GROUPS)]
}

/// Number of workgroups.
#[derive(Clone, Copy)]
enum Groups<'a> {
    /// A grid.
    Grid([u32; 2]),
    /// Counts in a buffer, at a byte offset.
    Indirect(&'a wgpu::Buffer, u64),
}

impl Kernel {
    /// Compiles the entry point `name` of `source`, unless the device has it already. All
    /// bindings are in group 0.
    pub fn new(gpu: &Gpu, name: &'static str, source: &'static str) -> Self {
        Self::with(gpu, name, source, &[])
    }

    /// The same with values for the overridable constants that `source` declares.
    pub fn with(
        gpu: &Gpu,
        name: &'static str,
        source: &'static str,
        constants: &[(&str, f64)],
    ) -> Self {
        if let Some(broken) = gpu.broken(name, source) {
            return Self::compile(gpu.device(), name, source, Some(broken), constants);
        }
        let bits = constants.iter();
        let bits = bits.map(|&(name, value)| (name.to_owned(), value.to_bits()));
        let recipe = (name, source, bits.collect());
        if let Some(kernel) = gpu.kernels().get(&recipe) {
            return kernel.clone();
        }
        let kernel = Self::compile(gpu.device(), name, source, None, constants);
        gpu.kernels().insert(recipe, kernel.clone());
        kernel
    }

    /// Ties buffers to bindings 0, 1, 2 …
    pub fn bind(&self, gpu: &Gpu, buffers: &[&wgpu::Buffer]) -> Bindings {
        let numbered: Vec<_> = (0..).zip(buffers.iter().copied()).collect();
        self.bind_at(gpu, &numbered)
    }

    /// Ties buffers to the bindings named beside them, for an entry point that
    /// does not use all that its file declares.
    pub fn bind_at(&self, gpu: &Gpu, buffers: &[(u32, &wgpu::Buffer)]) -> Bindings {
        let entries: Vec<_> = buffers
            .iter()
            .map(|&(binding, buffer)| wgpu::BindGroupEntry {
                binding,
                resource: buffer.as_entire_binding(),
            })
            .collect();
        let group = gpu.device().create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some(self.name),
            layout: &self.layout,
            entries: &entries,
        });
        let numbered = buffers.iter();
        let numbered = numbered.map(|&(binding, buffer)| (binding, buffer.clone()));
        Bindings {
            group,
            buffers: match gpu.tape() {
                Some(_) => numbered.collect(),
                None => Vec::new(),
            },
        }
    }
}

/// The buffers of one kernel.
pub struct Bindings {
    group: wgpu::BindGroup,
    /// Their bindings and they themselves, for the tape.
    buffers: Vec<(u32, wgpu::Buffer)>,
}

/// Records dispatches into one compute pass; wgpu orders those that share buffers.
pub struct Recorder {
    gpu: Gpu,
    encoder: wgpu::CommandEncoder,
    pass: Option<wgpu::ComputePass<'static>>,
    /// The same for the tape, which gets it when it is submitted.
    noted: Vec<Step>,
}

impl Recorder {
    /// An empty recording.
    pub fn new(gpu: &Gpu) -> Self {
        Self {
            gpu: gpu.clone(),
            encoder: gpu.device().create_command_encoder(&Default::default()),
            pass: None,
            noted: Vec::new(),
        }
    }

    /// Runs `groups` workgroups, folded into two dimensions where one is too
    /// short; kernels see the linear number and check it against their length.
    pub fn dispatch(&mut self, kernel: &Kernel, bindings: &Bindings, groups: u32) {
        if groups > 0 {
            self.run(kernel, bindings, Groups::Grid(folded(groups)));
        }
    }

    /// Runs a grid of workgroups.
    pub fn dispatch_grid(&mut self, kernel: &Kernel, bindings: &Bindings, x: u32, y: u32) {
        self.run(kernel, bindings, Groups::Grid([x, y]));
    }

    /// Runs as many workgroups as stand in `counts` from `offset` bytes on: three words, [`folded`]
    /// and 1. The kernel may read `counts`, but not write them.
    pub fn dispatch_indirect(
        &mut self,
        kernel: &Kernel,
        bindings: &Bindings,
        counts: &wgpu::Buffer,
        offset: u64,
    ) {
        self.run(kernel, bindings, Groups::Indirect(counts, offset));
    }

    fn run(&mut self, kernel: &Kernel, bindings: &Bindings, groups: Groups<'_>) {
        let timing = match self.gpu.stopwatch() {
            Some(mut stopwatch) => stopwatch.claim(kernel.name),
            None => Timing::None,
        };
        match timing {
            Timing::None => self.record(kernel, bindings, groups),
            Timing::Device(queries, first) => {
                self.pass = Some(self.begin(Some(wgpu::ComputePassTimestampWrites {
                    query_set: &queries,
                    beginning_of_pass_write_index: Some(first),
                    end_of_pass_write_index: Some(first + 1),
                })));
                self.record(kernel, bindings, groups);
                self.pass = None;
            }
            Timing::Host => {
                self.flush();
                // A lost device shows at the next read-back.
                let _ = self.gpu.wait();
                let begun = Instant::now();
                self.record(kernel, bindings, groups);
                self.flush();
                let _ = self.gpu.wait();
                if let Some(mut stopwatch) = self.gpu.stopwatch() {
                    stopwatch.add(kernel.name, begun.elapsed().as_secs_f64());
                }
            }
        }
    }

    fn begin(
        &mut self,
        timestamp_writes: Option<wgpu::ComputePassTimestampWrites<'_>>,
    ) -> wgpu::ComputePass<'static> {
        self.pass = None;
        self.encoder
            .begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: None,
                timestamp_writes,
            })
            .forget_lifetime()
    }

    fn record(&mut self, kernel: &Kernel, bindings: &Bindings, groups: Groups<'_>) {
        if let Some(mut tape) = self.gpu.tape() {
            let ran = tape.ran(kernel, &bindings.buffers);
            self.noted.push(match groups {
                Groups::Grid(groups) => Step::Dispatch { ran, groups },
                Groups::Indirect(counts, offset) => Step::DispatchIndirect {
                    ran,
                    counts: tape.number(counts),
                    offset,
                },
            });
        }
        let mut pass = match self.pass.take() {
            Some(pass) => pass,
            None => self.begin(None),
        };
        pass.set_pipeline(&kernel.pipeline);
        pass.set_bind_group(0, &bindings.group, &[]);
        match groups {
            Groups::Grid([x, y]) => pass.dispatch_workgroups(x, y, 1),
            Groups::Indirect(counts, offset) => pass.dispatch_workgroups_indirect(counts, offset),
        }
        self.pass = Some(pass);
    }

    /// Copies a whole buffer onto another of the same size.
    pub fn copy(&mut self, from: &wgpu::Buffer, to: &wgpu::Buffer) {
        let size = from.size();
        self.pass = None;
        self.encoder.copy_buffer_to_buffer(from, 0, to, 0, size);
        if let Some(tape) = self.gpu.tape() {
            self.noted.push(tape.copy(from, to, size));
        }
    }

    /// Fills a buffer with zeros.
    pub fn clear(&mut self, buffer: &wgpu::Buffer) {
        self.pass = None;
        self.encoder.clear_buffer(buffer, 0, None);
        if let Some(tape) = self.gpu.tape() {
            self.noted.push(tape.clear(buffer));
        }
    }

    /// Hands the recording to the device.
    pub fn submit(mut self) {
        self.pass = None;
        if self.gpu.answers() {
            return;
        }
        self.gpu.queue().submit([self.encoder.finish()]);
        if let Some(mut tape) = self.gpu.tape() {
            tape.submitted(self.noted);
        }
        if let Some(mut stopwatch) = self.gpu.stopwatch()
            && stopwatch.is_filling()
        {
            stopwatch.read_later(self.gpu.device(), self.gpu.queue());
        }
    }

    /// Hands over what is recorded so far and goes on.
    fn flush(&mut self) {
        self.pass = None;
        let next = self
            .gpu
            .device()
            .create_command_encoder(&Default::default());
        let recorded = std::mem::replace(&mut self.encoder, next);
        self.gpu.queue().submit([recorded.finish()]);
        if let Some(mut tape) = self.gpu.tape() {
            tape.submitted(std::mem::take(&mut self.noted));
        }
    }
}
