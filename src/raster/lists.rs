//! Visible Gaussians of a view: their projections and the depth-sorted list of each tile
//! (`project`, `compact`, `tile_lists`, `tile_ranges`).

use bytemuck::{Pod, Zeroable};

use super::{
    Raster,
    constants::*,
    groups::{Count, WorkKind},
    portions::Portions,
    scan::{Scan, Total},
    sort::Sort,
    splats::Geometry,
    view::ViewUniform,
};
use crate::gpu::{Bindings, Buffer, Gpu, GpuError, Readback, Recorder, groups_for};

/// Twin of `struct Projected` in `shaders/common/projected.wgsl`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
pub struct Projected {
    /// Center in pixels.
    pub mean: [f32; 2],
    /// Half width and height of its box in pixels.
    pub extent: [f32; 2],
    /// Inverse covariance xx, xy, yy in px⁻²; opacity.
    pub conic_opacity: [f32; 4],
}

/// Twin of `struct TileListsMode`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct TileListsMode {
    /// 0 counts, 1 emits.
    pub emit: u32,
}

/// Counts of the device in one view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Status {
    /// Tile-list entries that an overflowing view needed; the lists were left empty.
    pub overflow: Option<usize>,
    /// Gaussians in view.
    pub visible: usize,
    /// Tile-list entries.
    pub instances: usize,
    /// Gaussians culled for values that are not finite or a quaternion without
    /// direction, summed over the views since the last reset.
    pub poisoned: usize,
    /// Gradients of single parameters that Adam refused since the last reset,
    /// because they are no numbers or their squares would not be.
    pub refused: usize,
    /// Training steps since the last reset; none is taken after an overflow.
    pub steps: usize,
}

impl Status {
    fn from_words(words: &[u32]) -> Self {
        Self {
            overflow: (words[STATUS_OVERFLOW] != 0).then(|| words[STATUS_NEEDED] as usize),
            visible: words[STATUS_VISIBLE] as usize,
            instances: words[STATUS_INSTANCES] as usize,
            poisoned: words[STATUS_POISONED] as usize,
            refused: words[STATUS_REFUSED] as usize,
            steps: words[STATUS_STEPS] as usize,
        }
    }
}

/// A status on its way from the device.
pub struct StatusReadback(Readback<u32>);

impl StatusReadback {
    /// Waits for it.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn wait(self, gpu: &Gpu) -> Result<Status, GpuError> {
        Ok(Status::from_words(&self.0.wait(gpu)?))
    }
}

/// Buffers and bindings that turn one geometry into tile lists.
pub struct Lists {
    /// The camera at work.
    pub view: Buffer<ViewUniform>,
    /// Gaussians on the image plane, `[N]`; stale where not visible.
    pub projected: Buffer<Projected>,
    /// Bits of each Gaussian's depth, `[N]`; stale where not visible.
    pub depths: Buffer<u32>,
    /// Depth rank of each Gaussian, `[N]`; `u32::MAX` where not visible.
    pub ranks: Buffer<u32>,
    /// The status words.
    pub status: Buffer<u32>,
    /// First list entry of each rank, `[N]`; stale beyond those in view.
    pub offsets: Buffer<u32>,
    /// Gaussian of each emission slot.
    pub instance_splats: Buffer<u32>,
    /// First sorted entry of each tile, `[tiles + 1]`.
    pub starts: Buffer<u32>,
    /// Gaussians in view.
    pub visible: Count,
    /// Entries that the lists have room for.
    pub capacity: usize,
    /// Division of dispatches over the tiles.
    pub(super) portions: Portions,
    count: usize,
    max_tiles: usize,
    by_depth: Sort,
    by_tile: Sort,
    scan_visible: Scan,
    scan_offsets: Scan,
    project: Bindings,
    compact: Bindings,
    count_tiles: Bindings,
    emit_tiles: Bindings,
    tile_ranges: Bindings,
}

impl Lists {
    /// Bytes of lists for so many Gaussians, tiles and entries.
    pub fn bytes(splats: usize, max_tiles: usize, capacity: usize) -> u64 {
        // Visible, depth, rank and offset of each Gaussian; an entry's; a tile's.
        let words = 4 * splats + capacity + max_tiles + 1;
        (size_of::<Projected>() * splats + 4 * words) as u64
            + Sort::bytes(splats)
            + Sort::bytes(capacity)
    }

