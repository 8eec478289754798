//! The geometry before all cameras, at all scales: uploaded once, projected and listed
//! once where the device has room, and lent to whoever solves or draws on it. Where it has no
//! room for all Gaussians, they wait on the host, and those that a view may show come for it.

use std::{
    collections::{BTreeMap, btree_map::Entry},
    sync::Arc,
};

use super::{
    ChromaError, ChromaKernels,
    field::{DrawBuffers, Drawing, FrozenField, Primitives},
    frozen_view::Frozen,
    memory::{Demand, MemoryBudget, MinimumMemory},
};
use crate::{
    capture::Camera,
    gpu::{Gpu, GpuError, Recorder},
    raster::{
        AdjointScratch, Canvas, ChromaAdjoint, Geometry, Layer, Lists, Load, Raster, Streamed,
        UNREACHED, ViewUniform, blend_depth, constants::NEAR_SHARE, depths,
    },
    splats::Splats,
};

/// Counts that are on their way from the device at a time.
const IN_FLIGHT: usize = 64;

/// Gaussians that wait on the host, and their cameras.
struct HostScene {
    scene: Streamed,
    /// Cameras of the views.
    cameras: Vec<Camera>,
}

/// Gaussians with frozen geometry before cameras.
pub struct FrozenViews {
    raster: Arc<Raster>,
    kernels: ChromaKernels,
    primitives: Arc<Primitives>,
    /// Geometry of all Gaussians, or of those that the view before showed.
    geometry: Geometry,
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
        let pinned = demand.pinned(room.limit)?;
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
            primitives: Arc::new(Primitives::from(splats)),
            demand: demand.bytes(pinned),
            streamed,
            geometry,
            views,
            pinned,
            spare,
        })
    }

    fn uniform(&self, view: usize, scale: usize) -> &ViewUniform {
        &self.views[view][scale].uniform
    }

    /// A view whose lists stay on the device.
    fn stays(&self, view: usize) -> Option<usize> {
        (view < self.pinned).then_some(view)
    }

    /// The lists that a view is drawn with.
    fn lists(&self, view: usize, scale: usize) -> Option<&Lists> {
        self.views[view][scale]
            .lists
            .as_ref()
            .or(self.spare.as_ref())
    }

    /// Makes a view's lists hold it, to draw harmonics of `sh_degree`.
    fn list(&self, view: usize, scale: usize, sh_degree: u32, recorder: &mut Recorder) {
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
}

impl FrozenField for FrozenViews {
    fn gpu(&self) -> &Gpu {
        &self.raster.gpu
    }

    fn kernels(&self) -> &ChromaKernels {
        &self.kernels
    }

    fn primitives(&self) -> &Arc<Primitives> {
        &self.primitives
    }

    fn views(&self) -> usize {
        self.views.len()
    }

    fn size(&self, view: usize, scale: usize) -> [u32; 2] {
        self.uniform(view, scale).size
    }

    fn bind<'a>(
        &'a self,
        views: &[usize],
        buffers: &DrawBuffers<'_>,
    ) -> Result<Box<dyn Drawing + 'a>, ChromaError> {
        Ok(Box::new(GaussianDrawing::new(self, views, buffers)?))
    }

    fn depth(&self, view: usize) -> Result<Vec<f32>, ChromaError> {
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

    fn pinned(&self) -> usize {
        self.pinned
    }

    fn demand(&self) -> u64 {
        self.demand
    }

    fn streamed(&self) -> Option<usize> {
        self.streamed.as_ref().map(|_| self.geometry.count)
    }

    fn put(&self, view: usize) -> Option<Vec<usize>> {
        let on_host = self.streamed.as_ref()?;
        let shown = on_host.shown(view);
        self.geometry.put(self.gpu(), &on_host.scene.chosen(&shown));
        Some(shown)
    }

    /// Makes the lists that stay anew: a Gaussian whose color could not be drawn, as a step that
    /// goes too far has them, was taken out of them.
    fn restore(&self, sh_degree: u32) {
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

    fn load(&self, views: &[usize], scales: usize) -> Load {
        let passes = views.iter().flat_map(|&view| &self.views[view][..scales]);
        let passes: Vec<&Frozen> = passes.collect();
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
}

/// The layer of a view at a scale, and its adjoint where it is needed.
type Bound = (Layer, Option<ChromaAdjoint>);

/// Views of Gaussians that are drawn with certain buffers.
struct GaussianDrawing<'a> {
    frozen: &'a FrozenViews,
    sh_degree: u32,
    /// `[scales]` of each view that stays, and once for all that take turns.
    bound: BTreeMap<Option<usize>, Vec<Bound>>,
}

impl<'a> GaussianDrawing<'a> {
    fn new(
        frozen: &'a FrozenViews,
        views: &[usize],
        buffers: &DrawBuffers<'_>,
    ) -> Result<Self, ChromaError> {
        let &DrawBuffers {
            field,
            images,
            adjoint,
        } = buffers;
        let (raster, geometry) = (&frozen.raster, &frozen.geometry);
        let (gpu, count, scales) = (&raster.gpu, geometry.count, images.len());
        let canvas = |image| Canvas::of(gpu, field.kind, count, image);
        let canvases = images.iter().map(canvas).collect::<Result<Vec<_>, _>>()?;
        let all = (views.iter()).flat_map(|&view| (0..scales).map(move |scale| (view, scale)));
        let lists = |(view, scale)| frozen.lists(view, scale);
        let capacity = all.filter_map(lists).map(|lists| lists.capacity).max();
        let scratch = |_| AdjointScratch::color(gpu, count, capacity.unwrap_or(0));
        let scratch = adjoint.map(scratch).transpose()?;
        let bind = |lists: &Lists, canvas: Canvas| -> Bound {
            let layer = Layer::on(raster, geometry, lists, field, canvas, lists.max_tiles());
            let back = adjoint
                .zip(scratch.clone())
                .map(|((gradient, sums), scratch)| {
                    ChromaAdjoint::new(raster, geometry, lists, &layer, gradient, scratch, sums)
                });
            (layer, back)
        };
        let mut bound = BTreeMap::new();
        for &view in views {
            let Entry::Vacant(place) = bound.entry(frozen.stays(view)) else {
                continue;
            };
            let scales = canvases.iter().enumerate().map(|(scale, canvas)| {
                let lists = frozen.lists(view, scale).ok_or(ChromaError::NoViews)?;
                Ok(bind(lists, canvas.clone()))
            });
            place.insert(scales.collect::<Result<_, ChromaError>>()?);
        }
        Ok(Self {
            frozen,
            sh_degree: field.degree,
            bound,
        })
    }
}

impl Drawing for GaussianDrawing<'_> {
    fn draw(&self, view: usize, scale: usize, recorder: &mut Recorder) -> Result<(), ChromaError> {
        let (layer, _) = &self.bound[&self.frozen.stays(view)][scale];
        self.frozen.list(view, scale, self.sh_degree, recorder);
        layer.record(&self.frozen.raster, recorder);
        Ok(())
    }

    fn adjoint(
        &self,
        view: usize,
        scale: usize,
        recorder: &mut Recorder,
    ) -> Result<(), ChromaError> {
        if let (_, Some(adjoint)) = &self.bound[&self.frozen.stays(view)][scale] {
            adjoint.record(&self.frozen.raster, recorder);
        }
        Ok(())
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
