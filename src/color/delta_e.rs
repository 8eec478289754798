//! The CIEDE2000 color difference.

use std::f64::consts::{PI, TAU};

/// CIEDE2000 between two Lab colors, with kL = kC = kH = 1.
///
/// Formula and numbering: G. Sharma, W. Wu, E. N. Dalal, *The CIEDE2000
/// Color-Difference Formula: Implementation Notes, Supplementary Test Data, and
/// Mathematical Observations*, Color Research and Application 30 (2005).
pub fn ciede2000([l1, a1, b1]: [f64; 3], [l2, a2, b2]: [f64; 3]) -> f64 {
    // Step 1: a' stretches a near the gray axis; then chroma C' and hue h'.
    let mean_c = 0.5 * (a1.hypot(b1) + a2.hypot(b2));
    let g = 0.5 * (1.0 - seventh_power_ratio(mean_c));
    let (a1, a2) = ((1.0 + g) * a1, (1.0 + g) * a2);
    let (c1, c2) = (a1.hypot(b1), a2.hypot(b2));
    let (h1, h2) = (hue(a1, b1), hue(a2, b2));

    // Step 2: differences. The hue takes the short way round.
    let chromatic = c1 * c2 != 0.0;
    let dh = match h2 - h1 {
        _ if !chromatic => 0.0,
        d if d > PI => d - TAU,
        d if d < -PI => d + TAU,
        d => d,
    };
    let (dl, dc) = (l2 - l1, c2 - c1);
    let dh = 2.0 * (c1 * c2).sqrt() * (0.5 * dh).sin();

    // Step 3: means, weights S, and the rotation that blue needs.
    let mean_l = 0.5 * (l1 + l2);
    let mean_c = 0.5 * (c1 + c2);
    let mean_h = match h1 + h2 {
        sum if !chromatic => sum,
        sum if (h1 - h2).abs() <= PI => 0.5 * sum,
        sum if sum < TAU => 0.5 * (sum + TAU),
        sum => 0.5 * (sum - TAU),
    };
    let t = 1.0 - 0.17 * (mean_h - 30_f64.to_radians()).cos()
        + 0.24 * (2.0 * mean_h).cos()
        + 0.32 * (3.0 * mean_h + 6_f64.to_radians()).cos()
        - 0.20 * (4.0 * mean_h - 63_f64.to_radians()).cos();
    let distance = (mean_l - 50.0).powi(2);
    let s_l = 1.0 + 0.015 * distance / (20.0 + distance).sqrt();
    let s_c = 1.0 + 0.045 * mean_c;
    let s_h = 1.0 + 0.015 * mean_c * t;
    let d_theta = 30_f64.to_radians() * (-((mean_h.to_degrees() - 275.0) / 25.0).powi(2)).exp();
    let rotation = -2.0 * seventh_power_ratio(mean_c) * (2.0 * d_theta).sin();

    let (dl, dc, dh) = (dl / s_l, dc / s_c, dh / s_h);
    let squared = dl * dl + dc * dc + dh * dh + rotation * dc * dh;
    // The form is not negative, though rounding may make it so near zero; a
    // comparison lets NaN through where `max` would hide it.
    if squared < 0.0 { 0.0 } else { squared.sqrt() }
}

/// `sqrt(c⁷ / (c⁷ + 25⁷))`.
fn seventh_power_ratio(c: f64) -> f64 {
    let c7 = c.powi(7);
    (c7 / (c7 + 25_f64.powi(7))).sqrt()
}

