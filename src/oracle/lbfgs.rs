//! L-BFGS (Nocedal 1980; Nocedal and Wright 2006, algorithm 7.4): a step that raised the loss
//! is shortened where a parabola says (3.5 there), and if that raises it too, undone for the
//! majorizer's. With anchors, with floors (Bertsekas 1982), and elimination to compare with.

use std::collections::VecDeque;

/// A symmetric matrix, rows.
pub type Matrix = Vec<Vec<f64>>;

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `matrix · vector`.
pub fn multiply(matrix: &Matrix, vector: &[f64]) -> Vec<f64> {
    matrix.iter().map(|row| dot(row, vector)).collect()
}

/// Pairs that are remembered.
pub const MEMORY: usize = 5;
/// A loss may rise by this share.
const TOLERANCE: f64 = 1e-4;
/// The least that the scale of a pair that counts may be.
const LEAST_SCALE: f64 = 1e-3;
/// The least and the most that a shorter step is of the last.
const SHORTENED: [f64; 2] = [0.1, 0.5];
/// Points that are accepted before a pair counts.
const AGE: usize = 2;

/// A displacement, the change of the gradient along it, and one over their product.
type Pair = (Vec<f64>, Vec<f64>, f64);

/// What the next step is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Next {
    Onward,
    Shorter,
    Safe,
}

/// Where the iteration stands.
#[derive(Clone, Debug)]
pub struct Lbfgs {
    /// x.
    pub unknowns: Vec<f64>,
    /// Steps that were undone.
    pub undone: usize,
    /// From the accepted point before to this one.
    displacement: Vec<f64>,
    floors: Vec<f64>,
    /// Of each unknown.
    ridges: Vec<f64>,
    /// Where each unknown is drawn to, and how strongly.
    anchors: (Vec<f64>, Vec<f64>),
    /// The accepted point and its gradient.
    accepted: (Vec<f64>, Vec<f64>),
    /// The loss there, of what is minimized now.
    loss: Option<f64>,
    next: Next,
    direction: Vec<f64>,
    slope: f64,
    /// Points accepted so far.
    age: usize,
    /// One over the majorizer's diagonal there; zero for what is held at its floor.
    preconditioner: Vec<f64>,
    /// Newest first; nothing in the place of a pair that does not count.
    pairs: VecDeque<Option<Pair>>,
    scale: f64,
}

impl Lbfgs {
    /// Begins at `unknowns`, none of which may fall below its floor. Half of each one's ridge times
    /// its square is added to the loss.
    pub fn new(unknowns: Vec<f64>, floors: Vec<f64>, ridges: Vec<f64>) -> Self {
        Self {
            preconditioner: vec![0.0; unknowns.len()],
            direction: vec![0.0; unknowns.len()],
            displacement: vec![0.0; unknowns.len()],
            accepted: (unknowns.clone(), vec![0.0; unknowns.len()]),
            anchors: (unknowns.clone(), vec![0.0; unknowns.len()]),
            unknowns,
            undone: 0,
            floors,
            ridges,
            loss: None,
            next: Next::Onward,
            slope: 0.0,
            age: 0,
            pairs: VecDeque::new(),
            scale: 1.0,
        }
    }

    /// From now on each unknown is drawn to where it is accepted, its `pulls / 2` times the
    /// square of the distance.
    pub fn anchor(&mut self, pulls: Vec<f64>) {
        self.anchors = (self.accepted.0.clone(), pulls);
    }

    /// One step from where loss and gradient are these, the parts of ridge and anchors left out.
    /// `diagonal` is positive and the majorizer's, the ridge included.
    pub fn step(&mut self, loss: f64, gradient: &[f64], diagonal: &[f64]) {
        let of_ridges = self.ridges.iter().zip(&self.unknowns).map(|(r, x)| r * x);
        let gradient: Vec<f64> = (gradient.iter().zip(of_ridges).zip(self.off_anchors()))
            .map(|((g, ridge), (pull, off))| g + ridge + pull * off)
            .collect();
        let paired = self.loss.is_some() && self.age >= AGE;
        let length = self.judge(loss);
        if self.next == Next::Onward {
            let before = std::mem::replace(&mut self.accepted, (self.unknowns.clone(), gradient));
            let difference = |to: &[f64], from: &[f64]| -> Vec<f64> {
                to.iter().zip(from).map(|(to, from)| to - from).collect()
            };
            self.hold(diagonal);
            let s = difference(&self.unknowns, &before.0);
            let y = difference(&self.accepted.1, &before.1);
            self.displacement = s.clone();
            let spread: f64 = (y.iter().zip(&self.preconditioner))
                .map(|(y, m)| y * m * y)
                .sum();
            let curvature = dot(&s, &y);
            let counts = paired && spread > 0.0 && curvature > LEAST_SCALE * spread;
            if counts {
                self.scale = curvature / spread;
            }
            self.remember(counts.then(|| (s, y, 1.0 / curvature)));
        } else {
            self.remember(None);
        }
        if self.next != Next::Shorter {
            self.direction = self.direction();
        }
        self.slope = -dot(&self.accepted.1, &self.direction);
        for (k, d) in self.direction.iter().enumerate() {
            if self.preconditioner[k] > 0.0 {
                self.unknowns[k] = (self.unknowns[k] - length * d).max(self.floors[k]);
            }
        }
    }

