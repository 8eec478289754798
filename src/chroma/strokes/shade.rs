//! The color of paint where the thing beneath is darker or brighter.

use crate::color::{gamut_map_lab, srgb_to_lab};

/// The `L*` at which colors are kept.
const MIDDLE: f32 = 50.0;

/// CIELAB's own constant: light that is k times as strong multiplies `L* + 16`, a and b alike by
/// the third root of k, above some percents of white.
const FOOT: f32 = 16.0;

/// Darker surfaces than this, as `L*`, count as this: of what is almost black nobody sees
/// how colored it is.
const DARK: f32 = 10.0;

/// a and b of a surface at the middle lightness, from those at `lightness` (`L*`).
pub(crate) fn at_middle(color: [f32; 2], lightness: f32) -> [f32; 2] {
    let factor = (MIDDLE + FOOT) / (lightness.max(DARK) + FOOT);
    color.map(|value| factor * value)
}

/// a and b at `lightness` (`L*`) of a surface that has `middle` at the middle lightness: under
/// less or more light, and no more colorful than a display can show.
pub(crate) fn shaded(middle: [f32; 2], lightness: f32) -> [f32; 2] {
    let factor = (lightness.max(DARK) + FOOT) / (MIDDLE + FOOT);
    let [a, b] = middle.map(|value| f64::from(factor * value));
    let [_, a, b] = srgb_to_lab(gamut_map_lab([f64::from(lightness), a, b]));
    [a as f32, b as f32]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::{lab_to_linear, linear_to_lab};

    #[test]
    fn paint_in_the_shade_is_paint_under_less_light() {
        let lit = [60.0, 25.0, 18.0];
        let dim = linear_to_lab(lab_to_linear(lit).map(|v| 0.4 * v));
        let middle = at_middle([25.0, 18.0], 60.0);
        let found = shaded(middle, dim[0] as f32);
        for c in 0..2 {
            assert!(
                (f64::from(found[c]) - dim[c + 1]).abs() < 0.3,
                "{found:?} {dim:?}"
            );
        }
    }

    #[test]
    fn what_is_white_or_black_has_no_color() {
        for light in [0.0, 100.0] {
            let found = shaded([60.0, 40.0], light);
            assert!(found.iter().all(|v| v.abs() < 0.5), "{light}: {found:?}");
        }
    }
}
