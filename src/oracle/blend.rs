//! Front-to-back alpha blending at one pixel and over an image.

use super::constants::ALPHA_MAX;
use super::numerics::Numerics;
use super::{Number, relative_distance};

/// Screen-space parameters of a Gaussian for blending.
#[derive(Clone, Copy, Debug)]
pub struct ScreenSplat<T, const C: usize> {
    /// Center in pixels.
    pub mean2d: [T; 2],
    /// Inverse covariance `xx, xy, yy`.
    pub conic: [T; 3],
    /// Opacity at the center.
    pub opacity: T,
    /// Blended color, channel by channel.
    pub color: [T; C],
}

/// Result of blending at a pixel.
#[derive(Clone, Debug)]
pub struct Pixel<T, const C: usize> {
    /// Blended color over a background of zero.
    pub color: [T; C],
    /// Share of the background that still shows.
    pub transmittance: T,
    /// Positions, in the blended list, of the splats that were added.
    pub contributors: Vec<usize>,
    /// Share of the background that still shows behind each of them.
    pub transmittances: Vec<f64>,
    /// The smallest relative distance of any decision from falling the other
    /// way: where it is tiny, `f32` and `f64` may differ in good faith.
    pub margin: f64,
}

/// Blends `splats`, sorted by depth, at the point `(x, y)` in pixels.
pub fn blend_pixel<'a, T: Number, const C: usize>(
    splats: impl IntoIterator<Item = &'a ScreenSplat<T, C>>,
    numerics: &Numerics,
    x: f64,
    y: f64,
) -> Pixel<T, C> {
    let mut pixel = Pixel {
        color: [T::zero(); C],
        transmittance: T::one(),
        contributors: Vec::new(),
        transmittances: Vec::new(),
        margin: f64::INFINITY,
    };
    for (position, splat) in splats.into_iter().enumerate() {
        let [dx, dy] = [-(splat.mean2d[0] - x), -(splat.mean2d[1] - y)];
        let [a, b, c] = splat.conic;
        let squares = (a * dx * dx + c * dy * dy) * 0.5;
        let cross = b * dx * dy;
        let power = squares + cross;
        let terms = squares.re() + cross.re().abs();
        if terms > 0.0 {
            pixel.margin = pixel.margin.min((power.re() / terms).abs());
        }
        let convex = power.re() >= 0.0;
        if !convex {
            continue;
        }

        let mut alpha = splat.opacity * numerics.falloff.at(power);
        for threshold in [numerics.alpha_min, ALPHA_MAX] {
            pixel.margin = pixel.margin.min(relative_distance(alpha.re(), threshold));
        }
        if alpha.re() > ALPHA_MAX {
            alpha = T::from(ALPHA_MAX);
        }
        let counts = alpha.re() >= numerics.alpha_min;
        if !counts {
            continue;
        }

        let next = pixel.transmittance * (T::one() - alpha);
        pixel.margin = pixel
            .margin
            .min(relative_distance(next.re(), numerics.transmittance_min));
        if next.re() < numerics.transmittance_min {
            break;
        }
        for (sum, &color) in pixel.color.iter_mut().zip(&splat.color) {
            *sum += color * alpha * pixel.transmittance;
        }
        pixel.transmittance = next;
        pixel.contributors.push(position);
        pixel.transmittances.push(next.re());
    }
    pixel
}

/// The center of pixel `index` of an image `width` pixels wide.
pub fn pixel_center(index: usize, width: usize) -> [f64; 2] {
    [(index % width) as f64 + 0.5, (index / width) as f64 + 0.5]
}

/// Blends `splats`, sorted by depth, over a whole image in row order.
pub fn blend<T: Number, const C: usize>(
    splats: &[ScreenSplat<T, C>],
    numerics: &Numerics,
    width: usize,
    height: usize,
) -> Vec<Pixel<T, C>> {
    (0..width * height)
        .map(|index| {
            let [x, y] = pixel_center(index, width);
            blend_pixel(splats, numerics, x, y)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::{lift, seed};
    use super::*;

    fn splat(opacity: f64, color: f64) -> ScreenSplat<f64, 1> {
        ScreenSplat {
            mean2d: [3.0, 2.0],
            conic: [0.5, 0.1, 0.25],
            opacity,
            color: [color],
        }
    }

    #[test]
    fn one_splat_has_the_analytic_value() {
        let pixel = blend_pixel(&[splat(0.8, 0.7)], &Numerics::DEFAULT, 4.0, 0.0);
        // d = (1, -2): ½·0.5·1 + ½·0.25·4 + 0.1·(-2) = 0.55
        let alpha = 0.8 * (-0.55_f64).exp();
        assert!((pixel.color[0] - 0.7 * alpha).abs() < 1e-15);
        assert!((pixel.transmittance - (1.0 - alpha)).abs() < 1e-15);
    }

    #[test]
    fn order_matters_front_to_back() {
        let pixel = blend_pixel(
            &[splat(0.5, 1.0), splat(0.25, 8.0)],
            &Numerics::DEFAULT,
            3.0,
            2.0,
        );
        assert_eq!(pixel.color[0], 0.5 + 8.0 * 0.25 * 0.5);
        assert_eq!(pixel.transmittance, 0.375);
        assert_eq!(pixel.contributors, [0, 1]);
    }

    #[test]
    fn opaque_stack_stops_before_the_floor() {
        // 0.99 twice leaves 1e-4, which is the floor itself up to rounding;
        // 0.985 twice leaves 2.25e-4, and a third would fall below.
        let pixel = blend_pixel(&[splat(0.985, 1.0); 5], &Numerics::DEFAULT, 3.0, 2.0);
        assert_eq!(pixel.contributors, [0, 1]);
        assert!((pixel.transmittance - 2.25e-4).abs() < 1e-15);
        let edge = blend_pixel(&[splat(1.0, 1.0); 5], &Numerics::DEFAULT, 3.0, 2.0);
        assert!(edge.margin < 1e-9, "twice ALPHA_MAX is a coin toss");
    }

    #[test]
    fn clamp_stops_the_derivative_and_faint_splats_are_skipped() {
        let bright = ScreenSplat {
            mean2d: [3.0, 2.0].map(lift),
            conic: [0.5, 0.1, 0.25].map(lift),
            opacity: seed(0.995),
            color: [lift(1.0)],
        };
        let pixel = blend_pixel(&[bright], &Numerics::DEFAULT, 3.0, 2.0);
        assert_eq!((pixel.color[0].re, pixel.color[0].eps), (0.99, 0.0));
        let faint = blend_pixel(&[splat(0.0039, 1.0)], &Numerics::DEFAULT, 3.0, 2.0);
        assert_eq!(faint.color[0], 0.0);
        assert_eq!(faint.transmittance, 1.0);
        assert!(faint.margin < 0.01);
    }

    #[test]
    fn non_finite_exponents_are_skipped() {
        let mut broken = splat(0.8, 1.0);
        broken.conic[0] = f64::NAN;
        let pixel = blend_pixel(&[broken, splat(0.5, 1.0)], &Numerics::DEFAULT, 4.0, 2.0);
        assert_eq!(pixel.contributors, [1]);
        assert!(pixel.color[0].is_finite());
    }
}
