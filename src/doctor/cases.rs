//! The hard cases: scenes at which rasterizers break.
//!
//! Most put one troublesome Gaussian, number [`ODD`], into the middle of forty
//! ordinary ones. `seen` are the worst errors measured on the reference device;
//! docs/experiments/hard-cases.csv is made from this table.

use crate::oracle::{
    random::{
        Random, oblique_view, opaque_stack, random_scene, random_scene_before, random_view, round,
    },
    scene::{Gaussian, Scene},
    view::View,
};

/// The troublesome Gaussian of most cases.
pub const ODD: usize = 17;

/// Gaussians of most cases.
const COUNT: usize = 40;

/// A scene before a view.
#[derive(Clone, Debug)]
pub struct HardCase {
    /// Scene as the kernels receive it; values that are not finite included.
    pub scene: Scene<f64, 1>,
    /// View of the scene.
    pub view: View,
    /// Gaussians that must leave no trace.
    pub broken: Vec<usize>,
    /// Gaussians that must be counted as poisoned.
    pub poisoned: usize,
}

/// Nearer to a border between sort keys, in steps of the depth's last bit, another device's
/// rounding may lie beyond it.
const ROUNDING: u32 = 64;

impl HardCase {
    /// Moves Gaussians off the borders between sort keys of fewer bits, where rounding decides
    /// what is drawn first, by a quarter to a half of a key's width.
    pub(super) fn between_sort_keys(&mut self) {
        let bits = self.view.numerics.depth_bits;
        if bits == 32 {
            return;
        }
        let width = 1_u32 << (32 - bits);
        let [.., ahead] = self.view.rotation;
        for mean in &mut self.scene.means {
            let depth = self.view.translation[2] + (0..3).map(|k| ahead[k] * mean[k]).sum::<f64>();
            let rest = (depth as f32).to_bits() % width;
            if depth.is_finite() && rest.min(width - rest) < ROUNDING {
                let further = depth * 2_f64.powi(7 - bits as i32);
                *mean = std::array::from_fn(|k| round(mean[k] + ahead[k] * further));
            }
        }
    }
}

/// One line of the table.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Name in tables.
    pub name: &'static str,
    /// Failure of a rasterizer that does nothing about the case.
    pub trouble: &'static str,
    /// Constructor of the case.
    pub make: fn() -> HardCase,
    /// Worst error seen of the picture (absolute) and of the gradient
    /// (relative L2), on llvmpipe of Mesa 22.3.
    pub seen: [f64; 2],
}

/// Forty random Gaussians, number [`ODD`] two units straight ahead of the camera.
fn ordinary() -> HardCase {
    let (mut scene, view) = random_scene(7, COUNT, 1);
    scene.means[ODD] = ahead(&view, 2.0);
    HardCase {
        scene,
        view,
        broken: Vec::new(),
        poisoned: 0,
    }
}

/// The same with something done to it.
fn with(change: impl FnOnce(&mut Scene<f64, 1>, &View)) -> HardCase {
    let mut hard = ordinary();
    change(&mut hard.scene, &hard.view);
    hard
}

/// The same with something done to number [`ODD`] that must make it vanish.
fn broken(poisoned: usize, change: impl FnOnce(&mut Scene<f64, 1>)) -> HardCase {
    HardCase {
        broken: vec![ODD],
        poisoned,
        ..with(|scene, _| change(scene))
    }
}

/// A scene before a view, nothing broken.
fn sound((scene, view): (Scene<f64, 1>, View)) -> HardCase {
    HardCase {
        scene,
        view,
        broken: Vec::new(),
        poisoned: 0,
    }
}

/// The point at camera coordinates `[x, y, z]`, in world units.
fn at(view: &View, camera: [f64; 3]) -> [f64; 3] {
    let offset: [f64; 3] = std::array::from_fn(|k| camera[k] - view.translation[k]);
    std::array::from_fn(|column| {
        round(
            (0..3)
                .map(|row| view.rotation[row][column] * offset[row])
                .sum(),
        )
    })
}

/// The point at a depth on the optical axis.
fn ahead(view: &View, depth: f64) -> [f64; 3] {
    at(view, [0.0, 0.0, depth])
}

/// A camera at the origin that looks along z: coordinates reach it unrounded.
fn straight_view(width: usize, height: usize) -> View {
    let mut view = oblique_view();
    view.rotation = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    view.translation = [0.0; 3];
    (view.fx, view.fy) = (32.0, 32.0);
    (view.width, view.height) = (width, height);
    (view.cx, view.cy) = (width as f64 / 2.0, height as f64 / 2.0);
    view
}

