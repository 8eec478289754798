//! Gradients of a picture by dual numbers: forward code only.
//!
//! The scalar is `Σ_p Σ_c v[p][c] · out[p][c]`. One parameter at a time is
//! seeded, and only pixels to which its Gaussian contributes are blended
//! again, with only the splats that contribute there. That leaves nothing
//! out: decisions depend on real parts, so what was skipped stays skipped.
//!
//! To leave out pixels near a discontinuity, set their `v` to zero.

use super::blend::{ScreenSplat, blend_pixel, pixel_center};
use super::render::{to_screen, visible};
use super::scene::Scene;
use super::shade::Shading;
use super::view::View;
use super::{lift, seed};
use num_dual::Dual64;

/// A rendered view, ready to be differentiated.
struct Tape<'a, const C: usize> {
    view: &'a View,
    upstream: &'a [[f64; C]],
    /// Scene indices by depth.
    order: Vec<usize>,
    /// The same splats as dual constants.
    splats: Vec<ScreenSplat<Dual64, C>>,
    /// Per pixel, positions in `order` that contribute.
    contributors: Vec<Vec<usize>>,
    /// Per position in `order`, the pixels it contributes to.
    pixels: Vec<Vec<usize>>,
}

impl<'a, const C: usize> Tape<'a, C> {
    fn record(
        scene: &Scene<f64, C>,
        view: &'a View,
        shading: Shading,
        upstream: &'a [[f64; C]],
    ) -> Self {
        assert_eq!(upstream.len(), view.width * view.height);
        let list = visible(scene, view, shading);
        let mut contributors = Vec::new();
        let mut pixels = vec![Vec::new(); list.len()];
        for index in 0..upstream.len() {
            let [x, y] = pixel_center(index, view.width);
            let pixel = blend_pixel(list.iter().map(|v| &v.splat), &view.numerics, x, y);
            for &position in &pixel.contributors {
                pixels[position].push(index);
            }
            contributors.push(pixel.contributors);
        }
        Self {
            view,
            upstream,
            order: list.iter().map(|v| v.index).collect(),
            splats: list.iter().map(|v| lift_splat(&v.splat)).collect(),
            contributors,
            pixels,
        }
    }

    /// The scalar's derivative along that of `varied`, which stands at `position`.
    fn derivative(&self, position: usize, varied: &ScreenSplat<Dual64, C>) -> f64 {
        self.derivatives(position, varied).sum()
    }

    /// The same, one share a pixel that the Gaussian contributes to.
    fn derivatives(
        &self,
        position: usize,
        varied: &ScreenSplat<Dual64, C>,
    ) -> impl Iterator<Item = f64> {
        self.pixels[position].iter().map(move |&index| {
            let [x, y] = pixel_center(index, self.view.width);
            let splats = self.contributors[index].iter().map(|&other| {
                if other == position {
                    varied
                } else {
                    &self.splats[other]
                }
            });
            let pixel = blend_pixel(splats, &self.view.numerics, x, y);
            let shares = self.upstream[index].iter().zip(pixel.color);
            shares.map(|(v, out)| v * out.eps).sum()
        })
    }
}

fn lift_splat<const C: usize>(splat: &ScreenSplat<f64, C>) -> ScreenSplat<Dual64, C> {
    ScreenSplat {
        mean2d: splat.mean2d.map(lift),
        conic: splat.conic.map(lift),
        opacity: lift(splat.opacity),
        color: splat.color.map(lift),
    }
}

/// The gradient with respect to every parameter, in the shape of the scene;
/// zero for Gaussians that are culled. `upstream` is v, `[height · width][C]`.
pub fn gradient<const C: usize>(
    scene: &Scene<f64, C>,
    view: &View,
    shading: Shading,
    upstream: &[[f64; C]],
) -> Scene<f64, C> {
    gradient_of(scene, view, shading, upstream, |_| true)
}

/// The same for those Gaussians alone of which `wanted` says so by their index; zero for
/// the others.
pub fn gradient_of<const C: usize>(
    scene: &Scene<f64, C>,
    view: &View,
    shading: Shading,
    upstream: &[[f64; C]],
    wanted: impl Fn(usize) -> bool,
) -> Scene<f64, C> {
    let tape = Tape::record(scene, view, shading, upstream);
    let mut rows: Vec<_> = (0..scene.len())
        .map(|i| {
            let mut row = scene.gaussian(i);
            row.parameters_mut().for_each(|p| *p = 0.0);
            row
        })
        .collect();
    for (position, &index) in tape.order.iter().enumerate() {
        if !wanted(index) {
            continue;
        }
        let constant = scene.gaussian(index).to_dual();
        for (parameter, slot) in rows[index].parameters_mut().enumerate() {
            let mut varied = constant.clone();
            if let Some(value) = varied.parameters_mut().nth(parameter) {
                *value = seed(value.re);
            }
            if let Ok((_, splat)) = to_screen(&varied, view, shading) {
                *slot = tape.derivative(position, &splat);
            }
        }
    }
    Scene::of(scene.degree, rows)
}

/// The pull on each Gaussian, `[N]`: the sum over pixels of the length of the
/// gradient with respect to its center in normalized device coordinates.
pub fn pulls<const C: usize>(
    scene: &Scene<f64, C>,
    view: &View,
    shading: Shading,
    upstream: &[[f64; C]],
) -> Vec<f64> {
    of_pixels(scene, view, shading, upstream, |slopes| {
        slopes.map(|[x, y]| x.hypot(y)).sum()
    })
}

/// The same where pixels that pull apart cancel, `[N]`: the length of the sum.
pub fn signed_pulls<const C: usize>(
    scene: &Scene<f64, C>,
    view: &View,
    shading: Shading,
    upstream: &[[f64; C]],
) -> Vec<f64> {
    of_pixels(scene, view, shading, upstream, |slopes| {
        let [x, y] = slopes.fold([0.0; 2], |[x, y], slope| [x + slope[0], y + slope[1]]);
        x.hypot(y)
    })
}

/// A figure of each Gaussian, `[N]`, from each pixel's gradient with respect to its center in
/// normalized device coordinates.
fn of_pixels<const C: usize>(
    scene: &Scene<f64, C>,
    view: &View,
    shading: Shading,
    upstream: &[[f64; C]],
    figure: impl Fn(&mut dyn Iterator<Item = [f64; 2]>) -> f64,
) -> Vec<f64> {
    let tape = Tape::record(scene, view, shading, upstream);
    let half = [view.width, view.height].map(|side| side as f64 / 2.0);
    let mut result = vec![0.0; scene.len()];
    for (position, &index) in tape.order.iter().enumerate() {
        let [x, y] = [0, 1].map(|axis| {
            let mut varied = tape.splats[position];
            varied.mean2d[axis] = seed(varied.mean2d[axis].re);
            let slopes = tape.derivatives(position, &varied);
            slopes.map(|v| v * half[axis]).collect::<Vec<_>>()
        });
        result[index] = figure(&mut x.into_iter().zip(y).map(|(x, y)| [x, y]));
    }
    result
}
