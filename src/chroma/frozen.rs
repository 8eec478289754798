//! The geometry before all cameras, at all scales: uploaded once, projected and listed
//! once where the device has room, and lent to whoever solves or draws on it.

use std::sync::Arc;

use super::{ChromaError, ChromaKernels};
use crate::{
    capture::Camera,
    gpu::{Gpu, GpuError, Recorder},
    raster::{
        AdjointScratch, COLOR_FIGURES, Canvas, ColorKind, Field, Geometry, Layer, Lists, Load,
        Picture, Raster, ViewUniform, constants::NEAR_SHARE,
    },
    splats::{Splats, sh},
};

/// Bytes of tile lists and wanted colors that stay on the device where no limit is set:
/// leaves room for the rest on devices of 4 GiB.
const DEFAULT_PINS: u64 = 2 << 30;

/// Counts that are on their way from the device at a time.
const IN_FLIGHT: usize = 64;

/// What the device may be asked for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Room {
    /// Bytes of the device that stage 2 may take; `None`: what views one at a time need,
    /// and 2 GiB of what is worth keeping.
    pub limit: Option<u64>,
    /// The highest degree of harmonics that will be solved for.
    pub sh_degree: u32,
    /// Whether wanted pixels have weights.
    pub weighted: bool,
}

/// One view at one scale.
struct Frozen {
    uniform: ViewUniform,
    visible: usize,
    entries: usize,
    /// Its own tile lists, made already.
    lists: Option<Lists>,
}

/// Frozen geometry before cameras.
pub struct FrozenViews {
    pub(super) raster: Arc<Raster>,
    pub(super) kernels: ChromaKernels,
    pub(super) geometry: Geometry,
    /// `[views][scales]`, full size first.
    views: Vec<Vec<Frozen>>,
    /// What comes before this one stays on the device.
    pinned: usize,
    /// Lists that all other views take turns in.
    spare: Option<Lists>,
    demand: u64,
}

impl FrozenViews {
    /// The geometry of `splats` before `cameras`, at full size and `scales - 1` times
    /// halved. `extent` is the scene's, in world units. As many views as `room` allows, in
    /// order, keep their tile lists, and later their targets, on the device.
    ///
    /// # Errors
    /// [`ChromaError::NoViews`] without cameras, [`ChromaError::OverLimit`] where one
    /// view at a time exceeds the limit, [`ChromaError::Gpu`].
    pub fn new(
        raster: &Arc<Raster>,
        splats: &Splats,
        extent: f64,
        cameras: &[Camera],
        scales: usize,
        room: Room,
    ) -> Result<Self, ChromaError> {
        if cameras.is_empty() {
            return Err(ChromaError::NoViews);
        }
        let gpu = &raster.gpu;
        let geometry = Geometry::upload(gpu, splats)?;
        let near = NEAR_SHARE * extent;
        let uniform = |camera: &Camera, scale: usize| {
            let [width, height] = [camera.width, camera.height].map(|side| (side >> scale).max(1));
            ViewUniform::new(&camera.resized(width, height), near, geometry.count, 0)
        };
        let uniforms: Vec<ViewUniform> = (cameras.iter())
            .flat_map(|camera| (0..scales.max(1)).map(|scale| uniform(camera, scale)))
            .collect();
        let counted = count(raster, &geometry, &uniforms)?;
        let frozen = uniforms.into_iter().zip(counted);
        let mut frozen = frozen.map(|(uniform, [visible, entries])| Frozen {
            uniform,
            visible,
            entries,
            lists: None,
        });
        let mut views: Vec<Vec<Frozen>> = (cameras.iter())
            .map(|_| frozen.by_ref().take(scales.max(1)).collect())
            .collect();
        drop(frozen);

        let demand = Demand::of(geometry.count, splats.sh.degree, &views, room);
        let pinned = demand.pinned(&views, room.limit)?;
        for view in views[..pinned].iter_mut().flatten() {
            let lists = Lists::new(raster, &geometry, view.uniform.tile_count(), view.entries)?;
            let mut recorder = Recorder::new(gpu);
            lists.set_view(gpu, &view.uniform);
            lists.record(raster, &mut recorder);
            recorder.submit();
            view.lists = Some(lists);
        }
        let spare = (pinned < views.len())
            .then(|| Lists::new(raster, &geometry, demand.tiles, demand.entries))
            .transpose()?;
        Ok(Self {
            raster: raster.clone(),
            kernels: ChromaKernels::new(gpu),
            demand: demand.bytes(&views, pinned),
            geometry,
            views,
            pinned,
            spare,
        })
    }

