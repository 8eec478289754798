//! The device that all tests share, and one view of one scene on it.

use std::sync::{Arc, LazyLock};

use glam::{DMat3, DVec3};
use gs_chroma::{
    capture::Camera,
    gpu::{Buffer, Gpu, Recorder},
    raster::{
        Field, Geometry, Layer, LayerAdjoint, Lists, Projected, Raster, Status, ViewUniform,
        constants::*,
    },
    splats::{ShField, Splats},
};

use crate::oracle::scene::{Scene, View};

static RASTER: LazyLock<Arc<Raster>> = LazyLock::new(|| {
    let gpu = Gpu::open().unwrap_or_else(|error| panic!("{error}"));
    Arc::new(Raster::new(&gpu))
});

/// The rasterizer's kernels on the one device.
pub fn raster() -> Arc<Raster> {
    RASTER.clone()
}

/// The one device.
pub fn gpu() -> &'static Gpu {
    &RASTER.gpu
}

/// The bits of each value: equality of these is what "the same" means.
pub fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|v| v.to_bits()).collect()
}

/// The oracle's view as a camera.
pub fn camera(view: &View) -> Camera {
    Camera {
        width: view.width as u32,
        height: view.height as u32,
        fx: view.fx,
        fy: view.fy,
        cx: view.cx,
        cy: view.cy,
        rotation: DMat3::from_cols_array_2d(&view.rotation).transpose(),
        translation: DVec3::from_array(view.translation),
    }
}

/// The oracle's scene as splats; its values are exact in `f32`.
pub fn splats<const C: usize>(scene: &Scene<f64, C>) -> Splats {
    fn narrow<const K: usize>(rows: &[[f64; K]]) -> Vec<[f32; K]> {
        rows.iter().map(|row| row.map(|v| v as f32)).collect()
    }
    Splats {
        means: narrow(&scene.means),
        quats: narrow(&scene.quats),
        log_scales: narrow(&scene.log_scales),
        opacity_logits: scene.opacity_logits.iter().map(|&v| v as f32).collect(),
        sh: ShField {
            degree: scene.degree as u32,
            channels: C,
            coefficients: scene.sh.iter().flatten().map(|&v| v as f32).collect(),
        },
    }
}

/// One scene before one camera, with all its buffers.
pub struct Stage {
    pub view: ViewUniform,
    pub lists: Lists,
    pub layer: Layer,
    count: usize,
    adjoint: Option<LayerAdjoint>,
}

impl Stage {
    /// A stage with room for every Gaussian in every tile.
    pub fn new(splats: &Splats, view: &View) -> Self {
        let tiles = view.width.div_ceil(16) * view.height.div_ceil(16);
        Self::with_capacity(splats, view, splats.len() * tiles)
    }

    /// A stage with room for so many tile-list entries.
    pub fn with_capacity(splats: &Splats, view: &View, capacity: usize) -> Self {
        let (raster, near) = (raster(), view.near);
        let degree = splats.sh.degree;
        let view = ViewUniform::new(&camera(view), near, splats.len(), degree);
        let (pixels, tiles) = (view.pixel_count(), view.tile_count());
        let geometry = Geometry::upload(gpu(), splats).unwrap();
        let field = Field::upload(gpu(), &splats.sh).unwrap();
        let lists = Lists::new(&raster, &geometry, tiles, capacity).unwrap();
        let layer = Layer::new(&raster, &geometry, &lists, &field, pixels, tiles).unwrap();
        let adjoint = (field.kind.channels() < 3).then(|| {
            let gradient = Buffer::zeros(gpu(), "field gradient", field.planes.len()).unwrap();
            LayerAdjoint::new(&raster, &geometry, &lists, &field, &layer, gradient).unwrap()
        });
        Self {
            view,
            lists,
            layer,
            count: splats.len(),
            adjoint,
        }
    }

    fn record(&self) -> Recorder {
        let mut recorder = Recorder::new(gpu());
        self.lists.set_view(gpu(), &self.view);
        self.lists.record(&raster(), &mut recorder);
        self.layer.record(&raster(), &mut recorder);
        recorder
    }

    /// Draws, and gives the picture `[pixels, channels]`.
    pub fn forward(&self) -> Vec<f32> {
        self.record().submit();
        self.image()
    }

