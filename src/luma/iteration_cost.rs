//! Estimated time of an iteration on this device, before a scene exists.

use std::{sync::Arc, time::Instant};

use glam::{DMat3, DVec3};

use super::{LumaError, LumaSettings, LumaTrainer, TrainingView};
use crate::{
    capture::Camera,
    raster::Raster,
    splats::{ShField, Splats, sh},
};

/// Iterations that are timed; as many before them find room for the lists and let the
/// driver compile what it puts off.
const ITERATIONS: usize = 4;

/// Gaussians that cover each pixel.
const OVERDRAW: f64 = 8.0;

/// Standard deviations to where a Gaussian of opacity 0.5 is seen: √(2 ln 127).
const REACH: f64 = 3.1;

/// Gaussians at random that fill the view of `camera`, which looks along its axis from the
/// origin: as wide as lets eight cover each pixel, finer where there are more, as in scenes.
/// Luma has harmonics of `sh_degree`.
pub fn random_cloud(count: usize, camera: &Camera, sh_degree: u32) -> Splats {
    let mut random = fastrand::Rng::with_seed(1);
    let mut range = |low: f64, high: f64| low + (high - low) * random.f64();
    let pixels = f64::from(camera.width) * f64::from(camera.height);
    let deviation =
        (OVERDRAW * pixels / (std::f64::consts::PI * REACH * REACH * count as f64)).sqrt();
    let (mut means, mut log_scales) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let depth = range(2.0, 6.0);
        let x = range(0.0, f64::from(camera.width)) - camera.cx;
        let y = range(0.0, f64::from(camera.height)) - camera.cy;
        means.push([x * depth / camera.fx, y * depth / camera.fy, depth].map(|v| v as f32));
        let width = (deviation * depth / camera.fx).ln();
        log_scales.push([0.0; 3].map(|_: f64| (width + range(-0.7, 0.7)) as f32));
    }
    let mut value = || range(-1.0, 1.0) as f32;
    Splats {
        means,
        log_scales,
        quats: (0..count).map(|_| [0.0; 4].map(|_: f32| value())).collect(),
        opacity_logits: (0..count).map(|_| value()).collect(),
        sh: ShField {
            degree: sh_degree,
            channels: 1,
            coefficients: (0..count * sh::coefficient_count(sh_degree))
                .map(|_| value())
                .collect(),
        },
    }
}

/// A camera at the origin of 53° across.
pub fn frontal_camera(width: u32, height: u32) -> Camera {
    Camera {
        width,
        height,
        fx: f64::from(width),
        fy: f64::from(width),
        cx: f64::from(width) / 2.0,
        cy: f64::from(height) / 2.0,
        rotation: DMat3::IDENTITY,
        translation: DVec3::ZERO,
    }
}

/// Seconds of an iteration with so many random Gaussians and pixels.
///
/// # Errors
/// [`LumaError::Gpu`] when the device cannot hold them.
pub fn seconds_per_iteration(
    raster: &Arc<Raster>,
    splats: usize,
    size: [u32; 2],
) -> Result<f64, LumaError> {
    let camera = frontal_camera(size[0], size[1]);
    let settings = LumaSettings {
        sh_degree: 0,
        max_splats: splats,
        ..LumaSettings::new(ITERATIONS)
    };
    let cloud = random_cloud(splats, &camera, 0);
    let mut random = fastrand::Rng::with_seed(2);
    let gray = (0..camera.width * camera.height)
        .map(|_| random.u8(..))
        .collect();
    let views = vec![TrainingView::new(camera, gray)];
    let mut trainer = LumaTrainer::new(raster.clone(), settings, 5.0, &cloud, views)?;
    trainer.train(&mut |_| {})?;
    let begun = Instant::now();
    trainer.train(&mut |_| {})?;
    Ok(begun.elapsed().as_secs_f64() / ITERATIONS as f64)
}
