//! Scenes and stages on the device that all tests share.

use std::sync::{Arc, LazyLock};

use gs_chroma::{
    capture::Camera,
    low_level::doctor::stage,
    raster::{Projected, Raster, Status},
    splats::Splats,
};

pub use gs_chroma::low_level::doctor::stage::{Gradient, camera, splats};

use crate::kernels::oracle::{
    random::{oblique_view, random_scene},
    view::View,
};

static RASTER: LazyLock<Arc<Raster>> = LazyLock::new(|| Arc::new(Raster::new(crate::gpu())));

/// The rasterizer's kernels on the one device.
pub fn raster() -> Arc<Raster> {
    RASTER.clone()
}

pub(crate) use crate::gpu;

/// The bits of each value: equality of these is what "the same" means.
pub fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|v| v.to_bits()).collect()
}

/// Five cameras in a row.
pub fn cameras() -> Vec<Camera> {
    (0..5)
        .map(|k| {
            let view = oblique_view();
            let [x, y, z] = view.translation;
            let shift = 0.15 * f64::from(k) - 0.3;
            camera(&View {
                translation: [x + shift, y, z],
                ..view
            })
        })
        .collect()
}

/// Sixty Gaussians before them, large enough to cover one another.
pub fn overlapping<const C: usize>() -> Splats {
    let mut splats = splats(&random_scene::<C>(12, 60, 0).0);
    let scales = splats.log_scales.as_flattened_mut();
    scales.iter_mut().for_each(|scale| *scale += 0.9);
    splats
}

/// A stage on the one device.
pub struct Stage(stage::Stage);

impl std::ops::Deref for Stage {
    type Target = stage::Stage;

    fn deref(&self) -> &stage::Stage {
        &self.0
    }
}

impl std::ops::DerefMut for Stage {
    fn deref_mut(&mut self) -> &mut stage::Stage {
        &mut self.0
    }
}

impl Stage {
    pub fn new(splats: &Splats, view: &View) -> Self {
        Self(stage::Stage::new(&raster(), splats, view).unwrap())
    }

    pub fn with_capacity(splats: &Splats, view: &View, capacity: usize) -> Self {
        Self(stage::Stage::with_capacity(&raster(), splats, view, capacity).unwrap())
    }

    pub fn forward(&self) -> Vec<f32> {
        self.0.forward().unwrap()
    }

    pub fn backward(&self, upstream: &[f64]) -> Gradient {
        self.0.backward(upstream).unwrap()
    }

    pub fn image(&self) -> Vec<f32> {
        self.0.image().unwrap()
    }

    pub fn status(&self) -> Status {
        self.0.status().unwrap()
    }

    pub fn projected(&self) -> Vec<Option<Projected>> {
        self.0.projected().unwrap()
    }

    pub fn tiles(&self) -> Vec<Vec<usize>> {
        self.0.tiles().unwrap()
    }
}
