//! Colorfulness of a picture.

/// Colorfulness by D. Hasler and S. Süsstrunk, *Measuring Colorfulness in
/// Natural Images*, SPIE Human Vision and Electronic Imaging VIII (2003).
///
/// With the opponent axes `rg = R - G` and `yb = (R + G)/2 - B`, both signed:
/// `√(σ²rg + σ²yb) + 0.3 √(μ²rg + μ²yb)`. `rgb` is encoded sRGB in `[0, 1]`;
/// the result is on the paper's scale of 0 to 255: 0 is not colorful, 15
/// slightly, 33 moderately, 45 averagely, 59 quite, 82 highly, 109 extremely.
/// No pixels give 0; a NaN anywhere gives NaN.
pub fn colorfulness(rgb: &[[f32; 3]]) -> f64 {
    if rgb.is_empty() {
        return 0.0;
    }
    let opponents = || {
        rgb.iter().map(|pixel| {
            let [r, g, b] = pixel.map(|c| 255.0 * f64::from(c));
            [r - g, 0.5 * (r + g) - b]
        })
    };
    let mean = |sum: [f64; 2]| sum.map(|s| s / rgb.len() as f64);
    let add = |[p, q]: [f64; 2], [r, s]: [f64; 2]| [p + r, q + s];
    // Two passes: the mean first, for its squares would cancel.
    let center = mean(opponents().fold([0.0; 2], add));
    let variance = mean(
        opponents()
            .map(|[rg, yb]| [(rg - center[0]).powi(2), (yb - center[1]).powi(2)])
            .fold([0.0; 2], add),
    );
    (variance[0] + variance[1]).sqrt() + 0.3 * center[0].hypot(center[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gray_is_not_colorful() {
        let gray: Vec<[f32; 3]> = (0..50).map(|i| [i as f32 / 50.0; 3]).collect();
        assert_eq!(colorfulness(&gray), 0.0);
        assert_eq!(colorfulness(&[]), 0.0);
    }

    #[test]
    fn one_color_has_its_mean_alone() {
        // rg = 255, yb = 127.5.
        let want = 0.3 * 255_f64.hypot(127.5);
        assert!((colorfulness(&[[1.0, 0.0, 0.0]; 9]) - want).abs() < 1e-9);
    }

    #[test]
    fn the_sign_matters() {
        // Red and green: rg = ±255, yb = 127.5 in both.
        let both = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert!((colorfulness(&both) - (255.0 + 0.3 * 127.5)).abs() < 1e-9);
    }

    #[test]
    fn not_a_number_is_not_hidden() {
        assert!(colorfulness(&[[0.5; 3], [f32::NAN, 0.0, 0.0]]).is_nan());
    }
}
