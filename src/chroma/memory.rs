//! Memory of the device for coloring, in bytes, estimated before it is taken.

use super::{ChromaError, correction::Corrections, frozen_view::Frozen};
use crate::{
    gpu::Gpu,
    raster::{
        AdjointScratch, COLOR_FIGURES, Canvas, ColorKind, Geometry, Lists,
        constants::GEOMETRY_PLANES,
    },
    splats::sh,
};

/// Bytes of tile lists and wanted colors that stay on the device where no limit is set:
/// leaves room for the rest on devices of 4 GiB.
const DEFAULT_PINS: u64 = 2 << 30;

/// Memory that the device may be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryBudget {
    /// Bytes of the device that stage 2 may take; `None`: what views one at a time need,
    /// and 2 GiB of what is worth keeping.
    pub limit: Option<u64>,
    /// Channels to be solved for: a and b, or all of RGB.
    pub color: ColorKind,
    /// The highest degree of harmonics that will be solved for.
    pub sh_degree: u32,
    /// True if target pixels have weights.
    pub weighted: bool,
    /// True if Gaussians may wait on the host when the limit or the adapter's largest binding
    /// leaves no room for all of them. [`AdamSolver`](super::AdamSolver) needs them all, and
    /// coarser scales do.
    pub streams: bool,
}

impl MemoryBudget {
    /// Without a limit, for pixels that all weigh the same and Gaussians that all stay on the
    /// device.
    pub fn of(color: ColorKind, sh_degree: u32) -> Self {
        Self {
            limit: None,
            color,
            sh_degree,
            weighted: false,
            streams: false,
        }
    }
}

/// Least memory of Gaussians that all stay on the device, whatever the views.
pub(super) struct MinimumMemory {
    bytes: u64,
    /// Bytes of the largest buffer.
    buffer: u64,
}

impl MinimumMemory {
    pub fn of(splats: usize, luma_degree: u32, room: MemoryBudget) -> Self {
        let [luma, solved] = [luma_degree, room.sh_degree].map(sh::coefficient_count);
        let widest = GEOMETRY_PLANES.max(3 * luma.max(solved));
        let unknowns = room.color.channels() * solved;
        Self {
            bytes: Geometry::bytes(splats) + super::lbfgs::bytes(splats, unknowns),
            buffer: 4 * (widest * splats) as u64,
        }
    }

    /// Returns true if the adapter can bind the largest buffer, and the limit allows all bytes.
    pub fn fits(&self, gpu: &Gpu, limit: Option<u64>) -> bool {
        self.buffer <= gpu.binding_limit() && limit.is_none_or(|limit| self.bytes <= limit)
    }
}

/// Bytes on the device, known before they are taken.
pub(super) struct Demand {
    splats: usize,
    /// Tiles of the largest view.
    pub tiles: usize,
    /// Entries of the longest lists.
    pub entries: usize,
    /// Bytes that do not depend on which views stay.
    fixed: u64,
    /// Those of each view that stays.
    of_views: Vec<u64>,
    /// One view's lists and targets, for all that take turns.
    turns: u64,
    /// True if the Gaussians wait on the host.
    streams: bool,
}