/// A round Gaussian of degree 0.
fn ball(mean: [f64; 3], deviation: f64, opacity: f64, gray: f64) -> Gaussian<f64, 1> {
    Gaussian {
        mean: mean.map(round),
        quat: [1.0, 0.0, 0.0, 0.0],
        log_scale: [round(deviation.ln()); 3],
        opacity_logit: round((opacity / (1.0 - opacity)).ln()),
        sh: vec![[round((gray - 0.5) / crate::oracle::constants::SH_C0)]],
    }
}

/// Gaussians with random opacity and gray at given places and sizes.
fn balls(
    view: View,
    [faint, dense]: [f64; 2],
    places: impl IntoIterator<Item = ([f64; 3], f64)>,
) -> HardCase {
    let mut random = Random::new(11);
    let gaussians = places.into_iter().map(|(mean, deviation)| {
        let [opacity, gray] = [random.range(faint, dense), random.range(0.1, 0.9)];
        ball(mean, deviation, opacity, gray)
    });
    let scene = Scene::of(0, gaussians);
    sound((scene, view))
}

/// The same scene and view in units `factor` times smaller.
fn scaled(factor: f64) -> HardCase {
    let mut hard = ordinary();
    let HardCase { scene, view, .. } = &mut hard;
    for mean in &mut scene.means {
        *mean = mean.map(|x| round(x * factor));
    }
    for log_scale in &mut scene.log_scales {
        *log_scale = log_scale.map(|s| round(s + factor.ln()));
    }
    view.translation = view.translation.map(|x| round(x * factor));
    view.near = round(view.near * factor);
    hard
}

/// A view of a random scene with other intrinsics.
fn seen_through(change: impl FnOnce(&mut View)) -> HardCase {
    let mut view = oblique_view();
    change(&mut view);
    sound((random_scene_before(&view, 5, COUNT, 1), view))
}

/// The same, antialiased.
fn antialiased(hard: HardCase) -> HardCase {
    let view = View {
        antialiased: true,
        ..hard.view
    };
    HardCase { view, ..hard }
}

macro_rules! cases {
    ($($name:literal, $trouble:literal, $make:expr, [$forward:literal, $gradient:literal];)*) => {
        &[$(Case { name: $name, trouble: $trouble, make: || $make, seen: [$forward, $gradient] }),*]
    };
}