    /// How many Gaussians there are.
    pub fn splat_count(&self) -> usize {
        self.geometry.count
    }

    /// The device that holds the buffers.
    pub fn gpu(&self) -> &Gpu {
        &self.raster.gpu
    }

    /// How many views there are.
    pub fn len(&self) -> usize {
        self.views.len()
    }

    /// Whether there is none; never.
    pub fn is_empty(&self) -> bool {
        self.views.is_empty()
    }

    /// Views whose lists and targets stay on the device: the first so many.
    pub fn pinned(&self) -> usize {
        self.pinned
    }

    /// Bytes of the device that stage 2 takes at most, as estimated before they were.
    pub fn demand(&self) -> u64 {
        self.demand
    }

    /// Scales of each view.
    pub(super) fn scales(&self) -> usize {
        self.views[0].len()
    }

    pub(super) fn uniform(&self, view: usize, scale: usize) -> &ViewUniform {
        &self.views[view][scale].uniform
    }

    pub(super) fn is_pinned(&self, view: usize) -> bool {
        view < self.pinned
    }

    /// The lists that a view is drawn with.
    pub(super) fn lists(&self, view: usize, scale: usize) -> Option<&Lists> {
        self.views[view][scale]
            .lists
            .as_ref()
            .or(self.spare.as_ref())
    }

    /// Makes a view's lists hold it, to draw harmonics of `sh_degree`.
    pub(super) fn list(&self, view: usize, scale: usize, sh_degree: u32, recorder: &mut Recorder) {
        let frozen = &self.views[view][scale];
        let Some(lists) = self.lists(view, scale) else {
            return;
        };
        let uniform = ViewUniform {
            sh_degree,
            ..frozen.uniform
        };
        lists.set_view(&self.raster.gpu, &uniform);
        if frozen.lists.is_none() {
            lists.record(&self.raster, recorder);
        }
    }

    /// Makes the lists that stay anew, to draw harmonics of `sh_degree`: a Gaussian whose color
    /// could not be drawn, as a step that goes too far has them, was taken out of them.
    pub(super) fn relist(&self, sh_degree: u32) {
        for view in 0..self.pinned {
            let mut recorder = Recorder::new(&self.raster.gpu);
            for (scale, frozen) in self.views[view].iter().enumerate() {
                self.list(view, scale, sh_degree, &mut recorder);
                if let Some(lists) = &frozen.lists {
                    lists.record(&self.raster, &mut recorder);
                }
            }
            recorder.submit();
        }
    }

    /// Entries of the longest lists of these views.
    pub(super) fn capacity(&self, views: impl Iterator<Item = usize>) -> usize {
        let lists = views.flat_map(|view| (0..self.scales()).map(move |scale| (view, scale)));
        let capacities = lists.filter_map(|(view, scale)| Some(self.lists(view, scale)?.capacity));
        capacities.max().unwrap_or(0)
    }

    /// What a dispatch works on, the mean over these views at so many scales.
    pub(super) fn load(&self, views: impl Iterator<Item = usize>, scales: usize) -> Load {
        let passes: Vec<&Frozen> = views.flat_map(|view| &self.views[view][..scales]).collect();
        let mean = |of: &dyn Fn(&Frozen) -> usize| {
            passes.iter().map(|frozen| of(frozen) as f64).sum::<f64>() / passes.len().max(1) as f64
        };
        Load {
            splats: self.geometry.count as f64,
            visible: mean(&|frozen| frozen.visible),
            instances: mean(&|frozen| frozen.entries),
            capacity: mean(&|frozen| frozen.entries),
            pixels: mean(&|frozen| frozen.uniform.pixel_count()),
            tiles: mean(&|frozen| frozen.uniform.tile_count()),
            ..Load::default()
        }
    }

    /// Draws fields as a view sees them at full size.
    pub(super) fn draw(&self, view: usize, fields: &[&Field]) -> Result<Vec<Picture>, GpuError> {
        let gpu = &self.raster.gpu;
        let uniform = self.uniform(view, 0);
        let (pixels, tiles) = (uniform.pixel_count(), uniform.tile_count());
        let mut pictures = Vec::with_capacity(fields.len());
        for field in fields {
            let Some(lists) = self.lists(view, 0) else {
                continue;
            };
            let layer = Layer::new(&self.raster, &self.geometry, lists, field, pixels, tiles)?;
            let mut recorder = Recorder::new(gpu);
            self.list(view, 0, field.degree, &mut recorder);
            layer.record(&self.raster, &mut recorder);
            recorder.submit();
            pictures.push(Picture {
                width: uniform.size[0],
                height: uniform.size[1],
                channels: field.kind.channels(),
                pixels: layer.read_image(gpu, pixels)?,
            });
        }
        Ok(pictures)
    }
}

