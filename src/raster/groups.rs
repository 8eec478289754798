//! Number of workgroups for a count on the device (`shaders/common/groups.wgsl`): if a view shows a
//! part of the scene, kernels over the visible Gaussians run for that part only.

use bytemuck::{Pod, Zeroable};

use crate::gpu::{Bindings, Buffer, Gpu, GpuError, Kernel, LINEAR_WORKGROUP, Recorder, folded};

/// Elements that a workgroup of a scan takes.
pub(super) const SCAN_BLOCK: usize = 1024;

/// Elements that a workgroup of a sort takes.
pub(super) const SORT_BLOCK: usize = 2048;

/// Digits that a sort counts in each of its blocks.
pub(super) const DIGITS: usize = 256;

/// Work on the elements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WorkKind {
    /// A thread each.
    Thread,
    /// Scan them.
    Scan,
    /// Sort them.
    Sort,
    /// Scan the histogram of their sort.
    Histogram,
}

/// Twin of `struct Groups`: the arguments of an indirect dispatch, and for how many elements.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Pod, Zeroable)]
pub struct Groups {
    /// Workgroups along x, y and z.
    pub counts: [u32; 3],
    /// Elements.
    pub length: u32,
}

impl Groups {
    fn of(length: usize, each: usize) -> Self {
        let [x, y] = folded(length.div_ceil(each) as u32);
        Self {
            counts: [x, y, 1],
            length: length as u32,
        }
    }

    /// The twin of `groups_for_count`, in the order of [`WorkKind`].
    pub fn for_count(count: usize) -> [Self; 4] {
        let histogram = DIGITS * count.div_ceil(SORT_BLOCK);
        [
            Self::of(count, LINEAR_WORKGROUP as usize),
            Self::of(count, SCAN_BLOCK),
            Self::of(count, SORT_BLOCK),
            Self::of(histogram, SCAN_BLOCK),
        ]
    }
}

/// A number of elements that host or device counted, as workgroups. Clones share it.
#[derive(Clone)]
pub struct Count(Buffer<Groups>);

impl Count {
    /// Workgroups for `count` elements, until a scan's total replaces it.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(gpu: &Gpu, count: usize) -> Result<Self, GpuError> {
        let groups = Groups::for_count(count);
        let buffer = Buffer::indirect(gpu, "count", groups.len())?;
        buffer.write(gpu, &groups);
        Ok(Self(buffer))
    }

    /// The list of [`Groups`].
    pub fn groups(&self) -> &Buffer<Groups> {
        &self.0
    }

    /// Runs a kernel for the elements.
    pub fn dispatch(
        &self,
        work: WorkKind,
        kernel: &Kernel,
        bindings: &Bindings,
        recorder: &mut Recorder,
    ) {
        let offset = (work as usize * size_of::<Groups>()) as u64;
        recorder.dispatch_indirect(kernel, bindings, self.0.raw(), offset);
    }
}