    /// Lists for views of at most `max_tiles` tiles and `capacity` entries.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        raster: &Raster,
        geometry: &Geometry,
        max_tiles: usize,
        capacity: usize,
    ) -> Result<Self, GpuError> {
        let gpu = &raster.gpu;
        let n = geometry.count;
        let words = |label, len| Buffer::<u32>::zeros(gpu, label, len);
        let view = Buffer::uniform(gpu, "view", &ViewUniform::default())?;
        let projected = Buffer::zeros(gpu, "projected", n)?;
        let visible = words("visible", n)?;
        let depths = words("depths", n)?;
        let ranks = words("ranks", n)?;
        let status = words("status", STATUS_WORDS)?;
        let offsets = words("offsets", n)?;
        let instance_splats = words("instance splats", capacity)?;
        let starts = words("tile starts", max_tiles + 1)?;
        let all = Count::new(gpu, n)?;
        let (in_view, entries) = (Count::new(gpu, 0)?, Count::new(gpu, 0)?);
        let sort = |count, len, bits| {
            Sort::new(gpu, &raster.sort, &raster.scan, &status, count, len, bits)
        };
        let by_depth = sort(&in_view, n, 32 - raster.numerics.depth_bits..32)?;
        let tile_bits = usize::BITS - max_tiles.leading_zeros();
        let by_tile = sort(&entries, capacity, 0..tile_bits)?;
        let scan = |values, count, total| {
            let work = (count, WorkKind::Scan);
            Scan::new(gpu, &raster.scan, values, &status, work, Some(total))
        };
        let visible_total = Total {
            word: STATUS_VISIBLE,
            count: &in_view,
            limit: n,
        };
        let scan_visible = scan(&visible, &all, visible_total)?;
        let entry_total = Total {
            word: STATUS_INSTANCES,
            count: &entries,
            limit: capacity,
        };
        let scan_offsets = scan(&offsets, &in_view, entry_total)?;
        let kernels = &raster.lists;
        let project = raster.projection.project.bind(
            gpu,
            &[
                view.raw(),
                geometry.planes.raw(),
                projected.raw(),
                visible.raw(),
                depths.raw(),
                ranks.raw(),
                status.raw(),
            ],
        );
        let compact = kernels.compact.bind(
            gpu,
            &[
                view.raw(),
                visible.raw(),
                depths.raw(),
                status.raw(),
                by_depth.keys[0].raw(),
                by_depth.values[0].raw(),
            ],
        );
        let tile_lists = |emit: u32| -> Result<Bindings, GpuError> {
            let mode = Buffer::uniform(gpu, "tile lists mode", &TileListsMode { emit })?;
            Ok(kernels.tile_lists.bind(
                gpu,
                &[
                    view.raw(),
                    mode.raw(),
                    projected.raw(),
                    by_depth.sorted_values().raw(),
                    status.raw(),
                    ranks.raw(),
                    offsets.raw(),
                    by_tile.keys[0].raw(),
                    by_tile.values[0].raw(),
                    instance_splats.raw(),
                ],
            ))
        };
        let (count_tiles, emit_tiles) = (tile_lists(0)?, tile_lists(1)?);
        let tile_ranges = kernels.tile_ranges.bind(
            gpu,
            &[
                view.raw(),
                by_tile.sorted_keys().raw(),
                status.raw(),
                starts.raw(),
            ],
        );
        Ok(Self {
            view,
            projected,
            depths,
            ranks,
            status,
            offsets,
            instance_splats,
            starts,
            visible: in_view,
            capacity,
            portions: Portions::new(gpu, max_tiles)?,
            count: n,
            max_tiles,
            by_depth,
            by_tile,
            scan_visible,
            scan_offsets,
            project,
            compact,
            count_tiles,
            emit_tiles,
            tile_ranges,
        })
    }

    /// Gaussians by depth, `[visible]`.
    pub fn order(&self) -> &Buffer<u32> {
        self.by_depth.sorted_values()
    }

    /// Emission slots by tile and depth, `[instances]`.
    pub fn slots(&self) -> &Buffer<u32> {
        self.by_tile.sorted_values()
    }

    /// Tiles that a view may have.
    pub fn max_tiles(&self) -> usize {
        self.max_tiles
    }

    /// Chooses the camera for what is recorded and submitted next.
    ///
    /// # Panics
    /// When the view has more tiles than the lists were made for.
    pub fn set_view(&self, gpu: &Gpu, view: &ViewUniform) {
        assert!(
            view.tile_count() <= self.max_tiles,
            "view is larger than its lists"
        );
        let mut view = *view;
        view.instance_capacity = self.capacity as u32;
        self.view.write(gpu, &[view]);
    }

    /// Records everything from projection to tile ranges.
    pub fn record(&self, raster: &Raster, recorder: &mut Recorder) {
        let kernels = &raster.lists;
        let groups = groups_for(self.count);
        recorder.dispatch(&raster.projection.project, &self.project, groups);
        self.scan_visible.record(recorder);
        recorder.dispatch(&kernels.compact, &self.compact, groups);
        self.by_depth.record(&raster.sort, recorder);
        let tile_lists = |bindings, recorder: &mut Recorder| {
            (self.visible).dispatch(WorkKind::Thread, &kernels.tile_lists, bindings, recorder);
        };
        tile_lists(&self.count_tiles, recorder);
        self.scan_offsets.record(recorder);
        tile_lists(&self.emit_tiles, recorder);
        self.by_tile.record(&raster.sort, recorder);
        recorder.dispatch(
            &kernels.tile_ranges,
            &self.tile_ranges,
            groups_for(self.max_tiles + 1),
        );
    }

    /// Orders the status words.
    pub fn status_later(&self, gpu: &Gpu) -> StatusReadback {
        StatusReadback(self.status.read_later(gpu))
    }

    /// Reads the status words, waiting for the device.
    ///
    /// # Errors
    /// [`GpuError::Lost`].
    pub fn status(&self, gpu: &Gpu) -> Result<Status, GpuError> {
        self.status_later(gpu).wait(gpu)
    }

    /// Forgets overflow and counts.
    pub fn reset_status(&self, gpu: &Gpu) {
        self.status.write(gpu, &[0; STATUS_WORDS]);
    }
}
