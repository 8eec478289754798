//! The loss of the recipes that RGB splats are colored by elsewhere: differences in CIELAB,
//! agreement with a coarser picture, total variation.

use super::{Number, chroma_loss::smooth_l1, constants::CHROMA_EPSILON, lift};

/// Linear sRGB to X, Y and Z relative to white: ITU-R BT.709 primaries and D65 in six digits,
/// rows divided by their sums.
pub const RELATIVE_XYZ: [[f64; 3]; 3] = [
    [
        0.412453 / 0.950456,
        0.357580 / 0.950456,
        0.180423 / 0.950456,
    ],
    [0.212671, 0.715160, 0.072169],
    [
        0.019334 / 1.088754,
        0.119193 / 1.088754,
        0.950227 / 1.088754,
    ],
];

/// Black to white in CIELAB's lightness.
const UNITS: f64 = 100.0;

/// L, a and b of encoded sRGB.
pub fn lab<T: Number>(rgb: [T; 3]) -> [T; 3] {
    let linear = rgb.map(|v| match v.re() <= 0.04045 {
        true => v / 12.92,
        false => ((v + 0.055) / 1.055).powf(2.4),
    });
    let delta: f64 = 6.0 / 29.0;
    let [x, y, z] = RELATIVE_XYZ.map(|[r, g, b]| {
        let t = linear[0] * r + linear[1] * g + linear[2] * b;
        match t.re() <= delta.powi(3) {
            true => t / (3.0 * delta * delta) + 4.0 / 29.0,
            false => t.cbrt(),
        }
    });
    [y * 116.0 - 16.0, (x - y) * 500.0, (y - z) * 200.0]
}

/// Weights of the loss's terms.
#[derive(Clone, Copy, Debug)]
pub struct LabWeights {
    /// Weight of the difference in lightness.
    pub lightness: f64,
    /// True if the difference in lightness is squared.
    pub squared: bool,
    /// Weight of the differences in a and in b.
    pub chroma: f64,
    /// Weight of a's and b's agreement with the coarser image.
    pub agreement: f64,
    /// Weight of the total variation of R, G and B.
    pub variation: f64,
}

/// Pictures `[height, width]`, and what they are compared with.
#[derive(Clone, Debug)]
pub struct LabTarget {
    /// Width and height.
    pub size: [usize; 2],
    /// Wanted RGB, 0 to 1.
    pub rgb: Vec<[f64; 3]>,
    /// Weight of each pixel.
    pub weights: Vec<f64>,
    /// Size and RGB of the coarser picture, where there is one.
    pub coarser: Option<([usize; 2], Vec<[f64; 3]>)>,
    /// Weights of the loss's terms.
    pub of: LabWeights,
}

impl LabTarget {
    /// a and b of the coarser picture at pixel `p`, bilinear.
    fn coarse_ab(&self, p: usize) -> Option<[f64; 2]> {
        let (size, rgb) = self.coarser.as_ref()?;
        let at = [p % self.size[0], p / self.size[0]];
        let [x, y] = [0, 1].map(|k| {
            let place = (at[k] as f64 + 0.5) * size[k] as f64 / self.size[k] as f64 - 0.5;
            let low = place.max(0.0).floor();
            let high = (low as usize + 1).min(size[k] - 1);
            (low as usize, high, place.max(0.0) - low)
        });
        let ab = |column: usize, row: usize| {
            let [_, a, b] = lab(rgb[row * size[0] + column]);
            [a, b]
        };
        let mix = |p: [f64; 2], q: [f64; 2], t: f64| [0, 1].map(|k| p[k] * (1.0 - t) + q[k] * t);
        let top = mix(ab(x.0, y.0), ab(x.1, y.0), x.2);
        let bottom = mix(ab(x.0, y.1), ab(x.1, y.1), x.2);
        Some(mix(top, bottom, y.2))
    }

    /// Loss of pixel `p`, without the total variation.
    fn own<T: Number>(&self, p: usize, rgb: [T; 3]) -> T {
        let of = &self.of;
        let drawn = lab(rgb);
        let wanted = lab(self.rgb[p]);
        let [l, a, b] = [0, 1, 2].map(|k| drawn[k] - wanted[k]);
        let lightness = if of.squared { l * l } else { smooth_l1(l) };
        let chroma = smooth_l1(a) + smooth_l1(b);
        let mut sum = (lightness * of.lightness + chroma * of.chroma) * self.weights[p];
        if let Some(coarse) = self.coarse_ab(p) {
            let drift = smooth_l1(drawn[1] - coarse[0]) + smooth_l1(drawn[2] - coarse[1]);
            sum += drift * of.agreement;
        }
        sum
    }

