//! A wall before cameras, whose colors are known: what tests of stage 2 solve for.

use glam::{DMat3, DVec3};
use gs_chroma::{
    capture::Camera,
    chroma::{
        ChromaError, ChromaSettings, FrozenViews, IrlsSolver, MemoryBudget, Targets, Task,
        teacher::AbImage,
    },
    raster::{ColorKind, Field, Geometry, Renderer},
    splats::{ShField, Splats, sh},
};

use crate::kernels::harness::{gpu, raster};

pub const WIDTH: usize = 32;
pub const HEIGHT: usize = 24;
pub const PIXELS: usize = WIDTH * HEIGHT;

/// A camera and what is wanted in its picture.
#[derive(Clone)]
pub struct ChromaView {
    pub camera: Camera,
    pub wanted: AbImage,
    pub weights: Option<Vec<f32>>,
}

/// Frozen views, what is wanted in them, and all of it to do.
pub struct Problem {
    pub frozen: FrozenViews,
    pub targets: Targets,
    pub tasks: Vec<Task>,
}

impl Problem {
    pub fn new(luma: &Splats, views: &[ChromaView]) -> Self {
        Self::within(None, usize::MAX, luma, views).unwrap()
    }

    /// Within so many bytes of the device and of the host.
    pub fn within(
        limit: Option<u64>,
        host: usize,
        luma: &Splats,
        views: &[ChromaView],
    ) -> Result<Self, ChromaError> {
        let mut targets = Targets::within(3, host);
        let tasks = (0..)
            .zip(views)
            .map(
                |(
                    view,
                    ChromaView {
                        wanted, weights, ..
                    },
                )| {
                    let target = targets.push_ab(wanted, weights.as_deref())?;
                    Ok(Task { view, target })
                },
            )
            .collect::<Result<_, ChromaError>>()?;
        let cameras: Vec<Camera> = views.iter().map(|view| view.camera.clone()).collect();
        let room = MemoryBudget {
            limit,
            weighted: targets.weighted(),
            ..MemoryBudget::of(ColorKind::Chroma, 1)
        };
        let frozen = FrozenViews::new(&raster(), luma, 1.0, &cameras, 3, room)?;
        Ok(Self {
            frozen,
            targets,
            tasks,
        })
    }

    pub fn solver(&self, settings: &ChromaSettings) -> IrlsSolver<'_> {
        IrlsSolver::new(&self.frozen, settings, &self.targets, self.tasks.clone()).unwrap()
    }
}

pub fn chroma_view(camera: Camera, ab: Vec<[f64; 2]>) -> ChromaView {
    let wanted = AbImage {
        width: camera.width,
        height: camera.height,
        ab: ab.into_iter().map(|ab| ab.map(|v| v as f32)).collect(),
    };
    ChromaView {
        camera,
        wanted,
        weights: None,
    }
}

/// Spacing of the wall's Gaussians in world units.
pub const STEP: f64 = 0.5;
pub const COLUMNS: usize = 8;
pub const ROWS: usize = 5;

/// A wall of Gaussians that all views show; hardly anything shows through.
pub fn wall() -> Splats {
    let mut wall = Splats::default();
    for i in 0..COLUMNS * ROWS {
        let x = STEP * ((i % COLUMNS) as f64 - 0.5 * (COLUMNS - 1) as f64);
        let y = STEP * ((i / COLUMNS) as f64 - 0.5 * (ROWS - 1) as f64);
        wall.means.push([x as f32, y as f32, 4.0]);
        wall.quats.push([1.0, 0.0, 0.0, 0.0]);
        wall.log_scales.push([(0.8 * STEP).ln() as f32; 3]);
        wall.opacity_logits.push(6.0);
    }
    wall.sh = ShField::zeros(wall.len(), 0, 1);
    wall
}

/// Views of the wall from places beside each other.
pub fn cameras(count: usize) -> Vec<Camera> {
    (0..count)
        .map(|k| Camera {
            width: WIDTH as u32,
            height: HEIGHT as u32,
            fx: 40.0,
            fy: 40.0,
            cx: 16.0,
            cy: 12.0,
            rotation: DMat3::IDENTITY,
            translation: DVec3::new(0.05 * k as f64 - 0.2, 0.03 * (k % 3) as f64, 0.0),
        })
        .collect()
}

/// The same a/b in every pixel of each view.
pub fn constant_views(colors: &[[f64; 2]]) -> Vec<ChromaView> {
    (cameras(colors.len()).into_iter().zip(colors))
        .map(|(camera, &ab)| chroma_view(camera, vec![ab; PIXELS]))
        .collect()
}

/// A smooth field of color on the wall.
pub fn truth(x: f64, y: f64) -> [f64; 2] {
    [
        35.0 * (1.5 * x).sin() + 5.0,
        30.0 * (1.2 * x + 2.0 * y).cos(),
    ]
}

/// The field in the pixels of a camera before the wall.
pub fn pictured(camera: &Camera) -> Vec<[f64; 2]> {
    (0..PIXELS)
        .map(|p| {
            let [u, v] = [p % WIDTH, p / WIDTH].map(|side| side as f64 + 0.5);
            let x = (u - camera.cx) / camera.fx * 4.0 - camera.translation.x;
            let y = (v - camera.cy) / camera.fy * 4.0 - camera.translation.y;
            truth(x, y)
        })
        .collect()
}

/// a/b of each Gaussian.
pub fn colors(chroma: &ShField) -> Vec<[f64; 2]> {
    (chroma.coefficients.chunks_exact(2))
        .map(|ab| [0, 1].map(|c| sh::C0 * f64::from(ab[c])))
        .collect()
}

/// The wall's picture.
pub fn drawn(chroma: &ShField, camera: &Camera) -> Vec<[f64; 2]> {
    let geometry = Geometry::upload(gpu(), &wall()).unwrap();
    let field = Field::upload(gpu(), chroma).unwrap();
    let mut renderer = Renderer::new(raster(), geometry, vec![field], 0.01).unwrap();
    let picture = renderer.render(camera).unwrap().remove(0);
    (picture.pixels.chunks_exact(2))
        .map(|ab| [0, 1].map(|c| f64::from(ab[c])))
        .collect()
}

/// Those of the Gaussians in the middle, which every view shows whole.
pub fn inner(chroma: &ShField) -> Vec<[f64; 2]> {
    let inner = |i: &usize| {
        let (column, row) = (i % COLUMNS, i / COLUMNS);
        (2..COLUMNS - 2).contains(&column) && (1..ROWS - 1).contains(&row)
    };
    let colors = colors(chroma);
    (0..colors.len()).filter(inner).map(|i| colors[i]).collect()
}

/// The largest difference of a channel.
pub fn farthest(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let pairs = a.as_flattened().iter().zip(b.as_flattened());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

pub fn settings() -> ChromaSettings {
    ChromaSettings {
        correct_views: false,
        ..ChromaSettings::irls()
    }
}

/// Six views of the wall, every other one with weights.
pub fn six_views() -> Vec<ChromaView> {
    (cameras(6).into_iter().enumerate())
        .map(|(k, camera)| {
            let mut view = chroma_view(camera.clone(), pictured(&camera));
            let weights = (0..PIXELS).map(|p| [1.0, 0.5, 50.0][p % 3]);
            view.weights = (k % 2 == 0).then(|| weights.collect());
            view
        })
        .collect()
}
