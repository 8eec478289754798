//! Bringing Lab colors into the sRGB gamut.

use super::lab::lab_to_linear;
use super::srgb::linear_to_srgb;

/// Linear components may leave `[0, 1]` by this much before a color counts as
/// out of gamut: rounding of the Lab round trip, far below what 8 bits show.
const TOLERANCE: f64 = 1e-9;

/// Halvings of the chroma interval: 2⁻³² of the chroma is below 1e-7 in Lab.
const HALVINGS: u32 = 32;

/// Lab to encoded sRGB in `[0, 1]`, reducing chroma at constant `L*` and hue
/// until the color fits.
///
/// Colors in gamut are left untouched; clipping components instead would turn
/// the hue. `L*` is clamped to `[0, 100]` first. A component that is not
/// finite gives NaN in all three.
pub fn gamut_map_lab([l, a, b]: [f64; 3]) -> [f64; 3] {
    if !(l.is_finite() && a.is_finite() && b.is_finite()) {
        return [f64::NAN; 3];
    }
    let l = l.clamp(0.0, 100.0);
    let at = |scale: f64| lab_to_linear([l, scale * a, scale * b]);
    let full = at(1.0);
    let linear = if in_gamut(full) {
        full
    } else {
        let (mut inside, mut outside) = (0.0, 1.0);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (inside + outside);
            if in_gamut(at(middle)) {
                inside = middle;
            } else {
                outside = middle;
            }
        }
        at(inside)
    };
    linear.map(|c| linear_to_srgb(c.clamp(0.0, 1.0)))
}

fn in_gamut(linear: [f64; 3]) -> bool {
    linear
        .iter()
        .all(|c| (-TOLERANCE..=1.0 + TOLERANCE).contains(c))
}

#[cfg(test)]
mod tests {
    use super::super::{lab_to_srgb, srgb_to_lab};
    use super::*;

    #[test]
    fn colors_in_gamut_are_untouched() {
        for i in 0..11_i32.pow(3) {
            let rgb = [i % 11, i / 11 % 11, i / 121].map(|k| f64::from(k) / 10.0);
            let mapped = gamut_map_lab(srgb_to_lab(rgb));
            for (m, c) in mapped.iter().zip(rgb) {
                assert!((m - c).abs() < 1e-7, "{rgb:?} became {mapped:?}");
            }
        }
    }

    #[test]
    fn colors_out_of_gamut_keep_lightness_and_hue_and_reach_the_border() {
        for lightness in [1.0, 20.0, 50.0, 80.0, 99.0] {
            for degrees in (0..360).step_by(15) {
                let (sin, cos) = f64::from(degrees).to_radians().sin_cos();
                let lab = [lightness, 200.0 * cos, 200.0 * sin];
                assert!(!in_gamut(lab_to_linear(lab)));
                let rgb = gamut_map_lab(lab);
                assert!(rgb.iter().all(|c| (0.0..=1.0).contains(c)));
                let [l, a, b] = srgb_to_lab(rgb);
                assert!((l - lightness).abs() < 1e-4, "{lab:?} -> L* {l}");
                assert!((a * sin - b * cos).abs() < 1e-3, "{lab:?} turned its hue");
                assert!(a * cos + b * sin > 0.0, "{lab:?} crossed the gray axis");
                let edge = rgb.iter().any(|&c| !(1e-6..=1.0 - 1e-6).contains(&c));
                assert!(edge, "{lab:?} stopped inside at {rgb:?}");
            }
        }
    }

    #[test]
    fn black_and_white_with_chroma_become_neutral() {
        for (l, want) in [(0.0, 0.0), (100.0, 1.0), (-5.0, 0.0), (300.0, 1.0)] {
            for c in gamut_map_lab([l, 60.0, -40.0]) {
                assert!((c - want).abs() < 1e-6, "L* {l} became {c}");
            }
        }
    }

    #[test]
    fn clipping_would_have_turned_the_hue() {
        let lab = [50.0, 0.0, -100.0];
        let clipped = srgb_to_lab(lab_to_srgb(lab).map(|c| c.clamp(0.0, 1.0)));
        assert!(clipped[1].abs() > 5.0);
        assert!(srgb_to_lab(gamut_map_lab(lab))[1].abs() < 1e-3);
    }

    #[test]
    fn poison_comes_out_as_not_a_number() {
        for poison in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            for i in 0..3 {
                let mut lab = [50.0, 10.0, 10.0];
                lab[i] = poison;
                assert!(gamut_map_lab(lab).iter().all(|c| c.is_nan()));
            }
        }
        for huge in [1e38, -1e300, f64::MAX] {
            let rgb = gamut_map_lab([50.0, huge, 1.0]);
            assert!(rgb.iter().all(|c| (0.0..=1.0).contains(c)), "{rgb:?}");
        }
    }
}
