//! The minimizer on quadratics whose least value is known.

use super::super::random::Random;
use super::*;

/// `BᵀB + I` of random B.
fn random_matrix(random: &mut Random, size: usize) -> Matrix {
    let b: Matrix = (0..size)
        .map(|_| (0..size).map(|_| random.range(-1.0, 1.0)).collect())
        .collect();
    let column = |i: usize| -> Vec<f64> { b.iter().map(|row| row[i]).collect() };
    (0..size)
        .map(|i| {
            (0..size)
                .map(|j| dot(&column(i), &column(j)) + f64::from(u8::from(i == j)))
                .collect()
        })
        .collect()
}

#[test]
fn elimination_solves() {
    let x = solve(vec![vec![4.0, 2.0], vec![2.0, 3.0]], &[2.0, 5.0]);
    assert!((x[0] + 0.5).abs() < 1e-15 && (x[1] - 2.0).abs() < 1e-15);
    let mut random = Random::new(1);
    let matrix = random_matrix(&mut random, 12);
    let right: Vec<f64> = (0..12).map(|_| random.range(-1.0, 1.0)).collect();
    let back = multiply(&matrix, &solve(matrix.clone(), &right));
    assert!(back.iter().zip(&right).all(|(a, b)| (a - b).abs() < 1e-12));
}

/// A quadratic whose least value is none.
struct Quadratic {
    matrix: Matrix,
    least: Vec<f64>,
    diagonal: Vec<f64>,
}

impl Quadratic {
    fn random(seed: u64, size: usize) -> Self {
        let mut random = Random::new(seed);
        let matrix = random_matrix(&mut random, size);
        // Sums of magnitudes bound any symmetric matrix.
        let sum = |row: &Vec<f64>| row.iter().map(|v| v.abs()).sum();
        Self {
            diagonal: matrix.iter().map(sum).collect(),
            least: (0..size).map(|_| random.range(-1.0, 1.0)).collect(),
            matrix,
        }
    }

    fn gradient(&self, x: &[f64]) -> Vec<f64> {
        let off: Vec<f64> = x.iter().zip(&self.least).map(|(x, l)| x - l).collect();
        multiply(&self.matrix, &off)
    }

    fn loss(&self, x: &[f64]) -> f64 {
        let off: Vec<f64> = x.iter().zip(&self.least).map(|(x, l)| x - l).collect();
        0.5 * dot(&off, &self.gradient(x))
    }
}

/// Far fewer steps than the majorizer alone takes.
#[test]
fn ends_where_the_loss_is_least() {
    let quadratic = Quadratic::random(2, 12);
    let free = vec![f64::NEG_INFINITY; 12];
    let mut lbfgs = Lbfgs::new(vec![0.0; 12], free, vec![0.0; 12]);
    let mut alone = vec![0.0; 12];
    for _ in 0..40 {
        let x = lbfgs.unknowns.clone();
        lbfgs.step(
            quadratic.loss(&x),
            &quadratic.gradient(&x),
            &quadratic.diagonal,
        );
        let g = quadratic.gradient(&alone);
        for (k, x) in alone.iter_mut().enumerate() {
            *x -= g[k] / quadratic.diagonal[k];
        }
    }
    lbfgs.end(quadratic.loss(&lbfgs.unknowns));
    let (found, slow) = (quadratic.loss(&lbfgs.unknowns), quadratic.loss(&alone));
    assert!(found < 1e-9 && slow > 1e-4, "{found} {slow}");
    // Nothing left to do moves nothing, and divides by no zero.
    let mut done = Lbfgs::new(vec![1.0], vec![f64::NEG_INFINITY], vec![0.0]);
    for _ in 0..3 {
        done.step(5.0, &[0.0], &[2.0]);
    }
    assert_eq!(done.unknowns, [1.0]);
}

/// A loss that rises, or is none, sends it back to where it was: first for a shorter
/// step, then for the majorizer's.
#[test]
fn a_step_that_raises_the_loss_is_undone() {
    let start = vec![3.0, -2.0];
    // A slope of -0.75 and a rise of 2.25: least after an eighth of the step. Of a loss
    // that is none, a tenth.
    for (bad, share) in [(7.25, 0.125), (f64::NAN, 0.1), (1e9, 0.1)] {
        let mut lbfgs = Lbfgs::new(start.clone(), vec![f64::NEG_INFINITY; 2], vec![0.0; 2]);
        lbfgs.step(5.0, &[1.0, -1.0], &[2.0, 4.0]);
        assert_eq!(lbfgs.unknowns, [2.5, -1.75]);
        lbfgs.step(bad, &[9.0, 9.0], &[1.0, 1.0]);
        let shorter = [3.0 - 0.5 * share, -2.0 + 0.25 * share];
        assert_eq!((lbfgs.undone, &lbfgs.unknowns[..]), (1, &shorter[..]));
        assert_eq!(lbfgs.moved(&[1.0, 1.0], 2), None);
        lbfgs.step(bad, &[9.0, 9.0], &[1.0, 1.0]);
        // Once more the majorizer's step from the start, with the diagonal there.
        assert_eq!((lbfgs.undone, &lbfgs.unknowns[..]), (2, &[2.5, -1.75][..]));
        lbfgs.step(4.0, &[0.5, -0.5], &[1.0, 1.0]);
        assert_eq!(lbfgs.unknowns, [2.0, -1.25]);
        assert_eq!(lbfgs.moved(&[1.0, 3.0], 2), Some(0.3125));
        lbfgs.end(4.1);
        assert_eq!(lbfgs.unknowns, [2.5, -1.75]);
        // Another function is another loss.
        lbfgs.restart();
        lbfgs.end(99.0);
        assert_eq!((lbfgs.undone, &lbfgs.unknowns[..]), (3, &[2.5, -1.75][..]));
    }
}

/// It comes to where no unknown can gain: the gradient is none where an unknown is above
/// its floor, and points below where it stands on it.
#[test]
fn ends_where_floors_allow_no_more() {
    let quadratic = Quadratic::random(3, 14);
    let mut random = Random::new(4);
    let floors: Vec<f64> = (0..14).map(|_| random.range(-0.5, 0.5)).collect();
    let mut lbfgs = Lbfgs::new(floors.clone(), floors.clone(), vec![0.0; 14]);
    for _ in 0..200 {
        let x = lbfgs.unknowns.clone();
        lbfgs.step(
            quadratic.loss(&x),
            &quadratic.gradient(&x),
            &quadratic.diagonal,
        );
    }
    let x = lbfgs.unknowns.clone();
    let left = quadratic.gradient(&x);
    let on_floor = (0..14).filter(|&k| x[k] <= floors[k]).count();
    assert!((3..12).contains(&on_floor), "{on_floor}");
    for k in 0..14 {
        if x[k] > floors[k] {
            assert!(left[k].abs() < 1e-6, "{k}: {}", left[k]);
        } else {
            assert!(x[k] == floors[k] && left[k] >= 0.0, "{k}: {}", left[k]);
        }
    }
}
