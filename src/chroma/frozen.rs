//! The geometry before all cameras, at all scales: uploaded once, projected and listed
//! once where the device has room, and lent to whoever solves or draws on it. Where it has no
//! room for all Gaussians, they wait on the host, and those that a view may show come for it.

use std::sync::Arc;

use super::{
    ChromaError, ChromaKernels,
    frozen_view::Frozen,
    memory::{Demand, MemoryBudget, MinimumMemory},
};
use crate::{
    capture::Camera,
    gpu::{Gpu, GpuError, Recorder},
    raster::{
        Field, Geometry, Layer, Lists, Load, Raster, RenderedImage, Streamed, UNREACHED,
        ViewUniform, blend_depth, constants::NEAR_SHARE, depths,
    },
    splats::{ShField, Splats, sh},
};

/// Counts that are on their way from the device at a time.
const IN_FLIGHT: usize = 64;

/// Gaussians that wait on the host, and their cameras.
struct HostScene {
    scene: Streamed,
    /// Cameras of the views.
    cameras: Vec<Camera>,
}

/// Harmonics to be drawn over frozen geometry, on the device or on the host as this is.
pub(super) enum Colors<'a> {
    /// Harmonics of all Gaussians, on the device.
    Device(Field),
    /// Harmonics of all Gaussians, on the host.
    Host(&'a ShField),
}