    /// Draws, and differentiates `Σ upstream · picture`; `upstream` is
    /// `[pixels, channels]`.
    pub fn backward(&self, upstream: &[f64]) -> Gradient {
        let adjoint = self.adjoint.as_ref().expect("RGB is not trained");
        let narrow: Vec<f32> = upstream.iter().map(|&v| v as f32).collect();
        adjoint.image_gradient.write(gpu(), &narrow);
        let mut recorder = self.record();
        adjoint.record(&raster(), &mut recorder);
        recorder.submit();
        let geometry = adjoint.geometry.as_ref();
        Gradient {
            count: self.count,
            geometry: geometry.map_or(Vec::new(), |g| g.gradient.read(gpu()).unwrap()),
            statistics: geometry.map_or(Vec::new(), |g| g.statistics.read(gpu()).unwrap()),
            field: adjoint.field_gradient.read(gpu()).unwrap(),
        }
    }

    /// The picture last drawn.
    pub fn image(&self) -> Vec<f32> {
        let pixels = self.view.pixel_count();
        self.layer.read_image(gpu(), pixels).unwrap()
    }

    pub fn status(&self) -> Status {
        self.lists.status(gpu()).unwrap()
    }

    /// The projection of each Gaussian, none where it is not visible.
    pub fn projected(&self) -> Vec<Option<Projected>> {
        let ranks = self.lists.ranks.read(gpu()).unwrap();
        let projected = self.lists.projected.read(gpu()).unwrap();
        (ranks.into_iter().zip(projected))
            .map(|(rank, projected)| (rank != u32::MAX).then_some(projected))
            .collect()
    }

    /// The Gaussians of each tile in the order in which they are blended.
    pub fn tiles(&self) -> Vec<Vec<usize>> {
        let read = |buffer: &Buffer<u32>| buffer.read(gpu()).unwrap();
        let (slots, starts) = (read(self.lists.slots()), read(&self.lists.starts));
        let splats = read(&self.lists.instance_splats);
        (starts.windows(2))
            .map(|span| &slots[span[0] as usize..span[1] as usize])
            .map(|slots| slots.iter().map(|&s| splats[s as usize] as usize).collect())
            .collect()
    }
}

/// What the adjoint leaves, as planes.
#[derive(PartialEq)]
pub struct Gradient {
    count: usize,
    /// `[11, N]`; empty for chroma.
    pub geometry: Vec<f32>,
    /// `[2, N]`; empty for chroma.
    pub statistics: Vec<f32>,
    /// `[(degree + 1)², channels, N]`.
    pub field: Vec<f32>,
}

impl Gradient {
    /// The groups of parameters with their names, each `[N, …]` as the oracle
    /// has it; chroma has the last one only.
    pub fn groups(&self) -> Vec<(&'static str, Vec<f64>)> {
        let field_planes = self.field.len() / self.count;
        let mut groups = Vec::new();
        if !self.geometry.is_empty() {
            for (name, first, end) in [
                ("means", PLANE_MEAN, PLANE_QUAT),
                ("quats", PLANE_QUAT, PLANE_LOG_SCALE),
                ("log_scales", PLANE_LOG_SCALE, PLANE_OPACITY),
                ("opacity_logits", PLANE_OPACITY, GEOMETRY_PLANES),
            ] {
                groups.push((name, self.rows(&self.geometry, first..end)));
            }
        }
        groups.push(("sh", self.rows(&self.field, 0..field_planes)));
        groups
    }

    fn rows(&self, planes: &[f32], span: std::ops::Range<usize>) -> Vec<f64> {
        (0..self.count)
            .flat_map(|i| span.clone().map(move |plane| (plane, i)))
            .map(|(plane, i)| f64::from(planes[plane * self.count + i]))
            .collect()
    }

    /// All planes without those of Gaussian `index`, as bits.
    pub fn bits_without(&self, index: Option<usize>) -> Vec<u32> {
        let planes = [&self.geometry, &self.statistics, &self.field];
        (planes
            .into_iter()
            .flat_map(|planes| planes.iter().enumerate()))
        .filter(|(at, _)| Some(at % self.count) != index)
        .map(|(_, value)| value.to_bits())
        .collect()
    }
}
