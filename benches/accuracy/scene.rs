//! Subjects of the measurement: random Gaussians, or those of a run with its photos.

use glam::DMat3;
use gs_chroma::{
    capture::{Camera, Capture, LoadOptions, Loader, split},
    low_level::{
        RunFolder,
        oracle::{
            numerics::Numerics,
            random::{Random, round},
            render::render,
            scene::{Gaussian, Scene},
            shade::Shading,
            view::View,
        },
    },
    luma::TrainingView,
    raster::constants::NEAR_SHARE,
    splats::{Splats, ply},
};

use crate::{
    Fallible,
    cloud::{camera, cloud},
};

/// Gaussians before cameras, twice: small for the oracle, larger for the clock.
pub struct Subject {
    /// Name in the table.
    pub name: String,
    /// World units.
    pub extent: f64,
    /// Gaussians that the oracle draws.
    pub small: Splats,
    /// Camera and photo of the oracle's picture.
    pub view: TrainingView,
    /// Gaussians that are timed.
    pub large: Splats,
    /// The photos they are trained on.
    pub views: Vec<TrainingView>,
}

/// Longer side of the oracle's pictures in pixels.
const SMALL_SIDE: u32 = 160;

impl Subject {
    /// Gaussians before a camera; for the clock as many again behind it, before a second
    /// one that looks there, so that each view shows half of them.
    pub fn random(quick: bool) -> Self {
        let (count, width) = if quick { (3_000, 240) } else { (10_000, 400) };
        let small_camera = camera(SMALL_SIDE);
        let small = cloud(2_000, &small_camera, 1);
        let gray = photo(&small, &small_camera);
        let front = camera(width);
        let back = Camera {
            rotation: DMat3::from_diagonal(glam::DVec3::new(-1.0, 1.0, -1.0)),
            ..front.clone()
        };
        let mut large = cloud(count, &front, 3);
        let mut behind = large.clone();
        for mean in &mut behind.means {
            *mean = [-mean[0], mean[1], -mean[2]];
        }
        large.append(behind);
        let mut random = Random::new(2);
        let views = [front, back].map(|camera| {
            let pixels = camera.width * camera.height;
            let gray = (0..pixels).map(|_| random.bits() as u8).collect();
            TrainingView::new(camera, gray)
        });
        Self {
            name: "random".to_owned(),
            extent: 5.0,
            small,
            view: TrainingView::new(small_camera, gray),
            large,
            views: views.into(),
        }
    }

    /// The Gaussians of a run before its own cameras.
    pub fn trained(folder: &RunFolder) -> Fallible<Self> {
        let report = folder.read_report()?;
        let options = report.capture.load.clone();
        let capture = Capture::load_with(report.capture.path.as_ref(), &options)?;
        let splats = ply::read_ply(&folder.luma())?.splats.to_luma();
        let train = split(&capture.views, options.holdout).train;
        let load = |options: &LoadOptions, chosen: &[usize]| -> Fallible<Vec<TrainingView>> {
            let loader = Loader::open(&capture, options)?;
            (chosen.iter())
                .map(|&i| {
                    let (photo, camera) = loader.load(&capture.views[i])?;
                    Ok(TrainingView::new(camera, photo.gray))
                })
                .collect()
        };
        let views = load(&options, &train)?;
        let small = LoadOptions {
            max_side: Some(SMALL_SIDE),
            ..options.clone()
        };
        let view = load(&small, &train[..1])?.remove(0);
        let name = (folder.path().file_name()).map_or("run".into(), |name| name.to_string_lossy());
        Ok(Self {
            name: name.into_owned(),
            extent: capture.extent(),
            small: splats.clone(),
            view,
            large: splats,
            views,
        })
    }

    /// Nothing nearer is drawn, in world units.
    pub fn near(&self) -> f64 {
        NEAR_SHARE * self.extent
    }
}

/// A photo of nearly the same scene: every Gaussian is a little elsewhere, as in a
/// training that is under way.
fn photo(splats: &Splats, camera: &Camera) -> Vec<u8> {
    let mut random = Random::new(3);
    let mut moved = splats.clone();
    for (mean, log_scales) in moved.means.iter_mut().zip(&splats.log_scales) {
        let width = 0.5 * log_scales[0].exp();
        *mean = mean.map(|x| x + width * random.range(-1.0, 1.0) as f32);
    }
    let view = oracle_view(camera, 0.05, Numerics::DEFAULT);
    (render(&widened(&moved), &view, Shading::Offset).iter())
        .map(|pixel| (pixel[0].clamp(0.0, 1.0) * 255.0).round() as u8)
        .collect()
}

/// A camera as the oracle has it, with the kernels' rounding.
pub fn oracle_view(camera: &Camera, near: f64, numerics: Numerics) -> View {
    let rotation = camera.rotation;
    View {
        rotation: [0, 1, 2].map(|row| rotation.row(row).to_array().map(round)),
        translation: camera.translation.to_array().map(round),
        fx: round(camera.fx),
        fy: round(camera.fy),
        cx: round(camera.cx),
        cy: round(camera.cy),
        width: camera.width as usize,
        height: camera.height as usize,
        near: round(near),
        antialiased: false,
        numerics,
    }
}

/// Gaussians as the oracle has them.
pub fn widened(splats: &Splats) -> Scene<f64, 1> {
    let gaussians = (0..splats.len()).map(|i| Gaussian {
        mean: splats.means[i].map(f64::from),
        quat: splats.quats[i].map(f64::from),
        log_scale: splats.log_scales[i].map(f64::from),
        opacity_logit: f64::from(splats.opacity_logits[i]),
        sh: (splats.sh.of(i).iter())
            .map(|&value| [f64::from(value)])
            .collect(),
    });
    Scene::of(splats.sh.degree as usize, gaussians)
}
