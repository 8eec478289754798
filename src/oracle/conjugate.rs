//! Preconditioned conjugate gradients (Hestenes, Stiefel 1952; Saad 2003, algorithm
//! 9.1), with floors (Bertsekas 1982), and elimination to compare with.

/// A symmetric matrix, rows.
pub type Matrix = Vec<Vec<f64>>;

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `matrix · vector`.
pub fn multiply(matrix: &Matrix, vector: &[f64]) -> Vec<f64> {
    matrix.iter().map(|row| dot(row, vector)).collect()
}

/// Where the iteration stands.
#[derive(Clone, Debug)]
pub struct Conjugate {
    /// x.
    pub unknowns: Vec<f64>,
    /// b - Ax.
    pub residual: Vec<f64>,
    /// The direction of the next step.
    pub direction: Vec<f64>,
    /// What residuals are divided by; infinite for what is held at its floor.
    preconditioner: Vec<f64>,
    floors: Vec<f64>,
    rho: f64,
}

impl Conjugate {
    /// Begins at `unknowns`, whose residual is given. `diagonal` is positive; residuals are
    /// divided by it.
    pub fn new(unknowns: Vec<f64>, residual: Vec<f64>, diagonal: &[f64]) -> Self {
        let floors = vec![f64::NEG_INFINITY; unknowns.len()];
        Self::with_floors(unknowns, residual, diagonal, floors)
    }

    /// The same for unknowns none of which may fall below its floor: those that stand
    /// there and would are held.
    pub fn with_floors(
        unknowns: Vec<f64>,
        residual: Vec<f64>,
        diagonal: &[f64],
        floors: Vec<f64>,
    ) -> Self {
        let held = |k: usize| unknowns[k] <= floors[k] && residual[k] <= 0.0;
        let preconditioner: Vec<f64> = (0..unknowns.len())
            .map(|k| if held(k) { f64::INFINITY } else { diagonal[k] })
            .collect();
        let direction: Vec<f64> = (residual.iter().zip(&preconditioner))
            .map(|(r, m)| r / m)
            .collect();
        Self {
            rho: dot(&residual, &direction),
            unknowns,
            residual,
            direction,
            preconditioner,
            floors,
        }
    }

    /// Puts what went below its floor onto it. The residual is not that of the unknowns
    /// any more.
    pub fn end(&mut self) {
        for (unknown, floor) in self.unknowns.iter_mut().zip(&self.floors) {
            *unknown = unknown.max(*floor);
        }
    }

    /// One step; `product` is the matrix times the direction.
    pub fn step(&mut self, product: &[f64]) {
        let steepness = dot(&self.direction, product);
        let alpha = if steepness > 0.0 {
            self.rho / steepness
        } else {
            0.0
        };
        for (k, p) in product.iter().enumerate() {
            self.unknowns[k] += alpha * self.direction[k];
            self.residual[k] -= alpha * p;
        }
        let preconditioned: Vec<f64> = (self.residual.iter().zip(&self.preconditioner))
            .map(|(r, m)| r / m)
            .collect();
        let rho = dot(&self.residual, &preconditioned);
        let beta = if self.rho > 0.0 { rho / self.rho } else { 0.0 };
        for (direction, z) in self.direction.iter_mut().zip(preconditioned) {
            *direction = z + beta * *direction;
        }
        self.rho = rho;
    }
}

/// Solves `matrix · x = right` by elimination; the matrix is positive definite, so no
/// pivot has to be looked for.
pub fn solve(mut matrix: Matrix, right: &[f64]) -> Vec<f64> {
    let mut x = right.to_vec();
    for k in 0..x.len() {
        let (above, below) = matrix.split_at_mut(k + 1);
        let pivot = &above[k];
        for (i, row) in below.iter_mut().enumerate() {
            let factor = row[k] / pivot[k];
            for (value, p) in row[k..].iter_mut().zip(&pivot[k..]) {
                *value -= factor * p;
            }
            x[k + 1 + i] -= factor * x[k];
        }
    }
    for k in (0..x.len()).rev() {
        let known = dot(&matrix[k][k + 1..], &x[k + 1..]);
        x[k] = (x[k] - known) / matrix[k][k];
    }
    x
}

#[cfg(test)]
mod tests {
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

    /// In exact arithmetic it ends after as many steps as there are unknowns, with
    /// directions that the matrix makes orthogonal.
    #[test]
    fn ends_where_elimination_does() {
        let mut random = Random::new(2);
        let matrix = random_matrix(&mut random, 9);
        let right: Vec<f64> = (0..9).map(|_| random.range(-1.0, 1.0)).collect();
        let diagonal: Vec<f64> = (0..9).map(|k| matrix[k][k]).collect();
        let mut cg = Conjugate::new(vec![0.0; 9], right.clone(), &diagonal);
        for _ in 0..9 {
            let before = cg.direction.clone();
            cg.step(&multiply(&matrix, &before));
            let angle = dot(&cg.direction, &multiply(&matrix, &before));
            assert!(angle.abs() < 1e-10, "{angle}");
        }
        let wanted = solve(matrix, &right);
        let close = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-9;
        assert!(cg.unknowns.iter().zip(&wanted).all(close));
        // Nothing left to do moves nothing, and divides by no zero.
        let mut done = Conjugate::new(vec![1.0], vec![0.0], &[2.0]);
        done.step(&[0.0]);
        assert_eq!(done.unknowns, [1.0]);
        assert_eq!(done.direction, [0.0]);
    }

    /// Round after round it comes to where no unknown can gain: the residual is none where
    /// an unknown is above its floor, and points below where it stands on it.
    #[test]
    fn rounds_end_where_floors_allow_no_more() {
        let mut random = Random::new(3);
        let matrix = random_matrix(&mut random, 14);
        let right: Vec<f64> = (0..14).map(|_| random.range(-1.0, 1.0)).collect();
        let diagonal: Vec<f64> = (0..14).map(|k| matrix[k][k]).collect();
        let floors: Vec<f64> = (0..14).map(|_| random.range(-0.2, 0.1)).collect();
        let residual = |x: &[f64]| -> Vec<f64> {
            (right.iter().zip(multiply(&matrix, x)))
                .map(|(b, ax)| b - ax)
                .collect()
        };
        let mut x = floors.clone();
        for _ in 0..40 {
            let mut cg = Conjugate::with_floors(x.clone(), residual(&x), &diagonal, floors.clone());
            for _ in 0..3 {
                cg.step(&multiply(&matrix, &cg.direction.clone()));
            }
            cg.end();
            x = cg.unknowns;
        }
        let left = residual(&x);
        let on_floor = (0..14).filter(|&k| x[k] <= floors[k]).count();
        assert!((3..12).contains(&on_floor), "{on_floor}");
        for k in 0..14 {
            if x[k] > floors[k] {
                assert!(left[k].abs() < 1e-9, "{k}: {}", left[k]);
            } else {
                assert!(x[k] == floors[k] && left[k] <= 0.0, "{k}: {}", left[k]);
            }
        }
    }
}
