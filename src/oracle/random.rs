//! Repeatable random scenes. Every value is an `f32` widened to `f64`, so a
//! kernel and the oracle see the same input.

use super::constants::SH_C0;
use super::linear::{apply, rotation, transpose};
use super::numerics::Numerics;
use super::scene::{Gaussian, Scene};
use super::shade::Shading;
use super::view::View;

/// SplitMix64 (Steele, Lea, Flood 2014).
pub struct Random(u64);

impl Random {
    /// A generator; equal seeds give equal sequences.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next 64 bits.
    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform in `low..high`, rounded to `f32`.
    pub fn range(&mut self, low: f64, high: f64) -> f64 {
        let unit = (self.bits() >> 11) as f64 / (1_u64 << 53) as f64;
        round(low + (high - low) * unit)
    }

    /// Uniform in each of `N` places.
    pub fn array<const N: usize>(&mut self, low: f64, high: f64) -> [f64; N] {
        std::array::from_fn(|_| self.range(low, high))
    }
}

/// The nearest `f32`, as `f64`.
pub fn round(value: f64) -> f64 {
    f64::from(value as f32)
}

/// A view of 48×40 pixels that is turned, shifted and off-center.
pub fn oblique_view() -> View {
    let quat = [0.9, 0.2, -0.3, 0.1_f64];
    let norm = quat.iter().map(|q| q * q).sum::<f64>().sqrt();
    let rotation = rotation(quat.map(|q| q / norm));
    View {
        rotation: rotation.map(|row| row.map(round)),
        translation: [0.3, -0.2, 0.5].map(round),
        fx: 52.0,
        fy: 47.5,
        cx: 25.25,
        cy: 18.5,
        width: 48,
        height: 40,
        near: round(0.1),
        antialiased: false,
        numerics: Numerics::DEFAULT,
    }
}

/// `count` Gaussians before [`oblique_view`], and that view.
///
/// Footprints have half extents of about 1 to 17 px and aspect ratios up to
/// 7, opacities lie in 0.02..0.98, depths in 1.5..6 at least 1e-4 (relative)
/// apart; some centers lie outside the image, a few beyond the reach of the
/// Jacobian. No Gaussian is within 1e-3 of a decision of its own
/// ([`Gaussian::margin`]); for those of the pixels see
/// [`decision_margin`](super::render::decision_margin). Harmonics suit
/// [`Shading::of_channels`]: colors about 0..1, or ±40 Lab units for C = 2.
pub fn random_scene<const C: usize>(
    seed: u64,
    count: usize,
    degree: usize,
) -> (Scene<f64, C>, View) {
    let view = oblique_view();
    (random_scene_before(&view, seed, count, degree), view)
}

/// A view of some odd size, 17 to 80 pixels a side, from anywhere.
pub fn random_view(seed: u64) -> View {
    let mut random = Random::new(seed ^ 0x5eed);
    let quat = random.array::<4>(-1.0, 1.0);
    let norm = quat.iter().map(|q| q * q).sum::<f64>().sqrt();
    let (width, height) = (
        17 + random.bits() as usize % 64,
        17 + random.bits() as usize % 64,
    );
    View {
        rotation: rotation(quat.map(|q| q / norm)).map(|row| row.map(round)),
        translation: random.array(-3.0, 3.0),
        fx: random.range(40.0, 70.0),
        fy: random.range(40.0, 70.0),
        cx: width as f64 * random.range(0.4, 0.6),
        cy: height as f64 * random.range(0.4, 0.6),
        width,
        height,
        near: round(0.1),
        antialiased: false,
        numerics: Numerics::DEFAULT,
    }
}

/// As [`random_scene`], before another view.
pub fn random_scene_before<const C: usize>(
    view: &View,
    seed: u64,
    count: usize,
    degree: usize,
) -> Scene<f64, C> {
    let mut random = Random::new(seed);
    let mut scene = Scene::empty(degree);
    let mut depths: Vec<f64> = Vec::new();
    while scene.len() < count {
        let depth = random.range(1.5, 6.0);
        let gaussian = random_gaussian(&mut random, view, depth, degree);
        let apart = depths.iter().all(|d| (d / depth - 1.0).abs() > 1e-4);
        if apart && gaussian.margin(view, Shading::of_channels(C)) > 1e-3 {
            depths.push(depth);
            scene.push(gaussian);
        }
    }
    scene
}

