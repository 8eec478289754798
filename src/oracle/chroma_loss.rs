//! The chroma loss: a smooth L1, averaged over pixels and both channels, or of the
//! distance of a/b; for the solver, with what weighs and corrects the teacher.

use super::constants::CHROMA_EPSILON;
use super::{Number, lift, seed};

/// `√(r² + ε²) - ε` of a residual in Lab units (Charbonnier et al. 1994).
pub fn smooth_l1<T: Number>(residual: T) -> T {
    (residual * residual + CHROMA_EPSILON * CHROMA_EPSILON).sqrt() - CHROMA_EPSILON
}

/// `(1 - exp(-decline · ρ)) / decline` of the smooth L1 ρ (Welsch's function, of ρ instead
/// of its square): levels off at `1 / decline`. With a decline of 0, ρ itself.
pub fn declining<T: Number>(residual: T, decline: f64) -> T {
    leveled(smooth_l1(residual), decline)
}

/// [`declining`] of the distance of both residuals, `√(a² + b² + ε²) - ε`.
pub fn declining_distance<T: Number>([a, b]: [T; 2], decline: f64) -> T {
    let squares = a * a + b * b + CHROMA_EPSILON * CHROMA_EPSILON;
    leveled(squares.sqrt() - CHROMA_EPSILON, decline)
}

fn leveled<T: Number>(length: T, decline: f64) -> T {
    if decline > 0.0 {
        (T::one() - (-length * decline).exp()) / decline
    } else {
        length
    }
}

/// Slope of [`declining`] over the residual; at 0 its limit `1 / ε`.
pub fn curvature(residual: f64, decline: f64) -> f64 {
    if residual == 0.0 {
        1.0 / CHROMA_EPSILON
    } else {
        declining(seed(residual), decline).eps / residual
    }
}

/// The loss of rendered a/b against the target's, both `[pixels][2]`.
pub fn chroma_loss<T: Number>(rendered: &[[T; 2]], target: &[[f64; 2]]) -> T {
    let mut sum = T::zero();
    for (r, t) in rendered.iter().flatten().zip(target.iter().flatten()) {
        sum += smooth_l1(*r - *t);
    }
    sum / (2 * rendered.len()) as f64
}

/// The loss's gradient with respect to `rendered`; each term has one variable.
pub fn chroma_loss_gradient(rendered: &[[f64; 2]], target: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let count = (2 * rendered.len()) as f64;
    (rendered.iter().zip(target))
        .map(|(r, t)| [0, 1].map(|c| smooth_l1(seed(r[c]) - t[c]).eps / count))
        .collect()
}

/// A teacher's a/b with their weights and correction, as the loss takes them.
#[derive(Clone, Debug)]
pub struct AbTargets {
    /// Wanted a/b, `[pixels][2]`.
    pub wanted: Vec<[f64; 2]>,
    /// Weight of each pixel; above 1 for those painted by hand.
    pub weights: Vec<f64>,
    /// Rows of what wanted a/b are multiplied by, painted ones excepted.
    pub gain: [[f64; 2]; 2],
    /// Added after the gain, in Lab units.
    pub offset: [f64; 2],
    /// See [`declining`]; painted pixels never decline.
    pub decline: f64,
    /// True if a and b are judged by their distance, half of which is each one's.
    pub joint: bool,
}

impl AbTargets {
    /// Target and decline of pixel `p`.
    fn of(&self, p: usize) -> ([f64; 2], f64) {
        let [a, b] = self.wanted[p];
        if self.weights[p] > 1.0 {
            return ([a, b], 0.0);
        }
        let target = [0, 1].map(|c| self.gain[c][0] * a + self.gain[c][1] * b + self.offset[c]);
        (target, self.decline)
    }

    /// The loss of rendered a/b, `[pixels][2]`.
    pub fn loss<T: Number>(&self, rendered: &[[T; 2]]) -> T {
        let mut sum = T::zero();
        for (p, r) in rendered.iter().enumerate() {
            let (target, decline) = self.of(p);
            let apart = [0, 1].map(|c| r[c] - target[c]);
            let both = match self.joint {
                true => declining_distance(apart, decline),
                false => declining(apart[0], decline) + declining(apart[1], decline),
            };
            sum += both * self.weights[p];
        }
        sum / (2 * rendered.len()) as f64
    }

