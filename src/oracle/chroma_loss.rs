//! The chroma loss: a smooth L1, averaged over pixels and both channels.

use super::constants::CHROMA_EPSILON;
use super::{Number, seed};

/// `√(r² + ε²) - ε` of a residual in Lab units (Charbonnier et al. 1994).
pub fn smooth_l1<T: Number>(residual: T) -> T {
    (residual * residual + CHROMA_EPSILON * CHROMA_EPSILON).sqrt() - CHROMA_EPSILON
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

#[cfg(test)]
mod tests {
    use super::super::lift;
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
}
