//! Each Gaussian by itself, from luma and chroma to RGB.
//!
//! Viewers blend sRGB values; the native picture blends gray and a/b and
//! converts afterwards. Gaussian by Gaussian, the color at the mean gray is
//! exact, and the harmonics of the gray become those of R, G and B through the
//! slope of each channel over the range in which the gray varies.

use crate::{
    color::{gray_to_lightness, lab_to_srgb},
    splats::{ShField, Splats, sh},
};

/// Bounds on half the range over which the slope is taken: below, rounding
/// shows; above, the color would no longer be that of this gray.
const HALF_RANGE: [f64; 2] = [0.01, 0.25];

/// Grays at which a Gaussian's own lightness decides what its a/b amount to; beyond,
/// that of the nearer bound does.
const LIKELY_GRAY: [f64; 2] = [0.2, 0.8];

/// Chroma in CIELAB units up to which a Gaussian's own a/b decide what they do to RGB;
/// stronger ones do as much more of the same.
const LIKELY_CHROMA: f64 = 25.0;

/// RGB Gaussians that look like `luma` (one channel) with `chroma` (a, b).
///
/// # Panics
/// When the two have not the same number of Gaussians.
pub fn bake_rgb(luma: &Splats, chroma: &ShField) -> Splats {
    let degree = luma.sh.degree.max(chroma.degree);
    let mut rgb = ShField::zeros(luma.len(), degree, 3);
    let stride = 3 * sh::coefficient_count(degree);
    for (i, out) in rgb.coefficients.chunks_exact_mut(stride).enumerate() {
        bake_one(luma.sh.of(i), chroma.of(i), out);
    }
    Splats {
        sh: rgb,
        ..luma.clone()
    }
}

fn bake_one(luma: &[f32], chroma: &[f32], out: &mut [f32]) {
    let at = |ab: [f64; 2], gray: f64| color(gray, ab);
    let gray = shown_gray(luma);
    let ab = [chroma[0], chroma[1]].map(|c| sh::C0 * f64::from(c));
    let mean = at(ab, gray);
    let half = spread(&mut luma[1..].iter().copied()).clamp(HALF_RANGE[0], HALF_RANGE[1]);
    let (above, below) = (at(ab, gray + half), at(ab, gray - half));
    for channel in 0..3 {
        out[channel] = ((mean[channel] - 0.5) / sh::C0) as f32;
        let slope = (above[channel] - below[channel]) / (2.0 * half);
        for (k, &c) in luma.iter().enumerate().skip(1) {
            out[3 * k + channel] += (slope * f64::from(c)) as f32;
        }
    }
    for which in 0..2 {
        let terms = || chroma.iter().copied().skip(2 + which).step_by(2);
        // CIELAB steps of one unit are as small as a step needs to be.
        let half = spread(&mut terms()).clamp(1.0, 10.0);
        let moved = |by: f64| {
            let mut ab = ab;
            ab[which] += by;
            at(ab, gray)
        };
        let (above, below) = (moved(half), moved(-half));
        for (k, c) in terms().enumerate() {
            for channel in 0..3 {
                let slope = (above[channel] - below[channel]) / (2.0 * half);
                out[3 * (k + 1) + channel] += (slope * f64::from(c)) as f32;
            }
        }
    }
}

/// Root mean square over the sphere of the harmonics with these coefficients
/// (Parseval: the mean square is the sum of squares over 4π).
fn spread(terms: &mut dyn Iterator<Item = f32>) -> f64 {
    let squares: f64 = terms.map(|c| f64::from(c).powi(2)).sum();
    (squares / (4.0 * std::f64::consts::PI)).sqrt()
}

/// The mean gray, of a Gaussian that is black from everywhere the brightest that looks
/// the same: of a darker one, which is drawn as black, the channels that its color
/// raises would stay black too.
fn shown_gray(luma: &[f32]) -> f64 {
    let mean = 0.5 + sh::C0 * f64::from(luma[0]);
    mean.max(darkest(&mut luma[1..].iter().copied()))
}

/// The least mean of a value that shows from somewhere, black being 0 and `rest` its
/// harmonics beyond the constant one.
///
/// The squares of all K of their basis functions sum to K / 4π in every direction
/// (Unsöld 1927), so √K times their spread bounds what they add.
pub(super) fn darkest(rest: &mut dyn Iterator<Item = f32>) -> f64 {
    let rest: Vec<f32> = rest.collect();
    -(rest.len() as f64).sqrt() * spread(&mut rest.iter().copied())
}

