//! Gaussians for tests.

use super::{ShField, Splats, sh};

/// So many Gaussians of every shape, within 4 units of the origin, of all channels' RGB, colors
/// and harmonics within the range of every format.
pub(crate) fn scattered(count: usize, degree: u32) -> Splats {
    let mut random = fastrand::Rng::with_seed(3);
    let mut within = |low: f32, high: f32| low + (high - low) * random.f32();
    let mut splats = Splats {
        sh: ShField::zeros(count, degree, 3),
        ..Splats::default()
    };
    for index in 0..count {
        splats.means.push([(); 3].map(|()| within(-4.0, 4.0)));
        let quaternion = [(); 4].map(|()| within(-1.0, 1.0));
        let norm = quaternion.iter().map(|q| q * q).sum::<f32>().sqrt();
        splats.quats.push(quaternion.map(|q| q / norm));
        splats.log_scales.push([(); 3].map(|()| within(-5.0, -2.0)));
        splats.opacity_logits.push(within(-4.0, 4.0));
        let stride = sh::coefficient_count(degree) * 3;
        for (place, value) in splats.sh.coefficients[index * stride..][..stride]
            .iter_mut()
            .enumerate()
        {
            *value = if place < 3 {
                within(-1.6, 1.6)
            } else {
                within(-0.6, 0.6)
            };
        }
    }
    splats
}

/// A row of gray Gaussians one unit apart.
pub(crate) fn row(grays: &[f32]) -> Splats {
    let count = grays.len();
    Splats {
        means: (0..count).map(|i| [i as f32, 0.0, 0.0]).collect(),
        quats: vec![[1.0, 0.0, 0.0, 0.0]; count],
        log_scales: vec![[0.0; 3]; count],
        opacity_logits: vec![0.0; count],
        sh: ShField {
            degree: 0,
            channels: 1,
            coefficients: grays.iter().map(|g| (g - 0.5) / sh::C0 as f32).collect(),
        },
    }
}
