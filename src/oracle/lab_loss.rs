//! The loss of the recipes that RGB splats are colored by elsewhere: differences in CIELAB at
//! full size and pooled, agreement with a coarser picture, total variation.

use num_dual::Dual64;

use super::{Number, chroma_loss::smooth_l1, lift};

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

/// Black to white in CIELAB's lightness, and in R, G and B where these are compared.
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
    /// Coarser scales at which both pictures are pooled and compared.
    pub pooled: usize,
    /// True if R, G and B are compared in place of L, a and b.
    pub in_rgb: bool,
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

    /// A color as it is compared.
    fn compared<T: Number>(&self, rgb: [T; 3]) -> [T; 3] {
        match self.of.in_rgb {
            true => rgb.map(|v| v * UNITS),
            false => lab(rgb),
        }
    }

    /// Pixels that each pixel of a scale is the mean of: one at full size, four around its
    /// center at coarser ones.
    fn cells(&self, scale: usize) -> Vec<Vec<usize>> {
        let [width, height] = self.size.map(|side| side >> scale);
        let places = |cell: usize| match scale {
            0 => vec![cell],
            _ => {
                let center = (cell << scale) + (1 << (scale - 1));
                vec![center - 1, center]
            }
        };
        let cells = (0..height).flat_map(|row| (0..width).map(move |column| [column, row]));
        cells
            .map(|[column, row]| {
                let rows = places(row).into_iter();
                rows.flat_map(|y| {
                    places(column)
                        .into_iter()
                        .map(move |x| y * self.size[0] + x)
                })
                .collect()
            })
            .collect()
    }

    /// Loss of a pixel of a scale, the mean of those of `cell`, drawn as `rgb`.
    fn own<T: Number>(&self, cell: &[usize], rgb: [T; 3]) -> T {
        let of = &self.of;
        let known = (cell.iter().map(|&p| self.weights[p])).fold(f64::INFINITY, f64::min);
        let drawn = self.compared(rgb);
        let wanted = self.compared(mean(cell, &self.rgb));
        let [l, a, b] = [0, 1, 2].map(|k| drawn[k] - wanted[k]);
        let lightness = if of.squared { l * l } else { smooth_l1(l) };
        let chroma = smooth_l1(a) + smooth_l1(b);
        (lightness * of.lightness + chroma * of.chroma) * known
    }

    /// Disagreement of pixel `p` with the coarser picture.
    fn drift<T: Number>(&self, p: usize, rgb: [T; 3]) -> T {
        let Some(coarse) = self.coarse_ab(p) else {
            return T::zero();
        };
        let [_, a, b] = lab(rgb);
        (smooth_l1(a - coarse[0]) + smooth_l1(b - coarse[1])) * self.of.agreement
    }

    /// Pairs of neighbors, the first one left of the second or above it, each with its share
    /// of the total variation.
    fn neighbors(&self) -> Vec<([usize; 2], f64)> {
        let [width, height] = self.size;
        let across = (0..width * height).filter(|p| p % width + 1 < width);
        let down = 0..width * (height - 1);
        let pairs = [
            across.map(|p| [p, p + 1]).collect::<Vec<_>>(),
            down.map(|p| [p, p + width]).collect(),
        ];
        let shared = pairs.into_iter().flat_map(|pairs| {
            let share = 0.5 / (3 * pairs.len()) as f64;
            pairs.into_iter().map(move |pair| (pair, share))
        });
        shared.collect()
    }

    /// The loss of drawn RGB.
    pub fn loss<T: Number>(&self, drawn: &[[T; 3]]) -> T {
        let mut sum = T::zero();
        for scale in 0..=self.of.pooled {
            let cells = self.cells(scale);
            let share = 1.0 / (cells.len() * (1 + self.of.pooled)) as f64;
            for cell in cells {
                sum += self.own(&cell, mean(&cell, drawn)) * share;
            }
        }
        for (p, &rgb) in drawn.iter().enumerate() {
            sum += self.drift(p, rgb) / drawn.len() as f64;
        }
        for ([p, q], share) in self.neighbors() {
            for (&first, &second) in drawn[p].iter().zip(&drawn[q]) {
                sum += (first - second) * (first - second) * (share * self.of.variation);
            }
        }
        sum
    }

    /// The loss's gradient with respect to drawn RGB.
    pub fn gradient(&self, drawn: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut gradient = vec![[0.0; 3]; drawn.len()];
        let slopes = |rgb: [f64; 3], loss: &dyn Fn([Dual64; 3]) -> Dual64| {
            [0, 1, 2].map(|c| {
                let mut dual = rgb.map(lift);
                dual[c].eps = 1.0;
                loss(dual).eps
            })
        };
        for scale in 0..=self.of.pooled {
            let cells = self.cells(scale);
            let share = 1.0 / (cells.len() * (1 + self.of.pooled)) as f64;
            for cell in cells {
                let slopes = slopes(mean(&cell, drawn), &|rgb| self.own(&cell, rgb));
                for &p in &cell {
                    for c in 0..3 {
                        gradient[p][c] += slopes[c] * share / cell.len() as f64;
                    }
                }
            }
        }
        for (p, &rgb) in drawn.iter().enumerate() {
            let slopes = slopes(rgb, &|rgb| self.drift(p, rgb));
            for c in 0..3 {
                gradient[p][c] += slopes[c] / drawn.len() as f64;
            }
        }
        for ([p, q], share) in self.neighbors() {
            for c in 0..3 {
                let slope = 2.0 * share * self.of.variation * (drawn[p][c] - drawn[q][c]);
                gradient[p][c] += slope;
                gradient[q][c] -= slope;
            }
        }
        gradient
    }
}