/// Hue angle in `[0, 2π)`; 0 for gray.
fn hue(a: f64, b: f64) -> f64 {
    let angle = b.atan2(a);
    if angle < 0.0 { angle + TAU } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Table 1 of Sharma, Wu and Dalal (2005): two Lab colors and ΔE00.
    const SHARMA: [([f64; 3], [f64; 3], f64); 34] = [
        ([50.0, 2.6772, -79.7751], [50.0, 0.0, -82.7485], 2.0425),
        ([50.0, 3.1571, -77.2803], [50.0, 0.0, -82.7485], 2.8615),
        ([50.0, 2.8361, -74.0200], [50.0, 0.0, -82.7485], 3.4412),
        ([50.0, -1.3802, -84.2814], [50.0, 0.0, -82.7485], 1.0000),
        ([50.0, -1.1848, -84.8006], [50.0, 0.0, -82.7485], 1.0000),
        ([50.0, -0.9009, -85.5211], [50.0, 0.0, -82.7485], 1.0000),
        ([50.0, 0.0, 0.0], [50.0, -1.0, 2.0], 2.3669),
        ([50.0, -1.0, 2.0], [50.0, 0.0, 0.0], 2.3669),
        ([50.0, 2.4900, -0.0010], [50.0, -2.4900, 0.0009], 7.1792),
        ([50.0, 2.4900, -0.0010], [50.0, -2.4900, 0.0010], 7.1792),
        ([50.0, 2.4900, -0.0010], [50.0, -2.4900, 0.0011], 7.2195),
        ([50.0, 2.4900, -0.0010], [50.0, -2.4900, 0.0012], 7.2195),
        ([50.0, -0.0010, 2.4900], [50.0, 0.0009, -2.4900], 4.8045),
        ([50.0, -0.0010, 2.4900], [50.0, 0.0010, -2.4900], 4.8045),
        ([50.0, -0.0010, 2.4900], [50.0, 0.0011, -2.4900], 4.7461),
        ([50.0, 2.5, 0.0], [50.0, 0.0, -2.5], 4.3065),
        ([50.0, 2.5, 0.0], [73.0, 25.0, -18.0], 27.1492),
        ([50.0, 2.5, 0.0], [61.0, -5.0, 29.0], 22.8977),
        ([50.0, 2.5, 0.0], [56.0, -27.0, -3.0], 31.9030),
        ([50.0, 2.5, 0.0], [58.0, 24.0, 15.0], 19.4535),
        ([50.0, 2.5, 0.0], [50.0, 3.1736, 0.5854], 1.0000),
        ([50.0, 2.5, 0.0], [50.0, 3.2972, 0.0], 1.0000),
        ([50.0, 2.5, 0.0], [50.0, 1.8634, 0.5757], 1.0000),
        ([50.0, 2.5, 0.0], [50.0, 3.2592, 0.3350], 1.0000),
        (
            [60.2574, -34.0099, 36.2677],
            [60.4626, -34.1751, 39.4387],
            1.2644,
        ),
        (
            [63.0109, -31.0961, -5.8663],
            [62.8187, -29.7946, -4.0864],
            1.2630,
        ),
        (
            [61.2901, 3.7196, -5.3901],
            [61.4292, 2.2480, -4.9620],
            1.8731,
        ),
        (
            [35.0831, -44.1164, 3.7933],
            [35.0232, -40.0716, 1.5901],
            1.8645,
        ),
        (
            [22.7233, 20.0904, -46.6940],
            [23.0331, 14.9730, -42.5619],
            2.0373,
        ),
        (
            [36.4612, 47.8580, 18.3852],
            [36.2715, 50.5065, 21.2231],
            1.4146,
        ),
        (
            [90.8027, -2.0831, 1.4410],
            [91.1528, -1.6435, 0.0447],
            1.4441,
        ),
        (
            [90.9257, -0.5406, -0.9208],
            [88.6381, -0.8985, -0.7239],
            1.5381,
        ),
        (
            [6.7747, -0.2908, -2.4247],
            [5.8714, -0.0985, -2.2286],
            0.6377,
        ),
        (
            [2.0776, 0.0795, -1.1350],
            [0.9033, -0.0636, -0.5514],
            0.9082,
        ),
    ];

    #[test]
    fn published_pairs() {
        for (i, (x, y, want)) in SHARMA.into_iter().enumerate() {
            let got = ciede2000(x, y);
            assert!((got - want).abs() < 5.1e-5, "pair {}: {got} {want}", i + 1);
        }
    }

    #[test]
    fn symmetric_and_zero_on_itself() {
        for (x, y, _) in SHARMA {
            assert!((ciede2000(x, y) - ciede2000(y, x)).abs() < 1e-12);
            assert_eq!(ciede2000(x, x), 0.0);
        }
    }

    #[test]
    fn not_a_number_is_not_hidden() {
        assert!(ciede2000([f64::NAN, 0.0, 0.0], [50.0, 0.0, 0.0]).is_nan());
    }
}
