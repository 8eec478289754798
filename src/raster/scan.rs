//! Exclusive prefix sums (`shaders/scan.wgsl`).

use bytemuck::{Pod, Zeroable};

use crate::gpu::{Bindings, Buffer, Gpu, GpuError, Kernel, Recorder, shaders};

/// Elements that one workgroup scans.
const BLOCK: usize = 1024;

/// Twin of `struct ScanParameters`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct ScanParameters {
    /// Elements to scan.
    pub length: u32,
    /// Status word for the total, `u32::MAX` for none.
    pub total_word: u32,
    /// Largest total that fits.
    pub limit: u32,
}

/// The three entry points.
#[derive(Clone)]
pub struct ScanKernels {
    reduce: Kernel,
    sums: Kernel,
    apply: Kernel,
}

impl ScanKernels {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let kernel = |name| Kernel::new(gpu, name, shaders::SCAN);
        Self {
            reduce: kernel("scan_reduce"),
            sums: kernel("scan_sums"),
            apply: kernel("scan_apply"),
        }
    }
}

/// A scan tied to its buffer.
pub struct Scan {
    reduce: Bindings,
    sums: Bindings,
    apply: Bindings,
    blocks: u32,
}

impl Scan {
    /// Scans `values` in place; the total goes to `total_word` of `status`.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        gpu: &Gpu,
        kernels: &ScanKernels,
        values: &Buffer<u32>,
        status: &Buffer<u32>,
        total_word: Option<usize>,
        limit: usize,
    ) -> Result<Self, GpuError> {
        let parameters = Buffer::uniform(
            gpu,
            "scan parameters",
            &ScanParameters {
                length: values.len() as u32,
                total_word: total_word.map_or(u32::MAX, |word| word as u32),
                limit: u32::try_from(limit).unwrap_or(u32::MAX),
            },
        )?;
        let blocks = values.len().div_ceil(BLOCK);
        let block_sums = Buffer::<u32>::zeros(gpu, "scan block sums", blocks)?;
        let [p, v, b, s] = [
            parameters.raw(),
            values.raw(),
            block_sums.raw(),
            status.raw(),
        ];
        Ok(Self {
            reduce: kernels.reduce.bind(gpu, &[p, v, b]),
            sums: kernels.sums.bind_at(gpu, &[(0, p), (2, b), (3, s)]),
            apply: kernels.apply.bind(gpu, &[p, v, b]),
            blocks: blocks as u32,
        })
    }

    /// Records the scan.
    pub fn record(&self, kernels: &ScanKernels, recorder: &mut Recorder) {
        recorder.dispatch(&kernels.reduce, &self.reduce, self.blocks);
        recorder.dispatch(&kernels.sums, &self.sums, 1);
        recorder.dispatch(&kernels.apply, &self.apply, self.blocks);
    }
}