/// Frozen geometry before cameras.
pub struct FrozenViews {
    pub(super) raster: Arc<Raster>,
    pub(super) kernels: ChromaKernels,
    /// Geometry of all Gaussians, or of those that the view before showed.
    pub(super) geometry: Geometry,
    /// All Gaussians, where they wait on the host.
    streamed: Option<HostScene>,
    /// `[views][scales]`, full size first.
    views: Vec<Vec<Frozen>>,
    /// Number of views, the first ones, that stay on the device.
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
        room: MemoryBudget,
    ) -> Result<Self, ChromaError> {
        if cameras.is_empty() {
            return Err(ChromaError::NoViews);
        }
        let streams = room.streams && scales <= 1;
        if !streams
            || MinimumMemory::of(splats.len(), splats.sh.degree, room).fits(&raster.gpu, room.limit)
        {
            let all = Self::placed(raster, splats, extent, cameras, scales, room, None);
            if !(streams && matches!(all, Err(ChromaError::OverLimit { .. }))) {
                return all;
            }
        }
        let streamed = HostScene {
            scene: Streamed::new(splats, NEAR_SHARE * extent),
            cameras: cameras.to_vec(),
        };
        Self::placed(raster, splats, extent, cameras, 1, room, Some(streamed))
    }

    /// Views of all Gaussians, or of those that wait on the host.
    fn placed(
        raster: &Arc<Raster>,
        splats: &Splats,
        extent: f64,
        cameras: &[Camera],
        scales: usize,
        room: MemoryBudget,
        streamed: Option<HostScene>,
    ) -> Result<Self, ChromaError> {
        let gpu = &raster.gpu;
        let geometry = match &streamed {
            None => Geometry::upload(gpu, splats)?,
            Some(on_host) => Geometry::of_none(gpu, on_host.most_shown())?,
        };
        let near = NEAR_SHARE * extent;
        let uniform = |camera: &Camera, scale: usize| {
            let [width, height] = [camera.width, camera.height].map(|side| (side >> scale).max(1));
            ViewUniform::new(&camera.resized(width, height), near, geometry.count, 0)
        };
        let uniforms: Vec<ViewUniform> = (cameras.iter())
            .flat_map(|camera| (0..scales.max(1)).map(|scale| uniform(camera, scale)))
            .collect();
        let counted = match &streamed {
            None => count(raster, &geometry, &uniforms)?,
            Some(on_host) => {
                let one = |(view, uniform)| {
                    geometry.put(gpu, &on_host.scene.chosen(&on_host.shown(view)));
                    count(raster, &geometry, std::slice::from_ref(uniform))
                };
                let counted = uniforms.iter().enumerate().map(one);
                counted.collect::<Result<Vec<_>, _>>()?.concat()
            }
        };
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

        let streams = streamed.is_some();
        let demand = Demand::of(geometry.count, splats.sh.degree, &views, room, streams);
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
            streamed,
            geometry,
            views,
            pinned,
            spare,
        })
    }

    /// Number of Gaussians.
    pub fn splat_count(&self) -> usize {
        match &self.streamed {
            Some(on_host) => on_host.scene.len(),
            None => self.geometry.count,
        }
    }

    /// Number of Gaussians on the device at a time, at most, if they wait on the host.
    pub fn streamed(&self) -> Option<usize> {
        self.streamed.as_ref().map(|_| self.geometry.count)
    }

    /// Puts those on the device that a view may show, where they wait on the host, and tells
    /// which they are.
    pub(super) fn put(&self, view: usize) -> Option<Vec<usize>> {
        let on_host = self.streamed.as_ref()?;
        let shown = on_host.shown(view);
        self.geometry.put(self.gpu(), &on_host.scene.chosen(&shown));
        Some(shown)
    }

    /// Harmonics of all Gaussians, to be drawn.
    pub(super) fn colors<'a>(&self, field: &'a ShField) -> Result<Colors<'a>, ChromaError> {
        Ok(match self.streamed {
            Some(_) => Colors::Host(field),
            None => Colors::Device(Field::upload(self.gpu(), field)?),
        })
    }

    /// The device that holds the buffers.
    pub fn gpu(&self) -> &Gpu {
        &self.raster.gpu
    }

    /// Number of views.
    pub fn len(&self) -> usize {
        self.views.len()
    }

    /// Returns true if there are no views; never.
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

    /// Work of a dispatch, the mean over these views at so many scales.
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

    /// Draws harmonics as a view sees them at full size.
    pub(super) fn draw(
        &self,
        view: usize,
        fields: &[&Colors<'_>],
    ) -> Result<Vec<RenderedImage>, GpuError> {
        let Some(lists) = self.lists(view, 0) else {
            return Ok(Vec::new());
        };
        let shown = self.put(view).unwrap_or_default();
        let drawn = (fields.iter()).map(|colors| self.picture(view, lists, colors, &shown));
        drawn.collect()
    }

    /// Median depth of a view at full size, as [`SceneRenderer::depth`] has it.
    ///
    /// [`SceneRenderer::depth`]: crate::raster::SceneRenderer::depth
    pub(super) fn depth(&self, view: usize) -> Result<Vec<f32>, ChromaError> {
        let lists = self.lists(view, 0).ok_or(ChromaError::NoViews)?;
        let uniform = self.uniform(view, 0);
        let (pixels, tiles) = (vec![UNREACHED; uniform.pixel_count()], uniform.tile_count());
        self.put(view);
        let mut recorder = Recorder::new(self.gpu());
        self.list(view, 0, 0, &mut recorder);
        let image = blend_depth(&self.raster, lists, &pixels, tiles, &mut recorder)?;
        recorder.submit();
        Ok(depths(image.read(self.gpu())?))
    }

    /// Picture of harmonics in a view, `shown` being on the device where Gaussians wait on the
    /// host.
    fn picture(
        &self,
        view: usize,
        lists: &Lists,
        colors: &Colors<'_>,
        shown: &[usize],
    ) -> Result<RenderedImage, GpuError> {
        let gpu = &self.raster.gpu;
        let uniform = self.uniform(view, 0);
        let (pixels, tiles) = (uniform.pixel_count(), uniform.tile_count());
        let chosen;
        let field = match colors {
            Colors::Device(field) => field,
            Colors::Host(field) => {
                let mut some = field.chosen(shown);
                let planes = field.channels * sh::coefficient_count(field.degree);
                some.coefficients.resize(planes * self.geometry.count, 0.0);
                chosen = Field::upload(gpu, &some)?;
                &chosen
            }
        };
        let layer = Layer::new(&self.raster, &self.geometry, lists, field, pixels, tiles)?;
        let mut recorder = Recorder::new(gpu);
        self.list(view, 0, field.degree, &mut recorder);
        layer.record(&self.raster, &mut recorder);
        recorder.submit();
        let picture = RenderedImage {
            width: uniform.size[0],
            height: uniform.size[1],
            channels: field.kind.channels(),
            pixels: layer.read_image(gpu, pixels)?,
        };
        drop(layer);
        if self.streamed.is_some() {
            // The next one finds the room of this one.
            gpu.wait()?;
        }
        Ok(picture)
    }
}

impl HostScene {
    /// The Gaussians that a view may show, ascending.
    fn shown(&self, view: usize) -> Vec<usize> {
        self.scene.shown(&self.cameras[view])
    }

    /// The most that a view may show; one at least.
    fn most_shown(&self) -> usize {
        let shown = (0..self.cameras.len()).map(|view| self.shown(view).len());
        shown.max().unwrap_or(0).max(1)
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