/// Every case.
pub const CASES: &[Case] = cases! {
    "ordinary scene", "the measure of the others",
        sound(random_scene(1, COUNT, 3)), [5.59e-7, 8.95e-7];
    "odd image sizes", "tiles cut short",
        sound({ let view = random_view(3); (random_scene_before(&view, 3, COUNT, 2), view) }), [6.66e-7, 4.12e-6];
    "needle", "the determinant cancels; its square is divided by",
        with(|s, _| s.log_scales[ODD] = [-0.5, -9.0, -9.0]), [6.12e-6, 1.22e-4];
    "needle across the pixels", "terms of the exponent cancel",
        with(|s, v| { s.means[ODD] = ahead(v, 4.0); s.quats[ODD] = [1.0, 0.0, 0.0, 0.0]; s.log_scales[ODD] = [-9.0, -9.0, 0.5]; }), [6.63e-6, 1.07e-3];
    "needle seen end-on", "one long axis along the ray",
        sound({ let view = straight_view(48, 40); let mut s = random_scene_before(&view, 29, COUNT, 1);
          s.means[ODD] = [0.02, 0.01, 4.0].map(round); s.quats[ODD] = [1.0, 0.0, 0.0, 0.0]; s.log_scales[ODD] = [-9.0, -9.0, 0.5]; (s, view) }), [2.16e-7, 5.95e-7];
    "disc without thickness", "one variance underflows",
        with(|s, _| s.log_scales[ODD] = [-1.5, -1.5, -30.0]), [9.71e-7, 7.53e-6];
    "smaller than a pixel", "nothing but the blur is left",
        with(|s, _| s.log_scales[ODD] = [-14.0; 3]), [5.68e-7, 2.91e-6];
    "variances underflow", "0 or a denormal, squared in the adjoint",
        with(|s, _| s.log_scales[ODD] = [-50.0; 3]), [5.68e-7, 2.91e-6];
    "deviation underflows", "exp gives 0",
        with(|s, _| s.log_scales[ODD] = [-120.0; 3]), [5.68e-7, 2.91e-6];
    "wider than the image", "every tile, and a gradient from every pixel",
        with(|s, _| s.log_scales[ODD] = [1.5; 3]), [1.72e-7, 3.37e-6];
    "over 42 tiles", "so many records that they are summed four at a time",
        balls(straight_view(112, 96), [0.3, 0.9], [([0.1, 0.0, 2.0], 1.5), ([0.3, -0.2, 3.0], 0.4), ([0.0, 0.0, 4.0], 2.0)]), [1.7e-7, 3.4e-6];
    "determinant overflows", "infinity minus infinity",
        broken(0, |s| s.log_scales[ODD] = [35.0; 3]), [5.68e-7, 2.90e-6];
    "covariance overflows", "infinite entries",
        broken(0, |s| s.log_scales[ODD] = [50.0; 3]), [5.68e-7, 2.90e-6];
    "one deviation overflows", "exp gives infinity, radius still counted",
        broken(1, |s| s.log_scales[ODD][0] = 89.0), [5.68e-7, 2.90e-6];
    "zero quaternion", "0/0 in the normalization",
        broken(1, |s| s.quats[ODD] = [0.0; 4]), [5.68e-7, 2.90e-6];
    "quaternion next to zero", "1/‖q‖ and its square in the adjoint",
        broken(1, |s| s.quats[ODD] = [3e-5, -3e-5, 3e-5, 3e-5].map(round)), [5.68e-7, 2.90e-6];
    "shortest quaternion that counts", "large gradient of the quaternion",
        with(|s, _| s.quats[ODD] = [2e-4, 1e-4, -1e-4, 1e-4].map(round)), [5.68e-7, 2.24e-5];
    "long quaternion", "tiny gradient of the quaternion",
        with(|s, _| s.quats[ODD] = [1e15, 2e15, -1e15, 3e15].map(round)), [5.68e-7, 2.92e-6];
    "quaternion whose square overflows", "1/∞ = 0: a rotation of zeros",
        broken(1, |s| s.quats[ODD] = [1e30; 4].map(round)), [5.68e-7, 2.90e-6];
    "far beside the image", "the linearized projection stretches without bound",
        with(|s, v| { s.means[ODD] = at(v, [2.5, 0.4, 0.8]); s.log_scales[ODD] = [0.2; 3]; }), [4.51e-7, 3.02e-6];
    "far beside, principal point off center", "limits that assume a centered one",
        { let mut h = seen_through(|v| (v.cx, v.cy) = (8.0, 33.0));
          h.scene.means[ODD] = at(&h.view, [2.5, -1.5, 0.8]); h.scene.log_scales[ODD] = [0.5; 3]; h }, [7.83e-7, 1.18e-6];
    "just beyond the near plane", "1/z at its largest",
        with(|s, v| { s.means[ODD] = at(v, [0.005, -0.002, 0.101]); s.log_scales[ODD] = [-4.5; 3]; }), [7.58e-7, 3.64e-6];
    "just before the near plane", "1/z grows without bound",
        broken(0, |s| { let v = oblique_view(); s.means[ODD] = ahead(&v, 0.099); }), [5.68e-7, 2.90e-6];
    "at the camera", "no direction of view, z = 0",
        broken(0, |s| { let v = oblique_view(); s.means[ODD] = ahead(&v, 0.0); }), [5.68e-7, 2.90e-6];
    "behind the camera, wide", "a mirror image in front",
        broken(0, |s| { let v = oblique_view(); s.means[ODD] = ahead(&v, -1.0); s.log_scales[ODD] = [1.0; 3]; }), [5.68e-7, 2.90e-6];
    "camera inside a Gaussian", "the projection covers everything",
        with(|s, v| { s.means[ODD] = ahead(v, 0.2); s.log_scales[ODD] = [0.0; 3]; }), [1.82e-7, 3.78e-6];
    "opaque stack", "transmittance recovered by dividing by 1 - α",
        sound(opaque_stack(8, COUNT, 1)), [3.16e-7, 1.93e-6];
    "opacity saturates", "α = 1: 1/(1 - α)",
        with(|s, _| { s.opacity_logits[ODD] = 40.0; s.log_scales[ODD] = [-1.8; 3]; }), [5.68e-7, 2.97e-6];
    "opacity is gone", "never drawn, must not be differentiated",
        broken(0, |s| s.opacity_logits[ODD] = -40.0), [5.68e-7, 2.90e-6];
    "opacity just above 1/255", "a footprint of one point",
        with(|s, _| s.opacity_logits[ODD] = round((1.01_f64 / 253.99).ln())), [5.68e-7, 2.90e-6];
    "all are transparent", "an empty scene, zero-size dispatches",
        { let mut h = with(|s, _| s.opacity_logits.fill(-20.0)); h.broken = (0..COUNT).collect(); h }, [0.0, 0.0];
    "nothing in view", "zero-size dispatches",
        { let mut h = ordinary(); h.view.rotation = h.view.rotation.map(|row| row.map(|x| -x));
          h.view.translation = h.view.translation.map(|x| -x); h.broken = (0..COUNT).collect(); h }, [0.0, 0.0];
    "one Gaussian", "scans and sorts of one",
        balls(straight_view(40, 24), [0.5, 0.6], [([0.1, 0.2, 3.0], 0.2)]), [7.04e-8, 1.04e-6];
    "equal depths", "an order that changes from run to run",
        balls(straight_view(48, 40), [0.1, 0.9], (0..COUNT).map(|i| {
            ([(i % 8) as f64 * 0.25 - 0.9, (i / 8) as f64 * 0.3 - 0.7, 2.0], 0.15)
        })), [3.04e-7, 5.03e-6];
    "coincident Gaussians", "duplicates: ties in everything",
        balls(straight_view(32, 32), [0.05, 0.4], (0..COUNT).map(|_| ([0.05, -0.1, 2.5], 0.2))), [3.06e-7, 4.61e-6];
    "600 in one tile", "a tile's list longer than any batch",
        balls(straight_view(6, 6), [0.004, 0.02], (0..600).map(|i| {
            ([(i % 7) as f64 * 0.02 - 0.06, (i % 5) as f64 * 0.02 - 0.04, 2.0 + i as f64 / 200.0], 0.3)
        })), [9.62e-7, 3.17e-5];
    "centers on tile borders", "count and emit that round differently",
        balls(straight_view(64, 64), [0.3, 0.9], (0..9).map(|i| {
            ([(i % 3) as f64 - 1.0, (i / 3) as f64 - 1.0, 2.0 + i as f64 * 1e-3], 0.1)
        })), [4.52e-7, 6.44e-6];
    "image of one pixel", "everything is a border",
        balls(straight_view(1, 1), [0.2, 0.9], (0..8).map(|i| ([0.0, 0.0, 2.0 + f64::from(i)], 0.1))), [4.13e-8, 5.52e-7];
    "65,600 tiles", "16-bit tile numbers; more workgroups than a dispatch has",
        { let mut view = straight_view(1, 65_600 * 16); view.cy = view.height as f64 - 8.0;
          balls(view, [0.3, 0.9], (0..6).map(|i| ([0.0, f64::from(i) * -8.0, 2.0 + f64::from(i)], 20.0))) }, [2.51e-6, 9.27e-5];
    "mean is not a number", "NaN passes min, max and clamp",
        broken(1, |s| s.means[ODD][1] = f64::NAN), [5.68e-7, 2.90e-6];
    "mean is infinite", "∞ · 0",
        broken(1, |s| s.means[ODD][0] = f64::INFINITY), [5.68e-7, 2.90e-6];
    "scale is not a number", "NaN passes min, max and clamp",
        broken(1, |s| s.log_scales[ODD][2] = f64::NAN), [5.68e-7, 2.90e-6];
    "quaternion is not a number", "NaN passes min, max and clamp",
        broken(1, |s| s.quats[ODD][3] = f64::NAN), [5.68e-7, 2.90e-6];
    "opacity is not a number", "NaN passes min, max and clamp",
        broken(1, |s| s.opacity_logits[ODD] = f64::NAN), [5.68e-7, 2.90e-6];
    "opacity is infinite", "∞ in the adjoint of the sigmoid",
        broken(1, |s| s.opacity_logits[ODD] = f64::INFINITY), [5.68e-7, 2.90e-6];
    "harmonic is not a number", "one pixel poisons its neighbors in SSIM",
        broken(1, |s| s.sh[ODD * 4 + 3][0] = f64::NAN), [5.68e-7, 2.90e-6];
    "harmonic is infinite", "∞ - ∞ between directions",
        broken(1, |s| s.sh[ODD * 4 + 2][0] = f64::INFINITY), [5.68e-7, 2.90e-6];
    "harmonics far above white", "gradients scale with the color",
        with(|s, _| s.sh[ODD * 4] = [1000.0]), [7.06e-7, 9.15e-6];
    "harmonics beyond any color", "finite, but gradients overflow",
        broken(1, |s| s.sh[ODD * 4] = [1e38].map(round)), [5.68e-7, 2.90e-6];
    "harmonics below black", "clamped at 0, so no gradient",
        with(|s, _| s.sh[ODD * 4] = [-50.0]), [5.68e-7, 2.92e-6];
    "harmonics of degree 3, close", "the color moves with the mean",
        sound({ let view = oblique_view(); let mut s = random_scene_before(&view, 23, COUNT, 3);
          s.means[ODD] = at(&view, [0.02, 0.03, 0.3]); s.log_scales[ODD] = [-3.5; 3];
          for sh in &mut s.sh[ODD * 16 + 1..ODD * 16 + 16] { sh[0] = round(sh[0] * 4.0 + 0.3); } (s, view) }), [3.45e-7, 1.28e-6];
    "denormal coordinates", "flushed or not, by device",
        balls(straight_view(32, 32), [0.3, 0.9], [([1e-40, -1e-40, 2.0], 0.2), ([-0.0, 0.0, 3.0], 0.3)]), [4.95e-8, 6.63e-7];
    "a scene a thousandth wide", "absolute floors",
        scaled(1e-3), [9.63e-7, 4.26e-7];
    "a scene ten thousand wide", "absolute floors",
        scaled(1e4), [4.53e-7, 2.41e-6];
    "telephoto", "long focal lengths multiply rounding",
        seen_through(|v| (v.fx, v.fy) = (5000.0, 5000.0)), [3.44e-5, 4.37e-5];
    "antialiased", "the measure of the next ones",
        antialiased(sound(random_scene(1, COUNT, 3))), [5.60e-7, 8.90e-7];
    "antialiased needle", "the root of a determinant next to zero",
        antialiased(with(|s, _| s.log_scales[ODD] = [-0.5, -6.0, -6.0])), [5.45e-7, 3.15e-5];
    "antialiased disc seen edge-on", "a projected area of zero: 0/0 in the root's adjoint",
        antialiased({ let view = straight_view(48, 40); let mut s = random_scene_before(&view, 29, COUNT, 1);
          s.means[ODD] = [0.0, 0.0, 4.0]; s.quats[ODD] = [1.0, 0.0, 0.0, 0.0]; s.log_scales[ODD] = [-1.5, -120.0, -1.5];
          HardCase { broken: vec![ODD], ..sound((s, view)) } }), [2.45e-7, 6.35e-7];
    "antialiased, a tenth of a pixel", "1/c where c² is left of the opacity",
        antialiased(with(|s, _| { s.log_scales[ODD] = [-5.3; 3]; s.opacity_logits[ODD] = 6.0; })), [4.35e-7, 2.95e-6];
    "antialiased, variances underflow", "1/0 in the root's adjoint",
        antialiased(broken(0, |s| s.log_scales[ODD] = [-50.0; 3])), [4.35e-7, 2.95e-6];
    "antialiased, determinant overflows", "infinity by infinity",
        antialiased(broken(0, |s| s.log_scales[ODD] = [35.0; 3])), [4.35e-7, 2.95e-6];
    "very wide lens", "slopes of the rays near the clamp",
        seen_through(|v| (v.fx, v.fy) = (9.0, 9.0)), [8.34e-7, 2.08e-6];
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_stands_on_the_border_of_a_sort_key() {
        let from_border = |hard: &HardCase| {
            let [.., ahead] = hard.view.rotation;
            let mean = hard.scene.means[ODD];
            let depth = hard.view.translation[2] + (0..3).map(|k| ahead[k] * mean[k]).sum::<f64>();
            let rest = (depth as f32).to_bits() % (1 << 16);
            rest.min((1 << 16) - rest)
        };
        let mut hard = ordinary();
        hard.between_sort_keys();
        assert_eq!(hard.scene.means, ordinary().scene.means);
        assert!(from_border(&hard) < ROUNDING);
        hard.view.numerics.depth_bits = 16;
        hard.between_sort_keys();
        assert!(from_border(&hard) > 10_000);
        let moved = hard.scene.means.iter().zip(ordinary().scene.means);
        assert!(moved.filter(|(a, b)| **a != *b).count() < 5);
    }
}
