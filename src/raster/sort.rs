//! Stable radix sort of 32-bit keys with values (`shaders/sort.wgsl`).

use std::ops::Range;

use bytemuck::{Pod, Zeroable};

use super::{
    groups::{Count, DIGITS, SORT_BLOCK, WorkKind},
    kernels::variant,
    scan::{Scan, ScanKernels},
};
use crate::gpu::{Bindings, Buffer, Gpu, GpuError, Kernel, Recorder, shaders};

/// Bits sorted in one pass.
const DIGIT_BITS: u32 = 8;

/// Twin of `struct SortParameters`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct SortParameters {
    /// Lowest bit of this pass.
    pub shift: u32,
}

/// The two entry points.
#[derive(Clone)]
pub struct SortKernels {
    count: Kernel,
    scatter: Kernel,
}

impl SortKernels {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let source = variant(gpu, [shaders::SORT, shaders::SORT_SIMD]);
        Self {
            count: Kernel::new(gpu, "sort_count", source),
            scatter: Kernel::new(gpu, "sort_scatter", source),
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
    count: Count,
    passes: Vec<Pass>,
    scan: Scan,
}

impl Sort {
    /// Bytes of a sort of so many keys: twice keys and values, and the histograms.
    pub fn bytes(capacity: usize) -> u64 {
        4 * (4 * capacity + DIGITS * capacity.div_ceil(SORT_BLOCK).max(1)) as u64
    }

    /// A sort of as many keys as `count` says when it runs, at most `capacity`, by these `bits`
    /// of theirs, 0 the lowest.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        gpu: &Gpu,
        kernels: &SortKernels,
        scan_kernels: &ScanKernels,
        status: &Buffer<u32>,
        count: &Count,
        capacity: usize,
        bits: Range<u32>,
    ) -> Result<Self, GpuError> {
        let buffer = |label| Buffer::<u32>::zeros(gpu, label, capacity);
        let keys = [buffer("sort keys")?, buffer("sort keys, other side")?];
        let values = [buffer("sort values")?, buffer("sort values, other side")?];
        let blocks = capacity.div_ceil(SORT_BLOCK).max(1);
        let histogram = Buffer::<u32>::zeros(gpu, "sort histogram", DIGITS * blocks)?;
        let mut passes = Vec::new();
        let passes_needed = (bits.end - bits.start).div_ceil(DIGIT_BITS).max(1);
        for pass in 0..passes_needed {
            let parameters = Buffer::uniform(
                gpu,
                "sort parameters",
                &SortParameters {
                    shift: bits.start + pass * DIGIT_BITS,
                },
            )?;
            let (from, to) = ((pass % 2) as usize, ((pass + 1) % 2) as usize);
            let [p, n, h] = [parameters.raw(), count.groups().raw(), histogram.raw()];
            passes.push(Pass {
                count: kernels
                    .count
                    .bind_at(gpu, &[(0, p), (1, n), (2, keys[from].raw()), (4, h)]),
                scatter: kernels.scatter.bind(
                    gpu,
                    &[
                        p,
                        n,
                        keys[from].raw(),
                        values[from].raw(),
                        h,
                        keys[to].raw(),
                        values[to].raw(),
                    ],
                ),
            });
        }
        let elements = (count, WorkKind::Histogram);
        let scan = Scan::new(gpu, scan_kernels, &histogram, status, elements, None)?;
        Ok(Self {
            keys,
            values,
            count: count.clone(),
            passes,
            scan,
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
    pub fn record(&self, kernels: &SortKernels, recorder: &mut Recorder) {
        for pass in &self.passes {
            self.count
                .dispatch(WorkKind::Sort, &kernels.count, &pass.count, recorder);
            self.scan.record(recorder);
            self.count
                .dispatch(WorkKind::Sort, &kernels.scatter, &pass.scatter, recorder);
        }
    }
}
