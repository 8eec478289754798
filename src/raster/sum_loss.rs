//! Losses of the last iterations, kept on the device (`shaders/sum_loss.wgsl`).

use bytemuck::{Pod, Zeroable};

use crate::gpu::{Bindings, Buffer, Gpu, GpuError, Kernel, Readback, Recorder, shaders};

/// Twin of `struct SumLossParameters`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct SumLossParameters {
    /// Block losses to add.
    pub blocks: u32,
    /// Pixels to divide by.
    pub pixels: u32,
    /// Entry of the ring for the mean.
    pub entry: u32,
}

/// The compiled `sum_loss` kernel.
pub struct SumLossKernel(Kernel);

impl SumLossKernel {
    /// Compiles the kernel for a device.
    pub fn new(gpu: &Gpu) -> Self {
        Self(Kernel::new(gpu, "sum_loss", shaders::SUM_LOSS))
    }
}

/// A ring of losses.
pub struct LossLog {
    /// Sum of each workgroup of a loss kernel.
    pub block_losses: Buffer<f32>,
    /// The ring; iteration `i` stands at `i % len`.
    pub losses: Buffer<f32>,
    parameters: Buffer<SumLossParameters>,
    bindings: Bindings,
}

impl LossLog {
    /// A log of `entries` losses of at most `max_blocks` blocks each.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        gpu: &Gpu,
        kernel: &SumLossKernel,
        status: &Buffer<u32>,
        max_blocks: usize,
        entries: usize,
    ) -> Result<Self, GpuError> {
        let block_losses = Buffer::zeros(gpu, "block losses", max_blocks)?;
        let losses = Buffer::zeros(gpu, "losses", entries)?;
        let parameters = Buffer::uniform(gpu, "sum loss parameters", &SumLossParameters::zeroed())?;
        let bindings = kernel.0.bind(
            gpu,
            &[
                parameters.raw(),
                block_losses.raw(),
                losses.raw(),
                status.raw(),
            ],
        );
        Ok(Self {
            block_losses,
            losses,
            parameters,
            bindings,
        })
    }

    /// Records the sum of `blocks` block losses as the mean over `pixels`.
    pub fn record(
        &self,
        gpu: &Gpu,
        kernel: &SumLossKernel,
        recorder: &mut Recorder,
        blocks: u32,
        pixels: usize,
        iteration: usize,
    ) {
        self.parameters.write(
            gpu,
            &[SumLossParameters {
                blocks,
                pixels: pixels as u32,
                entry: (iteration % self.losses.len()) as u32,
            }],
        );
        recorder.dispatch(&kernel.0, &self.bindings, 1);
    }

    /// Orders the ring; iteration `i` stands at `i % entries`.
    pub fn read_later(&self, gpu: &Gpu) -> Readback<f32> {
        self.losses.read_later(gpu)
    }
}
