//! Stable radix sort of 32-bit keys with values (`shaders/sort.wgsl`).

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::scan::{Scan, ScanKernels};
use crate::gpu::{Bindings, Buffer, Gpu, GpuError, Kernel, Recorder, shaders};

/// Keys that one workgroup handles.
const BLOCK: usize = 2048;

/// Bits sorted in one pass.
const DIGIT_BITS: u32 = 8;

/// Twin of `struct SortParameters`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct SortParameters {
    /// Lowest bit of this pass.
    pub shift: u32,
    /// Status word that holds the number of keys.
    pub count_word: u32,
    /// Blocks that the histogram has room for.
    pub blocks: u32,
}

/// The two entry points.
#[derive(Clone)]
pub struct SortKernels {
    count: Kernel,
    scatter: Kernel,
}

impl SortKernels {
    pub(super) fn new(gpu: &Gpu) -> Self {
        Self {
            count: Kernel::new(gpu, "sort_count", shaders::SORT),
            scatter: Kernel::new(gpu, "sort_scatter", shaders::SORT),
        }
    }
}

struct Pass {
    count: Bindings,
    scatter: Bindings,
}

/// A sort tied to its buffers.
pub struct Sort {
    /// Keys to sort, and after an even number of passes the sorted ones.
    pub keys: [Buffer<u32>; 2],
    /// Values that travel with the keys.
    pub values: [Buffer<u32>; 2],
    passes: Vec<Pass>,
    scan: Scan,
    blocks: u32,
}

impl Sort {
    /// Bytes of a sort of so many keys: twice keys and values, and the histograms.
    pub fn bytes(capacity: usize) -> u64 {
        4 * (4 * capacity + 256 * capacity.div_ceil(BLOCK).max(1)) as u64
    }

    /// A sort of at most `capacity` keys by these `bits` of theirs, 0 the lowest; how many
    /// there are stands in `count_word` of `status`.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        gpu: &Gpu,
        kernels: &SortKernels,
        scan_kernels: &ScanKernels,
        status: &Buffer<u32>,
        count_word: usize,
        capacity: usize,
        bits: Range<u32>,
    ) -> Result<Self, GpuError> {
        let buffer = |label| Buffer::<u32>::zeros(gpu, label, capacity);
        let keys = [buffer("sort keys")?, buffer("sort keys, other side")?];
        let values = [buffer("sort values")?, buffer("sort values, other side")?];
        let blocks = capacity.div_ceil(BLOCK).max(1);
        let histogram = Buffer::<u32>::zeros(gpu, "sort histogram", 256 * blocks)?;
        let mut passes = Vec::new();
        let passes_needed = (bits.end - bits.start).div_ceil(DIGIT_BITS).max(1);
        for pass in 0..passes_needed {
            let parameters = Buffer::uniform(
                gpu,
                "sort parameters",
                &SortParameters {
                    shift: bits.start + pass * DIGIT_BITS,
                    count_word: count_word as u32,
                    blocks: blocks as u32,
                },
            )?;
            let (from, to) = ((pass % 2) as usize, ((pass + 1) % 2) as usize);
            let [p, s, h] = [parameters.raw(), status.raw(), histogram.raw()];
            passes.push(Pass {
                count: kernels
                    .count
                    .bind_at(gpu, &[(0, p), (1, s), (2, keys[from].raw()), (4, h)]),
                scatter: kernels.scatter.bind(
                    gpu,
                    &[
                        p,
                        s,
                        keys[from].raw(),
                        values[from].raw(),
                        h,
                        keys[to].raw(),
                        values[to].raw(),
                    ],
                ),
            });
        }
        let scan = Scan::new(gpu, scan_kernels, &histogram, status, None, 0)?;
        Ok(Self {
            keys,
            values,
            passes,
            scan,
            blocks: blocks as u32,
        })
    }

    /// The sorted keys.
    pub fn sorted_keys(&self) -> &Buffer<u32> {
        &self.keys[self.passes.len() % 2]
    }

    /// The values in the order of the sorted keys.
    pub fn sorted_values(&self) -> &Buffer<u32> {
        &self.values[self.passes.len() % 2]
    }

    /// Records the sort.
    pub fn record(
        &self,
        kernels: &SortKernels,
        scan_kernels: &ScanKernels,
        recorder: &mut Recorder,
    ) {
        for pass in &self.passes {
            recorder.dispatch(&kernels.count, &pass.count, self.blocks);
            self.scan.record(scan_kernels, recorder);
            recorder.dispatch(&kernels.scatter, &pass.scatter, self.blocks);
        }
    }
}
