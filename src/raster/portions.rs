//! Kernels that give a workgroup to each tile, cut into dispatches that end in time.
//!
//! Blending takes as long as its lists are: on a small GPU, of a large picture full of
//! Gaussians, longer than Windows lets a dispatch take ([`default_tiles_at_once`]). Tiles know
//! nothing of each other, so the result is the same bits however they are cut.
//!
//! [`default_tiles_at_once`]: crate::gpu::default_tiles_at_once

use bytemuck::{Pod, Zeroable};

use crate::gpu::{Bindings, Buffer, Gpu, GpuError, Kernel, Recorder};

/// Twin of `struct Portion` in `shaders/common/portion.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct Portion {
    /// The first tile.
    pub first: u32,
}

/// Starts of the dispatches over an image's tiles.
pub(super) struct Portions {
    /// The first tile of each, for the host and for the device.
    firsts: Vec<(usize, Buffer<Portion>)>,
    size: usize,
}

impl Portions {
    /// For pictures of at most `max_tiles` tiles.
    pub fn new(gpu: &Gpu, max_tiles: usize) -> Result<Self, GpuError> {
        let size = gpu.tiles_at_once();
        let firsts = (0..max_tiles.max(1)).step_by(size).map(|first| {
            let portion = Portion {
                first: first as u32,
            };
            Ok((first, Buffer::uniform(gpu, "portion", &portion)?))
        });
        Ok(Self {
            firsts: firsts.collect::<Result<_, _>>()?,
            size,
        })
    }

    /// Ties buffers to the bindings of a kernel named beside them, and each portion's first
    /// tile to binding `portion`, for the first `tiles` tiles.
    pub fn bind(
        &self,
        gpu: &Gpu,
        kernel: &Kernel,
        buffers: &[(u32, &wgpu::Buffer)],
        portion: u32,
        tiles: usize,
    ) -> TileBindings {
        let wanted = self.firsts.iter().filter(|(first, _)| *first < tiles);
        TileBindings(
            wanted
                .map(|(first, buffer)| {
                    let all = [buffers, &[(portion, buffer.raw())]].concat();
                    let groups = self.size.min(tiles - first) as u32;
                    (kernel.bind_at(gpu, &all), groups)
                })
                .collect(),
        )
    }
}

/// The buffers of a kernel over tiles, once for each portion, and its workgroups.
pub(super) struct TileBindings(Vec<(Bindings, u32)>);

impl TileBindings {
    /// Records the kernel over all tiles.
    pub fn record(&self, kernel: &Kernel, recorder: &mut Recorder) {
        for (bindings, groups) in &self.0 {
            recorder.dispatch(kernel, bindings, *groups);
        }
    }
}
