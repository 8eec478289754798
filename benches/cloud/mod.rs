//! Gaussians at random before a camera, as several benchmarks time them.

use glam::{DMat3, DVec3};
use gs_chroma::{
    capture::Camera,
    oracle::random::Random,
    splats::{ShField, Splats, sh},
};

/// Gaussians that cover each pixel.
const OVERDRAW: f64 = 8.0;

/// Standard deviations to where a Gaussian of opacity 0.5 is seen: √(2 ln 127).
const REACH: f64 = 3.1;

/// A camera at the origin that looks along z, 16 by 9.
pub fn camera(width: u32) -> Camera {
    let height = width * 9 / 16;
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

/// Gaussians that fill the camera's view, as wide as lets eight cover each pixel: finer
/// where there are more, as in scenes.
pub fn cloud(count: usize, camera: &Camera, degree: u32) -> Splats {
    let mut random = Random::new(1);
    let pixels = f64::from(camera.width) * f64::from(camera.height);
    let deviation =
        (OVERDRAW * pixels / (std::f64::consts::PI * REACH * REACH * count as f64)).sqrt();
    let (mut means, mut log_scales) = (Vec::new(), Vec::new());
    for _ in 0..count {
        let depth = random.range(2.0, 6.0);
        let x = random.range(0.0, f64::from(camera.width)) - camera.cx;
        let y = random.range(0.0, f64::from(camera.height)) - camera.cy;
        means.push([x * depth / camera.fx, y * depth / camera.fy, depth].map(|v| v as f32));
        let width = (deviation * depth / camera.fx).ln();
        log_scales.push([0.0; 3].map(|_: f64| (width + random.range(-0.7, 0.7)) as f32));
    }
    let random_floats = |random: &mut Random, n: usize| -> Vec<f32> {
        (0..n).map(|_| random.range(-1.0, 1.0) as f32).collect()
    };
    Splats {
        means,
        quats: (0..count)
            .map(|_| random.array(-1.0, 1.0).map(|v| v as f32))
            .collect(),
        log_scales,
        opacity_logits: random_floats(&mut random, count),
        sh: ShField {
            degree,
            channels: 1,
            coefficients: random_floats(&mut random, count * sh::coefficient_count(degree)),
        },
    }
}

/// The middle one of several values, the upper one of two.
pub fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}