    /// For each pixel and channel, slope of the loss and slope over residual.
    pub fn slopes(&self, rendered: &[[f64; 2]]) -> [Vec<[f64; 2]>; 2] {
        let count = (2 * rendered.len()) as f64;
        let each = |of: &dyn Fn([f64; 2], f64) -> [f64; 2]| {
            (rendered.iter().enumerate())
                .map(|(p, r)| {
                    let (target, decline) = self.of(p);
                    let apart = [0, 1].map(|c| r[c] - target[c]);
                    of(apart, decline).map(|slope| self.weights[p] * slope / count)
                })
                .collect()
        };
        let slopes = |apart: [f64; 2], decline| match self.joint {
            true => [0, 1].map(|c| {
                let mut dual = apart.map(lift);
                dual[c].eps = 1.0;
                declining_distance(dual, decline).eps
            }),
            false => apart.map(|residual| declining(seed(residual), decline).eps),
        };
        let curvatures = |apart: [f64; 2], decline| match self.joint {
            // The distance's own, in either direction.
            true => [curvature(apart[0].hypot(apart[1]), decline); 2],
            false => apart.map(|residual| curvature(residual, decline)),
        };
        [each(&slopes), each(&curvatures)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_values() {
        assert_eq!(smooth_l1(0.0), 0.0);
        // 5-12-13: r = 1.2, ε = 0.5 gives 1.3 - 0.5.
        assert!((smooth_l1(1.2_f64) - 0.8).abs() < 1e-15);
        assert!((smooth_l1(1e6_f64) - (1e6 - 0.5)).abs() < 1e-6);
        let loss = chroma_loss(&[[1.2, 0.0], [0.0, -1.2_f64]], &[[0.0; 2]; 2]);
        assert!((loss - 0.4).abs() < 1e-15);
    }

    #[test]
    fn derivative_is_r_over_its_root() {
        for residual in [-80.0, -0.5, -1e-9, 0.0, 0.1, 3.0, 200.0_f64] {
            let expected = residual / (residual * residual + 0.25).sqrt();
            assert!((smooth_l1(seed(residual)).eps - expected).abs() < 1e-15);
        }
    }

    #[test]
    fn gradient_is_that_of_the_whole_loss() {
        let rendered = [[10.0, -3.0], [0.2, 55.0], [7.0, 7.0]];
        let target = [[9.0, -3.0], [0.0, 60.0], [-7.0, 7.25]];
        let gradient = chroma_loss_gradient(&rendered, &target);
        for pixel in 0..3 {
            for channel in 0..2 {
                let mut dual = rendered.map(|p| p.map(lift));
                dual[pixel][channel].eps = 1.0;
                let whole = chroma_loss(&dual, &target).eps;
                assert!((whole - gradient[pixel][channel]).abs() < 1e-16);
            }
        }
    }

    #[test]
    fn a_declining_loss_levels_off() {
        assert_eq!(declining(0.0, 0.1), 0.0);
        assert_eq!(declining(1.2_f64, 0.0), smooth_l1(1.2));
        // ρ(1.2) = 0.8.
        assert!((declining(1.2_f64, 0.5) - 2.0 * (1.0 - (-0.4_f64).exp())).abs() < 1e-15);
        assert!((declining(1e4_f64, 0.1) - 10.0).abs() < 1e-12);
        // A decline that is all but none changes all but nothing.
        assert!((declining(30.0_f64, 1e-9) - smooth_l1(30.0)).abs() < 1e-5);
    }

    /// Reweighting descends: the parabola with this curvature that touches the loss lies above it
    /// everywhere (Lange 2016, chapter 4).
    #[test]
    fn the_curvature_is_that_of_a_parabola_above() {
        for decline in [0.0, 0.05, 0.3] {
            for at in [-40.0, -0.7, 0.0, 0.2, 9.0] {
                let curve = curvature(at, decline);
                for x in (-200..=200).map(|k| 0.5 * f64::from(k)) {
                    let parabola = declining(at, decline) + 0.5 * curve * (x * x - at * at);
                    assert!(
                        parabola >= declining(x, decline) - 1e-12,
                        "{decline} {at} {x}"
                    );
                }
            }
            // No jump at zero.
            assert!((curvature(1e-7, decline) - 2.0).abs() < 1e-6);
        }
    }

    /// Turning the a, b plane turns the slope and changes nothing else.
    #[test]
    fn a_distance_knows_no_axes() {
        let at = |[a, b]: [f64; 2], joint: bool| {
            let teaching = AbTargets {
                wanted: vec![[0.0; 2]],
                weights: vec![1.0],
                gain: [[1.0, 0.0], [0.0, 1.0]],
                offset: [0.0; 2],
                decline: 0.1,
                joint,
            };
            (teaching.loss(&[[a, b]]), teaching.slopes(&[[a, b]])[1][0])
        };
        let (loss, curves) = at([13.0, 0.0], true);
        let (turned, turned_curves) = at([5.0, -12.0], true);
        assert!((loss - turned).abs() < 1e-14 && loss == 0.5 * declining(13.0, 0.1));
        assert_eq!(curves[0], curves[1]);
        assert!((curves[0] - turned_curves[0]).abs() < 1e-14);
        // Channel by channel, the one that is right is believed fully.
        let [wrong, right] = at([40.0, 0.0], false).1;
        assert!(right > 1000.0 * wrong);
    }

    fn teaching() -> AbTargets {
        AbTargets {
            wanted: vec![[9.0, -3.0], [0.0, 60.0], [-7.0, 7.25], [30.0, 1.0]],
            weights: vec![1.0, 0.25, 0.0, 50.0],
            gain: [[1.2, -0.1], [0.2, 0.8]],
            offset: [2.0, -1.0],
            decline: 0.2,
            joint: false,
        }
    }

    #[test]
    fn slopes_are_those_of_the_whole_taught_loss() {
        let rendered = [[10.0, -3.0], [0.2, 55.0], [7.0, 7.0], [29.0, -4.0]];
        for joint in [false, true] {
            let teaching = AbTargets {
                joint,
                ..teaching()
            };
            let [slopes, curvatures] = teaching.slopes(&rendered);
            for p in 0..4 {
                for c in 0..2 {
                    let mut dual = rendered.map(|p| p.map(lift));
                    dual[p][c].eps = 1.0;
                    let whole = teaching.loss(&dual).eps;
                    assert!((whole - slopes[p][c]).abs() < 1e-15, "{p} {c}");
                    let (target, _) = teaching.of(p);
                    let through = curvatures[p][c] * (rendered[p][c] - target[c]);
                    assert!((through - slopes[p][c]).abs() < 1e-15, "{p} {c}");
                }
            }
            assert_eq!(slopes[2], [0.0; 2]);
        }
        let teaching = teaching();
        // A painted pixel is taken as it is, and not doubted.
        assert_eq!(teaching.of(3), ([30.0, 1.0], 0.0));
        let painted = 50.0 / 8.0 * (smooth_l1(-1.0) + smooth_l1(-5.0_f64));
        let mut alone = teaching.clone();
        alone.weights[..3].fill(0.0);
        assert!((alone.loss(&rendered) - painted).abs() < 1e-14);
    }
}
