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

/// Elements that one workgroup scans, at most, on software devices: llvmpipe ends a thread's loops
/// after 65,535 iterations altogether, of which each of the eight takes two for an element of its.
const WHOLE_UP_TO: usize = 1 << 17;

/// The entry points.
#[derive(Clone)]
pub struct ScanKernels {
    /// Sums of blocks, their scan, and the blocks from there.
    blocks: [Kernel; 3],
    /// One workgroup for all, on software devices.
    whole: Option<Kernel>,
}

impl ScanKernels {
    pub(super) fn new(gpu: &Gpu) -> Self {
        let kernel = |name| Kernel::new(gpu, name, shaders::SCAN);
        let whole = || Kernel::new(gpu, "scan_whole", shaders::SCAN_SIMD);
        Self {
            blocks: ["scan_reduce", "scan_sums", "scan_apply"].map(kernel),
            whole: gpu.simd().then(whole),
        }
    }
}

/// A scan tied to its buffer.
pub struct Scan {
    elements: (Count, WorkKind),
    steps: Vec<Step>,
}

/// A dispatch.
struct Step {
    kernel: Kernel,
    bindings: Bindings,
    /// Runs a workgroup for each block of elements, not one for all.
    by_block: bool,
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
        // Without a total nothing is written there.
        let of_total = match &total {
            Some(total) => total.count.clone(),
            None => Count::new(gpu, 0)?,
        };
        let [p, v, s] = [parameters.raw(), values.raw(), status.raw()];
        let [e, t] = [count.groups().raw(), of_total.groups().raw()];
        let step = |kernel: &Kernel, by_block, buffers: &[(u32, &wgpu::Buffer)]| Step {
            kernel: kernel.clone(),
            bindings: kernel.bind_at(gpu, buffers),
            by_block,
        };
        let steps = match &kernels.whole {
            Some(whole) if values.len() <= WHOLE_UP_TO => {
                vec![step(
                    whole,
                    false,
                    &[(0, p), (1, v), (3, s), (4, e), (5, t)],
                )]
            }
            _ => {
                let [reduce, sums, apply] = &kernels.blocks;
                let blocks = values.len().div_ceil(SCAN_BLOCK);
                let block_sums = Buffer::<u32>::zeros(gpu, "scan block sums", blocks)?;
                let b = block_sums.raw();
                let each = [(0, p), (1, v), (2, b), (4, e)];
                vec![
                    step(reduce, true, &each),
                    step(sums, false, &[(0, p), (2, b), (3, s), (4, e), (5, t)]),
                    step(apply, true, &each),
                ]
            }
        };
        Ok(Self {
            elements: (count.clone(), work),
            steps,
        })
    }

    /// Records the scan.
    pub fn record(&self, recorder: &mut Recorder) {
        let (count, work) = &self.elements;
        for step in &self.steps {
            match step.by_block {
                true => count.dispatch(*work, &step.kernel, &step.bindings, recorder),
                false => recorder.dispatch(&step.kernel, &step.bindings, 1),
            }
        }
    }
}