/// sRGB of a gray with a/b: the gray itself plus what the a/b change at a lightness and
/// chroma at which the pixel may well be.
///
/// A single Gaussian is often darker than black or brighter than white, where no
/// color is left: what it adds to a pixel of middling gray would be lost. So it is with
/// a/b beyond any pixel's, which others outweigh. Nor is it brought into the gamut: the
/// sum is what is shown, and viewers clip that.
fn color(gray: f64, ab: [f64; 2]) -> [f64; 3] {
    let likely = gray.clamp(LIKELY_GRAY[0], LIKELY_GRAY[1]);
    let excess = (ab[0].hypot(ab[1]) / LIKELY_CHROMA).max(1.0);
    lab_to_srgb([gray_to_lightness(likely), ab[0] / excess, ab[1] / excess])
        .map(|v| gray + excess * (v - likely))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one(luma: &[f32], chroma: &[f32], degrees: [u32; 2]) -> Vec<f32> {
        let splats = Splats {
            means: vec![[0.0; 3]],
            quats: vec![[1.0, 0.0, 0.0, 0.0]],
            log_scales: vec![[0.0; 3]],
            opacity_logits: vec![0.0],
            sh: ShField {
                degree: degrees[0],
                channels: 1,
                coefficients: luma.to_vec(),
            },
        };
        let chroma = ShField {
            degree: degrees[1],
            channels: 2,
            coefficients: chroma.to_vec(),
        };
        bake_rgb(&splats, &chroma).sh.coefficients
    }

    #[test]
    fn gray_stays_gray_with_all_its_harmonics() {
        let luma = [0.3, 0.1, -0.2, 0.05];
        let baked = one(&luma, &[0.0, 0.0], [1, 0]);
        for (k, &c) in luma.iter().enumerate() {
            for channel in 0..3 {
                assert!((baked[3 * k + channel] - c).abs() < 1e-4, "{k} {channel}");
            }
        }
    }

    #[test]
    fn a_constant_color_is_exact() {
        let (gray, ab) = (0.55, [12.0, -18.0]);
        let luma = [((gray - 0.5) / sh::C0) as f32];
        let baked = one(&luma, &ab.map(|v| (v / sh::C0) as f32), [0, 0]);
        let wanted = lab_to_srgb([gray_to_lightness(gray), ab[0], ab[1]]);
        for channel in 0..3 {
            let shown = 0.5 + sh::C0 * f64::from(baked[channel]);
            assert!((shown - wanted[channel]).abs() < 1e-5);
        }
    }

    /// A pair that blends to a middling gray keeps its color, wherever each stands that is
    /// not drawn as black.
    #[test]
    fn colors_survive_beyond_white() {
        let ab = [20.0, -30.0];
        let shown = |gray: f64| {
            let luma = [((gray - 0.5) / sh::C0) as f32];
            let baked = one(&luma, &ab.map(|v| (v / sh::C0) as f32), [0, 0]);
            [0, 1, 2].map(|channel| (0.5 + sh::C0 * f64::from(baked[channel])).max(0.0))
        };
        let (dark, bright) = (shown(0.1), shown(1.3));
        let blended = [0, 1, 2].map(|channel| (dark[channel] + bright[channel]) / 2.0);
        let wanted = lab_to_srgb([gray_to_lightness(0.7), ab[0], ab[1]]);
        for channel in 0..3 {
            assert!(
                (blended[channel] - wanted[channel]).abs() < 0.03,
                "{blended:?} {wanted:?}"
            );
        }
    }

    #[test]
    fn what_others_outweigh_is_outweighed() {
        let gray = 0.3;
        let shown = |ab: [f64; 2]| {
            let luma = [((gray - 0.5) / sh::C0) as f32];
            let baked = one(&luma, &ab.map(|v| (v / sh::C0) as f32), [0, 0]);
            [0, 1, 2].map(|channel| 0.5 + sh::C0 * f64::from(baked[channel]))
        };
        // Far outside any gamut; a quarter of it with three quarters of nearly gray.
        let (strong, weak) = (shown([-100.0, 80.0]), shown([10.0, -8.0]));
        let wanted = lab_to_srgb([gray_to_lightness(gray), -17.5, 14.0]);
        for channel in 0..3 {
            let blended = 0.25 * strong[channel] + 0.75 * weak[channel];
            assert!(
                (blended - wanted[channel]).abs() < 0.02,
                "{strong:?} {weak:?} {wanted:?}"
            );
        }
    }

    #[test]
    fn black_takes_the_channels_that_its_color_raises() {
        let shown = |luma: &[f32], degree| {
            let ab = [-20.0, 15.0].map(|v: f64| (v / sh::C0) as f32);
            let baked = one(luma, &ab, [degree, 0]);
            0.5 + sh::C0 * f64::from(baked[1])
        };
        let luma = |gray: f64| ((gray - 0.5) / sh::C0) as f32;
        let black = shown(&[luma(0.0)], 0);
        assert!(black > 0.02, "green is raised: {black}");
        assert!((shown(&[luma(-0.6)], 0) - black).abs() < 1e-6);
        // What may be lit from somewhere stays as dark as it was from elsewhere.
        let lit = [luma(-0.1), 0.0, 0.5, 0.0];
        assert!(shown(&lit, 1) < black - 0.09);
    }

    #[test]
    fn chroma_that_depends_on_the_direction_reaches_rgb() {
        // a rises along basis function 2 (z): red rises with it, green falls.
        let mut chroma = vec![0.0; 8];
        chroma[2 * 2] = 10.0;
        let baked = one(&[0.0], &chroma, [0, 1]);
        assert!(baked[3 * 2] > 0.0 && baked[3 * 2 + 1] < 0.0);
    }
}