    /// Pairs of neighbors, the first one left of or above the second.
    fn neighbors(&self) -> Vec<[usize; 2]> {
        let [width, height] = self.size;
        (0..width * height)
            .flat_map(|p| {
                let right = (p % width + 1 < width).then_some([p, p + 1]);
                let below = (p / width + 1 < height).then_some([p, p + width]);
                right.into_iter().chain(below)
            })
            .collect()
    }

    /// The loss of drawn RGB.
    pub fn loss<T: Number>(&self, drawn: &[[T; 3]]) -> T {
        let own = (drawn.iter().enumerate()).map(|(p, &rgb)| self.own(p, rgb));
        let mut sum = own.fold(T::zero(), |sum, own| sum + own);
        for [p, q] in self.neighbors() {
            for (&first, &second) in drawn[p].iter().zip(&drawn[q]) {
                sum += varied(first - second) * self.of.variation;
            }
        }
        sum / drawn.len() as f64
    }

    /// The loss's gradient with respect to drawn RGB.
    pub fn gradient(&self, drawn: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let count = drawn.len() as f64;
        let mut gradient: Vec<[f64; 3]> = (drawn.iter().enumerate())
            .map(|(p, rgb)| {
                [0, 1, 2].map(|c| {
                    let mut dual = rgb.map(lift);
                    dual[c].eps = 1.0;
                    self.own(p, dual).eps / count
                })
            })
            .collect();
        for [p, q] in self.neighbors() {
            for c in 0..3 {
                let apart = super::seed(drawn[p][c] - drawn[q][c]);
                let slope = self.of.variation * varied(apart).eps / count;
                gradient[p][c] += slope;
                gradient[q][c] -= slope;
            }
        }
        gradient
    }
}

/// `|r|` of a difference in RGB, smoothed as one in CIELAB is.
fn varied<T: Number>(r: T) -> T {
    let smoothing = CHROMA_EPSILON / UNITS;
    (r * r + smoothing * smoothing).sqrt() - smoothing
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;

    #[test]
    fn known_colors() {
        for (rgb, expected) in [
            ([0.0_f64; 3], [0.0; 3]),
            ([1.0; 3], [100.0, 0.0, 0.0]),
            ([1.0, 0.0, 0.0], [53.24, 80.09, 67.20]),
            ([0.0, 0.0, 1.0], [32.30, 79.19, -107.86]),
        ] {
            for (found, expected) in lab(rgb).iter().zip(expected) {
                assert!((found - expected).abs() < 0.03, "{rgb:?}: {found}");
            }
        }
    }

    fn target() -> (LabTarget, Vec<[f64; 3]>) {
        let mut random = Random::new(7);
        let mut rgb = |count: usize| (0..count).map(|_| random.array(0.0, 1.0)).collect();
        let target = LabTarget {
            size: [4, 3],
            rgb: rgb(12),
            weights: (0..12).map(|p| [1.0, 0.5, 0.0][p % 3]).collect(),
            coarser: Some(([2, 1], rgb(2))),
            of: LabWeights {
                lightness: 0.3,
                squared: true,
                chroma: 0.7,
                agreement: 0.4,
                variation: 2.0,
            },
        };
        (target, rgb(12))
    }

    #[test]
    fn the_gradient_is_that_of_the_whole_loss() {
        let (mut target, drawn) = target();
        for squared in [true, false] {
            target.of.squared = squared;
            let gradient = target.gradient(&drawn);
            for p in 0..12 {
                for c in 0..3 {
                    let mut dual: Vec<_> = drawn.iter().map(|rgb| rgb.map(lift)).collect();
                    dual[p][c].eps = 1.0;
                    let whole = target.loss(&dual).eps;
                    assert!((whole - gradient[p][c]).abs() < 1e-12, "{p} {c}");
                }
            }
        }
    }

    #[test]
    fn what_is_wanted_costs_nothing_but_its_variation() {
        let (mut target, drawn) = target();
        target.coarser = None;
        target.rgb.clone_from(&drawn);
        let all = target.loss(&drawn);
        target.of.variation = 0.0;
        assert!(target.loss(&drawn).abs() < 1e-14 && all > 0.1);
    }
}