    /// What is minimized is another function from now on.
    pub fn restart(&mut self) {
        self.loss = None;
    }

    /// The end, where the loss is this: a last step that raised it is undone.
    pub fn end(&mut self, loss: f64) {
        self.judge(loss);
        if self.next == Next::Onward {
            let from = self.unknowns.iter().zip(&self.accepted.0);
            self.displacement = from.map(|(to, from)| to - from).collect();
            self.accepted.0.clone_from(&self.unknowns);
        }
        self.remember(None);
    }

    /// The mean of what the last step moved, weighed; the weights of the first `constants` sum
    /// to the whole. `None` where it was undone.
    pub fn moved(&self, weights: &[f64], constants: usize) -> Option<f64> {
        let moved = weights.iter().zip(&self.displacement);
        let moved: f64 = moved.map(|(w, s)| w * s.abs()).sum();
        let whole: f64 = weights[..constants].iter().sum();
        // Nothing is drawn.
        let mean = if whole > 0.0 { moved / whole } else { 0.0 };
        (self.next == Next::Onward).then_some(mean)
    }

    /// Accepts the present point or goes back; gives the length of the next step.
    fn judge(&mut self, loss: f64) -> f64 {
        let loss = self.with_priors(loss);
        match self.loss {
            Some(before) if rises(before, loss) => {
                self.unknowns.clone_from(&self.accepted.0);
                self.undone += 1;
                if self.next == Next::Onward {
                    self.next = Next::Shorter;
                    let bend = loss - before - self.slope;
                    let known = self.slope < 0.0 && bend.is_finite();
                    let least = if known { -0.5 * self.slope / bend } else { 0.0 };
                    return least.clamp(SHORTENED[0], SHORTENED[1]);
                }
                self.next = Next::Safe;
                self.pairs.clear();
                self.scale = 1.0;
            }
            _ => {
                self.loss = Some(loss);
                self.next = Next::Onward;
                self.age += 1;
            }
        }
        1.0
    }

    fn remember(&mut self, pair: Option<Pair>) {
        self.pairs.push_front(pair);
        self.pairs.truncate(MEMORY);
    }

    /// From the accepted point, turned around.
    fn direction(&self) -> Vec<f64> {
        let gradient = &self.accepted.1;
        let free = |k: usize| self.preconditioner[k] > 0.0;
        let mut direction: Vec<f64> = (0..gradient.len())
            .map(|k| if free(k) { gradient[k] } else { 0.0 })
            .collect();
        let add = |direction: &mut Vec<f64>, factor: f64, of: &[f64]| {
            for (d, v) in direction.iter_mut().zip(of) {
                *d += factor * v;
            }
        };
        let mut alphas = Vec::new();
        for (s, y, rho) in self.pairs.iter().flatten() {
            let alpha = rho * dot(s, &direction);
            add(&mut direction, -alpha, y);
            alphas.push(alpha);
        }
        for (d, m) in direction.iter_mut().zip(&self.preconditioner) {
            *d *= self.scale * m;
        }
        for (s, y, rho) in self.pairs.iter().rev().flatten() {
            let alpha = alphas.pop().unwrap_or_default();
            let beta = rho * dot(y, &direction);
            add(&mut direction, alpha - beta, s);
        }
        direction
    }

    fn with_priors(&self, loss: f64) -> f64 {
        let anchored: f64 = self.off_anchors().map(|(pull, off)| pull * off * off).sum();
        let ridged: f64 = (self.ridges.iter().zip(&self.unknowns))
            .map(|(ridge, x)| ridge * x * x)
            .sum();
        loss + 0.5 * (ridged + anchored)
    }

    /// Each anchor's pull, and how far off its unknown is.
    fn off_anchors(&self) -> impl Iterator<Item = (f64, f64)> {
        let (anchors, pulls) = &self.anchors;
        let off = self.unknowns.iter().zip(anchors).map(|(x, a)| x - a);
        pulls.iter().copied().zip(off)
    }

    fn hold(&mut self, diagonal: &[f64]) {
        for (k, m) in self.preconditioner.iter_mut().enumerate() {
            let held = self.unknowns[k] <= self.floors[k] && self.accepted.1[k] >= 0.0;
            *m = if held {
                0.0
            } else {
                1.0 / (diagonal[k] + self.anchors.1[k])
            };
        }
    }
}

fn rises(before: f64, loss: f64) -> bool {
    loss.is_nan() || loss > before * (1.0 + TOLERANCE)
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
}
