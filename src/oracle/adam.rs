//! One step of Adam (Kingma, Ba 2015, algorithm 1).

use super::Number;
use super::constants::{ADAM_BETA1, ADAM_BETA2, ADAM_EPSILON};

/// The running moments of one parameter; both start at zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments<T> {
    /// Mean of the gradients.
    pub first: T,
    /// Mean of their squares.
    pub second: T,
}

/// Updates `parameter` and its moments by `gradient`. `step` counts from 1.
pub fn adam<T: Number>(
    parameter: &mut T,
    moments: &mut Moments<T>,
    gradient: T,
    learning_rate: f64,
    step: i32,
) {
    moments.first = moments.first * ADAM_BETA1 + gradient * (1.0 - ADAM_BETA1);
    moments.second = moments.second * ADAM_BETA2 + gradient * gradient * (1.0 - ADAM_BETA2);
    let first = moments.first / (1.0 - ADAM_BETA1.powi(step));
    let second = moments.second / (1.0 - ADAM_BETA2.powi(step));
    *parameter -= first * learning_rate / (second.sqrt() + ADAM_EPSILON);
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: Moments<f64> = Moments {
        first: 0.0,
        second: 0.0,
    };

    #[test]
    fn first_step_is_the_learning_rate_against_the_sign() {
        for gradient in [-1e4, -2.0, -1e-6, 1e-9, 0.5, 3e6] {
            let (mut parameter, mut moments) = (1.0, START);
            adam(&mut parameter, &mut moments, gradient, 0.01, 1);
            assert!((parameter - (1.0 - 0.01 * gradient.signum())).abs() < 1e-7);
        }
    }

    #[test]
    fn zero_gradient_moves_nothing() {
        let (mut parameter, mut moments) = (1.0, START);
        adam(&mut parameter, &mut moments, 0.0, 0.01, 1);
        assert_eq!((parameter, moments), (1.0, START));
    }

    #[test]
    fn two_steps_by_hand() {
        let (mut parameter, mut moments) = (0.0, START);
        adam(&mut parameter, &mut moments, 1.0, 0.1, 1);
        adam(&mut parameter, &mut moments, -2.0, 0.1, 2);
        // m = 0.9·0.1 - 0.2 = -0.11, over 0.19; v = 0.000999 + 0.004, over 0.001999.
        let second = (-0.11 / 0.19) / (0.004_999_f64 / 0.001_999).sqrt();
        assert!((moments.first + 0.11).abs() < 1e-15);
        assert!((moments.second - 0.004_999).abs() < 1e-15);
        assert!((parameter - (-0.1 - 0.1 * second)).abs() < 1e-9);
    }

    #[test]
    fn finds_the_bottom_of_a_parabola() {
        let (mut parameter, mut moments) = (5.0, START);
        for step in 1..=2000 {
            let gradient = 2.0 * (parameter - 3.0);
            adam(&mut parameter, &mut moments, gradient, 0.02, step);
        }
        assert!((parameter - 3.0_f64).abs() < 1e-3);
    }
}
