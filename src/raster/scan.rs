//! Exclusive prefix sums (`shaders/scan.wgsl`).

use bytemuck::{Pod, Zeroable};

use super::groups::{Count, SCAN_BLOCK, WorkKind};
use crate::gpu::{Bindings, Buffer, Gpu, GpuError, Kernel, Recorder, shaders};

/// Twin of `struct ScanParameters`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct ScanParameters {
    /// The elements' [`WorkKind`].
    pub which: u32,
    /// Status word for the total, `u32::MAX` for none.
    pub total_word: u32,
    /// Largest total that fits.
    pub limit: u32,
}

/// Destination of a total.
pub struct Total<'a> {
    /// The status word that receives it.
    pub word: usize,
    /// Its workgroups.
    pub count: &'a Count,
    /// The largest that fits; a larger one is an overflow and counts as nothing.
    pub limit: usize,
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
    elements: (Count, WorkKind),
    reduce: Bindings,
    sums: Bindings,
    apply: Bindings,
}

impl Scan {
    /// Scans the front of `values` in place: as many as `elements` say when it runs, those of
    /// [`WorkKind::Scan`] or of [`WorkKind::Histogram`].
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        gpu: &Gpu,
        kernels: &ScanKernels,
        values: &Buffer<u32>,
        status: &Buffer<u32>,
        elements: (&Count, WorkKind),
        total: Option<Total<'_>>,
    ) -> Result<Self, GpuError> {
        let (count, work) = elements;
        let limit = total.as_ref().map_or(0, |total| total.limit);
        let parameters = Buffer::uniform(
            gpu,
            "scan parameters",
            &ScanParameters {
                which: work as u32,
                total_word: (total.as_ref()).map_or(u32::MAX, |total| total.word as u32),
                limit: u32::try_from(limit).unwrap_or(u32::MAX),
            },
        )?;
        let block_sums =
            Buffer::<u32>::zeros(gpu, "scan block sums", values.len().div_ceil(SCAN_BLOCK))?;
        // Without a total nothing is written there.
        let of_total = match &total {
            Some(total) => total.count.clone(),
            None => Count::new(gpu, 0)?,
        };
        let [p, v, b] = [parameters.raw(), values.raw(), block_sums.raw()];
        let [s, e, t] = [status.raw(), count.groups().raw(), of_total.groups().raw()];
        let each = [(0, p), (1, v), (2, b), (4, e)];
        Ok(Self {
            elements: (count.clone(), work),
            reduce: kernels.reduce.bind_at(gpu, &each),
            sums: (kernels.sums).bind_at(gpu, &[(0, p), (2, b), (3, s), (4, e), (5, t)]),
            apply: kernels.apply.bind_at(gpu, &each),
        })
    }

    /// Records the scan.
    pub fn record(&self, kernels: &ScanKernels, recorder: &mut Recorder) {
        let (count, work) = &self.elements;
        count.dispatch(*work, &kernels.reduce, &self.reduce, recorder);
        recorder.dispatch(&kernels.sums, &self.sums, 1);
        count.dispatch(*work, &kernels.apply, &self.apply, recorder);
    }
}
