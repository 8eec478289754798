//! The whole forward pass, brute force: every Gaussian at every pixel, no tiles.

use super::blend::{Pixel, ScreenSplat, blend};
use super::constants::COLOR_MAX;
use super::project::{Cull, Projected};
use super::scene::{Gaussian, Scene};
use super::shade::{Shading, shade};
use super::view::View;
use super::{Number, relative_distance};

/// A visible Gaussian: its index in the scene and its two faces.
#[derive(Clone, Debug)]
pub struct Visible<T, const C: usize> {
    /// Index in the scene.
    pub index: usize,
    /// Result of projection.
    pub projected: Projected<T>,
    /// Input of blending.
    pub splat: ScreenSplat<T, C>,
}

/// Projects and shades one Gaussian.
///
/// # Errors
/// The reason for which the Gaussian is not drawn.
pub fn to_screen<T: Number, const C: usize>(
    gaussian: &Gaussian<T, C>,
    view: &View,
    shading: Shading,
) -> Result<(Projected<T>, ScreenSplat<T, C>), Cull> {
    let projected = gaussian.project(view)?;
    let color = shade(&gaussian.mean, &gaussian.sh, view, shading);
    if color.iter().any(|c| c.re().abs() > COLOR_MAX) {
        return Err(Cull::Color);
    }
    let splat = ScreenSplat {
        mean2d: projected.mean2d,
        conic: projected.conic,
        opacity: projected.opacity,
        color,
    };
    Ok((projected, splat))
}

/// The Gaussians that are drawn, by depth; equal depths keep index order.
pub fn visible<T: Number, const C: usize>(
    scene: &Scene<T, C>,
    view: &View,
    shading: Shading,
) -> Vec<Visible<T, C>> {
    let mut list: Vec<_> = (0..scene.len())
        .filter_map(|index| {
            let (projected, splat) = to_screen(&scene.gaussian(index), view, shading).ok()?;
            Some(Visible {
                index,
                projected,
                splat,
            })
        })
        .collect();
    let key = |v: &Visible<T, C>| view.numerics.depth_key(v.projected.depth.re());
    list.sort_by(|a, b| key(a).total_cmp(&key(b)));
    list
}

/// All that blending leaves at each pixel; contributors are positions in
/// [`visible`]'s list.
pub fn render_pixels<T: Number, const C: usize>(
    scene: &Scene<T, C>,
    view: &View,
    shading: Shading,
) -> Vec<Pixel<T, C>> {
    let splats: Vec<_> = visible(scene, view, shading)
        .into_iter()
        .map(|v| v.splat)
        .collect();
    blend(&splats, &view.numerics, view.width, view.height)
}

/// The picture, `[height · width][C]`.
pub fn render<T: Number, const C: usize>(
    scene: &Scene<T, C>,
    view: &View,
    shading: Shading,
) -> Vec<[T; C]> {
    render_pixels(scene, view, shading)
        .into_iter()
        .map(|p| p.color)
        .collect()
}

/// Per pixel, the depth of the Gaussian behind which at most half of the background shows, if
/// any, and the smallest relative distance of any decision from falling the other way.
pub fn median_depths<const C: usize>(
    scene: &Scene<f64, C>,
    view: &View,
) -> Vec<(Option<f64>, f64)> {
    let list = visible(scene, view, Shading::Plain);
    let of_pixel = |pixel: Pixel<f64, C>| {
        let behind = pixel.transmittances.iter().zip(&pixel.contributors);
        let margins = behind.clone().map(|(&t, _)| relative_distance(t, 0.5));
        let margin = margins.fold(pixel.margin, f64::min);
        let first = behind.clone().find(|(t, _)| **t <= 0.5);
        (first.map(|(_, &at)| list[at].projected.depth), margin)
    };
    let pixels = render_pixels(scene, view, Shading::Plain).into_iter();
    pixels.map(of_pixel).collect()
}

/// Per pixel, the smallest relative distance of any alpha to its floor or
/// cap, of the transmittance to its floor, and of an exponent to zero
/// (against its own terms). Below about 1e-4, `f32` may decide otherwise.
pub fn decision_margin<const C: usize>(scene: &Scene<f64, C>, view: &View) -> Vec<f64> {
    render_pixels(scene, view, Shading::Plain)
        .into_iter()
        .map(|p| p.margin)
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::constants::{BLUR, SH_C0};
    use super::super::random::{oblique_view, random_scene};
    use super::*;

    #[test]
    fn one_gaussian_in_the_center_has_the_analytic_value() {
        let mut view = oblique_view();
        (view.cx, view.cy) = (24.5, 20.5);
        view.fy = view.fx;
        let center = view.center();
        let sigma = 0.1_f64;
        let mean = std::array::from_fn(|k| center[k] + 2.0 * view.rotation[2][k]);
        let gaussian = Gaussian {
            mean,
            quat: [0.3, -0.5, 0.2, 0.9],
            log_scale: [sigma.ln(); 3],
            opacity_logit: 0.6_f64,
            sh: vec![[1.0], [0.0], [0.0], [0.0]],
        };
        let picture = render(&Scene::of(1, [gaussian]), &view, Shading::Offset);
        let opacity = 1.0 / (1.0 + (-0.6_f64).exp());
        let variance = (sigma * view.fx / 2.0).powi(2) + BLUR;
        for (x, y) in [(24, 20), (28, 20), (24, 15), (21, 23)] {
            let squared = (x as f64 - 24.0).powi(2) + (y as f64 - 20.0).powi(2);
            let alpha = opacity * (-squared / (2.0 * variance)).exp();
            let value = picture[y * view.width + x][0];
            // The view's rotation is rounded to f32, hence 1e-6.
            assert!((value - (0.5 + SH_C0) * alpha).abs() < 1e-6, "{x} {y}");
        }
        assert_eq!(picture[0][0], 0.0);
    }

    #[test]
    fn order_of_the_arrays_does_not_matter_but_for_ties() {
        let (scene, view) = random_scene::<3>(5, 30, 1);
        let reversed = Scene::of(1, (0..30).rev().map(|i| scene.gaussian(i)));
        let shading = Shading::Offset;
        assert_eq!(
            render(&scene, &view, shading),
            render(&reversed, &view, shading)
        );

        let twin = |sh: f64| Gaussian {
            sh: vec![[sh]],
            ..Gaussian::<f64, 1> {
                mean: scene.means[0],
                quat: scene.quats[0],
                log_scale: scene.log_scales[0],
                opacity_logit: 1.0,
                sh: Vec::new(),
            }
        };
        let tied = Scene::of(0, [twin(1.0), twin(-1.0)]);
        let order: Vec<_> = visible(&tied, &view, shading)
            .iter()
            .map(|v| v.index)
            .collect();
        assert_eq!(order, [0, 1]);
    }

    #[test]
    fn poison_culls_its_own_gaussian_only() {
        let (scene, view) = random_scene::<2>(6, 20, 1);
        let without = Scene::of(1, (1..20).map(|i| scene.gaussian(i)));
        let expected = render(&without, &view, Shading::Plain);
        for poison in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let count = scene.gaussian(0).parameters_mut().count();
            for parameter in 0..count {
                let mut first = scene.gaussian(0);
                *first.parameters_mut().nth(parameter).unwrap() = poison;
                assert_eq!(first.project(&view).unwrap_err(), Cull::NonFinite);
                let rest = (1..20).map(|i| scene.gaussian(i));
                let poisoned = Scene::of(1, std::iter::once(first).chain(rest));
                assert_eq!(render(&poisoned, &view, Shading::Plain), expected);
            }
        }
    }
}
