//! The loss of RGB pictures: their distance from what is wanted, in hundredths of black to
//! white, but for what is brighter than white where white is wanted.

use num_dual::DualNum;

use super::{
    Number,
    chroma_loss::{curvature, smooth_l1},
    lift,
};

/// Black to white.
const UNITS: f64 = 100.0;

/// Pictures and what they are compared with.
#[derive(Clone, Debug)]
pub struct RgbTargets {
    /// Wanted RGB, 0 to 1.
    pub rgb: Vec<[f64; 3]>,
    /// Weight of each pixel.
    pub weights: Vec<f64>,
}

impl RgbTargets {
    fn residual<T: Number>(&self, p: usize, drawn: &[T; 3]) -> [T; 3] {
        [0, 1, 2].map(|c| {
            let wanted = self.rgb[p][c];
            if wanted >= 1.0 && drawn[c].re() >= 1.0 {
                T::zero()
            } else {
                (drawn[c] - wanted) * UNITS
            }
        })
    }

    /// The loss of drawn RGB.
    pub fn loss<T: Number>(&self, drawn: &[[T; 3]]) -> T {
        let mut sum = T::zero();
        for (p, rgb) in drawn.iter().enumerate() {
            let [r, g, b] = self.residual(p, rgb);
            let square = r * r + g * g + b * b;
            // The root of nothing has no slope.
            if square.re() > 0.0 {
                sum += smooth_l1(square.sqrt()) * self.weights[p];
            }
        }
        sum * (0.5 / drawn.len() as f64)
    }

    /// Each pixel's slope of the loss, and its curvature with respect to drawn RGB.
    pub fn slopes(&self, drawn: &[[f64; 3]]) -> Vec<[f64; 4]> {
        let scale = 0.5 / drawn.len() as f64;
        (drawn.iter().enumerate())
            .map(|(p, rgb)| {
                let slope = |c: usize| {
                    let mut dual = rgb.map(lift);
                    dual[c].eps = 1.0;
                    let [r, g, b] = self.residual(p, &dual);
                    let square = r * r + g * g + b * b;
                    if square.re > 0.0 {
                        smooth_l1(square.sqrt()).eps
                    } else {
                        0.0
                    }
                };
                let residual = self.residual(p, rgb);
                let length = residual.iter().map(|r| r * r).sum::<f64>().sqrt();
                let curves = UNITS * UNITS * curvature(length, 0.0);
                [slope(0), slope(1), slope(2), curves].map(|v| v * self.weights[p] * scale)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slopes_are_those_of_the_whole_loss() {
        let wanted = RgbTargets {
            rgb: vec![[0.2, 1.0, 0.7], [1.0, 1.0, 1.0], [0.0, 0.5, 1.0]],
            weights: vec![1.0, 0.5, 0.0],
        };
        let drawn = [[0.3, 1.5, 0.7], [0.9, 1.25, 1.0], [0.1, 0.1, 0.1]];
        let slopes = wanted.slopes(&drawn);
        for p in 0..3 {
            for c in 0..3 {
                let mut dual = drawn.map(|rgb| rgb.map(lift));
                dual[p][c].eps = 1.0;
                assert!((wanted.loss(&dual).eps - slopes[p][c]).abs() < 1e-14);
            }
        }
        // Brighter than white is white.
        assert_eq!(slopes[0][1], 0.0);
        assert_eq!(slopes[2], [0.0; 4]);
    }

    #[test]
    fn a_known_value() {
        let wanted = RgbTargets {
            rgb: vec![[0.0; 3]],
            weights: vec![1.0],
        };
        // 5-12-13 with the smoothing of half a unit.
        let loss = wanted.loss(&[[0.012, 0.0, 0.0_f64]]);
        assert!((loss - 0.5 * 0.8).abs() < 1e-12);
    }
}