fn random_gaussian<const C: usize>(
    random: &mut Random,
    view: &View,
    depth: f64,
    degree: usize,
) -> Gaussian<f64, C> {
    let u = random.range(-10.0, view.width as f64 + 10.0);
    let v = random.range(-10.0, view.height as f64 + 10.0);
    let in_camera = [
        (u - view.cx) / view.fx * depth,
        (v - view.cy) / view.fy * depth,
        depth,
    ];
    let offset = std::array::from_fn(|row| in_camera[row] - view.translation[row]);
    let mean = apply(&transpose(view.rotation), &offset).map(round);
    let log_scale = [(); 3].map(|()| {
        let log_pixels = random.range(0.7_f64.ln(), 5.0_f64.ln());
        round(log_pixels + (depth / view.fx).ln())
    });
    let length = random.range(0.5, 2.0);
    let quat = loop {
        let quat = random.array::<4>(-1.0, 1.0);
        let norm = quat.iter().map(|q| q * q).sum::<f64>().sqrt();
        if (0.1..1.0).contains(&norm) {
            break quat.map(|q| round(q / norm * length));
        }
    };
    let opacity = random.range(0.02, 0.98);
    let (low, high) = if C == 2 { (-40.0, 40.0) } else { (-0.45, 0.5) };
    let sh = (0..(degree + 1).pow(2))
        .map(|k| {
            let share = if k == 0 { 1.0 } else { 0.25 };
            random
                .array::<C>(low, high)
                .map(|c| round(c * share / SH_C0))
        })
        .collect();
    Gaussian {
        mean,
        quat,
        log_scale,
        opacity_logit: round((opacity / (1.0 - opacity)).ln()),
        sh,
    }
}

/// `count` nearly opaque Gaussians one behind the other in the middle of
/// [`oblique_view`]: alphas reach their cap and pixels their floor.
pub fn opaque_stack<const C: usize>(
    seed: u64,
    count: usize,
    degree: usize,
) -> (Scene<f64, C>, View) {
    let (mut scene, view) = random_scene::<C>(seed, count, degree);
    let center = view.center();
    for i in 0..count {
        let depth = 1.5 + 4.5 * i as f64 / count as f64;
        scene.means[i] = std::array::from_fn(|k| round(center[k] + depth * view.rotation[2][k]));
        scene.opacity_logits[i] = round(3.0 + 4.0 * (i % 3) as f64);
    }
    (scene, view)
}

#[cfg(test)]
mod tests {
    use super::super::render::{decision_margin, render_pixels};
    use super::*;

    #[test]
    fn known_sequence() {
        // First output of SplitMix64 for the seed 0.
        assert_eq!(Random::new(0).bits(), 0xe220_a839_7b1d_cdaf);
    }

    #[test]
    fn scenes_repeat_and_differ_by_seed() {
        let a = random_scene::<1>(7, 20, 2).0;
        assert_eq!(a, random_scene::<1>(7, 20, 2).0);
        assert_ne!(a, random_scene::<1>(8, 20, 2).0);
        assert_eq!(a.sh.len(), 20 * 9);
        let exact = |v: &f64| round(*v) == *v;
        assert!(a.means.iter().flatten().all(exact));
        assert!(a.sh.iter().flatten().all(exact));
    }

    #[test]
    fn scenes_cover_what_they_promise() {
        let (scene, view) = random_scene::<1>(1, 200, 3);
        let projected: Vec<_> = (0..200).map(|i| scene.gaussian(i).project(&view)).collect();
        let visible: Vec<_> = projected.iter().flatten().collect();
        assert!(
            visible.len() > 120 && visible.len() < 200,
            "{}",
            visible.len()
        );
        let outside = visible.iter().filter(|p| p.mean2d[0] < 0.0).count();
        assert!(outside > 0);
        let limits = super::super::project::jacobian_limits(&view);
        let beyond = |p: &&&super::super::project::Projected<f64>| {
            (p.mean2d[0] - view.cx) / view.fx < limits[0][0]
        };
        assert!(visible.iter().filter(beyond).count() > 0);
        let widest = visible.iter().map(|p| p.half_extent[0]).fold(0.0, f64::max);
        assert!((8.0..25.0).contains(&widest), "{widest}");
        let (dark, _) = (0..200)
            .map(|i| scene.gaussian(i))
            .map(|g| super::super::shade::shade(&g.mean, &g.sh, &view, Shading::Offset)[0])
            .fold((0, 0), |(dark, all), c| {
                (dark + usize::from(c == 0.0), all + 1)
            });
        assert!(dark > 0, "the clamp of the color must be met");
    }

    #[test]
    fn stack_meets_cap_and_floor() {
        let (scene, view) = opaque_stack::<1>(3, 24, 0);
        let pixels = render_pixels(&scene, &view, Shading::Offset);
        let darkest = pixels.iter().map(|p| p.transmittance).fold(1.0, f64::min);
        assert!(darkest < 1e-2, "{darkest}");
        let most = pixels.iter().map(|p| p.contributors.len()).max().unwrap();
        assert!(most < 24, "some pixel must stop before its last splat");
        assert_eq!(decision_margin(&scene, &view).len(), 48 * 40);
    }
}