/// Mean color of some pixels.
fn mean<T: Number>(cell: &[usize], rgb: &[[T; 3]]) -> [T; 3] {
    let sum = |c: usize| cell.iter().fold(T::zero(), |sum, &p| sum + rgb[p][c]);
    [0, 1, 2].map(|c| sum(c) / cell.len() as f64)
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
            size: [7, 5],
            rgb: rgb(35),
            weights: (0..35).map(|p| [1.0, 0.5, 0.0, 1.0, 1.0][p % 5]).collect(),
            coarser: Some(([2, 1], rgb(2))),
            of: LabWeights {
                lightness: 0.3,
                squared: true,
                chroma: 0.7,
                agreement: 0.4,
                variation: 2.0,
                pooled: 0,
                in_rgb: false,
            },
        };
        (target, rgb(35))
    }

    #[test]
    fn the_gradient_is_that_of_the_whole_loss() {
        let (mut target, drawn) = target();
        for (squared, pooled, in_rgb) in [(true, 0, false), (false, 2, false), (false, 1, true)] {
            target.of.squared = squared;
            target.of.pooled = pooled;
            target.of.in_rgb = in_rgb;
            let gradient = target.gradient(&drawn);
            for p in 0..35 {
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
        target.of.pooled = 2;
        target.rgb.clone_from(&drawn);
        let all = target.loss(&drawn);
        target.of.variation = 0.0;
        assert!(target.loss(&drawn).abs() < 1e-14 && all > 0.1);
    }
    /// As torch resizes at these factors: 2×2 means, and the middle ones of 4×4.
    #[test]
    fn coarser_pixels_lie_between_four() {
        let (target, _) = target();
        assert_eq!(target.cells(1).len(), 6);
        assert_eq!(target.cells(1)[4], [16, 17, 23, 24]);
        assert_eq!(target.cells(2), [[8, 9, 15, 16]]);
    }

    #[test]
    fn total_variation_is_half_of_two_mean_squares() {
        let (mut target, _) = target();
        target.of = LabWeights {
            lightness: 0.0,
            chroma: 0.0,
            agreement: 0.0,
            variation: 1.0,
            ..target.of
        };
        // A ramp across, in one channel.
        let ramp: Vec<[f64; 3]> = (0..35).map(|p| [0.1 * (p % 7) as f64, 0.5, 0.5]).collect();
        assert!((target.loss(&ramp) - 0.5 * 0.01 / 3.0).abs() < 1e-15);
    }
}