impl Demand {
    /// Demand of views that show so many Gaussians each, or with `streams` at most.
    pub fn of(
        splats: usize,
        luma_degree: u32,
        views: &[Vec<Frozen>],
        room: MemoryBudget,
        streams: bool,
    ) -> Self {
        let all = || views.iter().flatten();
        let most = |of: &dyn Fn(&Frozen) -> usize| all().map(of).max().unwrap_or(0);
        let tiles = most(&|frozen| frozen.uniform.tile_count());
        let entries = most(&|frozen| frozen.entries);
        let pixels: Vec<usize> = (0..views[0].len())
            .map(|scale| {
                let sizes = views.iter().map(|view| view[scale].uniform.pixel_count());
                sizes.max().unwrap_or(0)
            })
            .collect();
        let [luma, solved] = [luma_degree, room.sh_degree].map(sh::coefficient_count);
        let unknowns = room.color.channels() * solved;
        let field = |planes: usize| 4 * (planes * splats) as u64;
        let canvas = |kind, pixels| Canvas::bytes(kind, splats, pixels);
        let judged =
            4 * (COLOR_FIGURES * pixels[0]) as u64 + AdjointScratch::color_bytes(splats, entries);
        let canvases = pixels.iter().map(|&pixels| canvas(room.color, pixels));
        // One after the other: colors are solved for, then, where they are a/b, pictures are
        // drawn for the bake to meet, then RGB's constant harmonics are solved for.
        let minimizing = |planes: usize| match streams {
            // Unknowns, gradient and curvature, on their way as well; the rest is the host's.
            true => Geometry::bytes(splats) + 2 * field(2 * planes + 2),
            false => super::lbfgs::bytes(splats, planes),
        };
        let solving = minimizing(unknowns) + canvases.sum::<u64>() + judged;
        let rgb = canvas(ColorKind::Rgb, pixels[0]);
        let exported = 3 * luma.max(solved);
        let drawing = rgb
            + field(match streams {
                // One after the other, on their way as well.
                true => GEOMETRY_PLANES + 2 * exported,
                false => luma + unknowns + exported + 3,
            });
        let baking = minimizing(3) + rgb + judged;
        let of_pixel = 4 * (1 + u64::from(room.weighted));
        // On its way as well.
        let wanted = (1 + u64::from(streams)) * of_pixel * pixels[0] as u64;
        let of_scale = |frozen: &Frozen| {
            Lists::bytes(splats, frozen.uniform.tile_count(), frozen.entries)
                + of_pixel * frozen.uniform.pixel_count() as u64
        };
        Self {
            splats,
            tiles,
            entries,
            fixed: Geometry::bytes(splats)
                + Corrections::bytes(views.len())
                + solving.max(drawing).max(baking),
            of_views: (views.iter().map(|view| view.iter().map(of_scale).sum())).collect(),
            streams,
            turns: Lists::bytes(splats, tiles, entries) + wanted,
        }
    }

    /// Demand of views of so many pixels that are drawn on the host.
    pub fn on_host(primitives: usize, pixels: &[usize], room: MemoryBudget) -> Self {
        let unknowns = room.color.channels() * sh::coefficient_count(room.sh_degree);
        let most = pixels.iter().copied().max().unwrap_or(0);
        let picture = 4 * ((room.color.stride() + COLOR_FIGURES) * most) as u64;
        let of_pixel = 4 * (1 + u64::from(room.weighted));
        Self {
            splats: primitives,
            tiles: 0,
            entries: 0,
            fixed: super::lbfgs::bytes(primitives, unknowns)
                + Corrections::bytes(pixels.len())
                + picture,
            of_views: pixels
                .iter()
                .map(|&pixels| of_pixel * pixels as u64)
                .collect(),
            turns: of_pixel * most as u64,
            streams: false,
        }
    }

    /// With so many views kept.
    pub fn bytes(&self, pinned: usize) -> u64 {
        let (kept, rest) = self.of_views.split_at(pinned);
        let turns = if rest.is_empty() { 0 } else { self.turns };
        self.fixed + turns + kept.iter().sum::<u64>()
    }

    /// Number of views that stay on the device. The order of the views never changes, so that
    /// keeping the first ones saves as many uploads as any choice.
    pub fn pinned(&self, limit: Option<u64>) -> Result<usize, ChromaError> {
        let allowed = limit.unwrap_or(self.fixed + self.turns + DEFAULT_PINS);
        let views = self.of_views.len();
        if !self.streams && self.bytes(views) <= allowed {
            return Ok(views);
        }
        let needed = self.fixed + self.turns;
        if needed > allowed {
            return Err(ChromaError::OverLimit {
                splats: self.splats,
                needed,
                limit: allowed,
            });
        }
        // Lists are of what is on the device when they are made.
        if self.streams {
            return Ok(0);
        }
        let mut left = allowed - needed;
        let fits = self.of_views.iter().take_while(|&&bytes| {
            let rest = left.checked_sub(bytes);
            left = rest.unwrap_or(left);
            rest.is_some()
        });
        Ok(fits.count())
    }
}