/// Gaussians in view and entries of the tile lists that each view needs.
fn count(
    raster: &Raster,
    geometry: &Geometry,
    uniforms: &[ViewUniform],
) -> Result<Vec<[usize; 2]>, GpuError> {
    let gpu = &raster.gpu;
    let tiles = uniforms.iter().map(ViewUniform::tile_count).max();
    // Nothing fits into no room: the device counts what it would have needed.
    let probe = Lists::new(raster, geometry, tiles.unwrap_or(0), 0)?;
    let mut counted = Vec::with_capacity(uniforms.len());
    for some in uniforms.chunks(IN_FLIGHT) {
        let ordered: Vec<_> = (some.iter())
            .map(|uniform| {
                let mut recorder = Recorder::new(gpu);
                probe.set_view(gpu, uniform);
                probe.reset_status(gpu);
                probe.record(raster, &mut recorder);
                recorder.submit();
                probe.status_later(gpu)
            })
            .collect();
        for status in ordered {
            let status = status.wait(gpu)?;
            counted.push([status.visible, status.overflow.unwrap_or(0)]);
        }
    }
    Ok(counted)
}

/// Bytes on the device, known before they are taken.
struct Demand {
    splats: usize,
    /// Of the largest view.
    tiles: usize,
    /// Of the longest lists.
    entries: usize,
    /// What does not depend on which views stay.
    fixed: u64,
    /// A wanted pixel's.
    of_pixel: u64,
    /// One view's lists and targets, for all that take turns.
    turns: u64,
}

impl Demand {
    fn of(splats: usize, luma_degree: u32, views: &[Vec<Frozen>], room: Room) -> Self {
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
        let [luma, chroma] = [luma_degree, room.sh_degree].map(sh::coefficient_count);
        let field = |planes: usize| 4 * (planes * splats) as u64;
        let canvas = |kind, pixels| Canvas::bytes(kind, splats, pixels);
        let judged =
            4 * (COLOR_FIGURES * pixels[0]) as u64 + AdjointScratch::color_bytes(splats, entries);
        let chroma_canvases = pixels
            .iter()
            .map(|&pixels| canvas(ColorKind::Chroma, pixels));
        // One after the other: a/b are solved for, then pictures are drawn for the bake to
        // meet, then RGB's constant harmonics are solved for.
        let solving =
            super::lbfgs::bytes(splats, 2 * chroma) + chroma_canvases.sum::<u64>() + judged;
        let rgb = canvas(ColorKind::Rgb, pixels[0]);
        let drawing = field(luma + 2 * chroma + 3 * luma.max(chroma) + 3) + rgb;
        let baking = super::lbfgs::bytes(splats, 3) + rgb + judged;
        let of_pixel = 4 * (1 + u64::from(room.weighted));
        Self {
            splats,
            tiles,
            entries,
            fixed: Geometry::bytes(splats) + solving.max(drawing).max(baking),
            of_pixel,
            turns: Lists::bytes(splats, tiles, entries) + of_pixel * pixels[0] as u64,
        }
    }

    /// What keeping a view takes.
    fn of_view(&self, view: &[Frozen]) -> u64 {
        let of_scale = |frozen: &Frozen| {
            Lists::bytes(self.splats, frozen.uniform.tile_count(), frozen.entries)
                + self.of_pixel * frozen.uniform.pixel_count() as u64
        };
        view.iter().map(of_scale).sum()
    }

    fn bytes(&self, views: &[Vec<Frozen>], pinned: usize) -> u64 {
        let turns = if pinned < views.len() { self.turns } else { 0 };
        let kept: u64 = views[..pinned].iter().map(|view| self.of_view(view)).sum();
        self.fixed + turns + kept
    }

    /// How many views stay on the device. The order in which views are met never changes,
    /// so that keeping the first ones brings as few as any choice.
    fn pinned(&self, views: &[Vec<Frozen>], limit: Option<u64>) -> Result<usize, ChromaError> {
        let allowed = limit.unwrap_or(self.fixed + self.turns + DEFAULT_PINS);
        if self.bytes(views, views.len()) <= allowed {
            return Ok(views.len());
        }
        let needed = self.fixed + self.turns;
        if needed > allowed {
            return Err(ChromaError::OverLimit {
                splats: self.splats,
                needed,
                limit: allowed,
            });
        }
        let mut left = allowed - needed;
        let fits = views.iter().take_while(|view| {
            let rest = left.checked_sub(self.of_view(view));
            left = rest.unwrap_or(left);
            rest.is_some()
        });
        Ok(fits.count())
    }
}
