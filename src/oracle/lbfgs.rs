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

/// Kind of the next step.
#[derive(Clone, Copy, Debug, PartialEq)]
enum NextStep {
    Onward,
    Shorter,
    Safe,
}

/// State of the iteration.
#[derive(Clone, Debug)]
pub struct Lbfgs {
    /// x.
    pub unknowns: Vec<f64>,
    /// Steps that were undone.
    pub undone: usize,
    /// From the accepted point before to this one.
    displacement: Vec<f64>,
    floors: Vec<f64>,
    /// Ridge of each unknown.
    ridges: Vec<f64>,
    /// Anchor of each unknown, and its pull.
    anchors: (Vec<f64>, Vec<f64>),
    /// The accepted point and its gradient.
    accepted: (Vec<f64>, Vec<f64>),
    /// The loss there, of what is minimized now.
    loss: Option<f64>,
    next: NextStep,
    direction: Vec<f64>,
    slope: f64,
    /// Points accepted so far.
    age: usize,
    /// True if the loss has changed slightly since the accepted point.
    changed: bool,
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
            next: NextStep::Onward,
            slope: 0.0,
            age: 0,
            changed: false,
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
        let changed = std::mem::take(&mut self.changed);
        let paired = self.loss.is_some() && self.age >= AGE && !changed;
        let length = self.judge(loss);
        if self.next == NextStep::Onward {
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
        if self.next != NextStep::Shorter {
            self.direction = self.direction();
        }
        self.slope = -dot(&self.accepted.1, &self.direction);
        for (k, d) in self.direction.iter().enumerate() {
            if self.preconditioner[k] > 0.0 {
                self.unknowns[k] = (self.unknowns[k] - length * d).max(self.floors[k]);
            }
        }
    }

    /// Minimizes another loss from now on.
    pub fn restart(&mut self) {
        self.loss = None;
    }

    /// The loss is a slightly different one from now on: the change of the gradient in the next
    /// step tells nothing about the curvature.
    pub fn changed(&mut self) {
        self.changed = true;
    }

    /// The loss at the accepted point, the parts of ridge and anchors included.
    pub fn loss(&self) -> Option<f64> {
        self.loss
    }

    /// The end, where the loss is this: a last step that raised it is undone.
    pub fn end(&mut self, loss: f64) {
        self.judge(loss);
        if self.next == NextStep::Onward {
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
        (self.next == NextStep::Onward).then_some(mean)
    }

    /// Accepts the present point or goes back; gives the length of the next step.
    fn judge(&mut self, loss: f64) -> f64 {
        let loss = self.with_priors(loss);
        match self.loss {
            Some(before) if rises(before, loss) => {
                self.unknowns.clone_from(&self.accepted.0);
                self.undone += 1;
                if self.next == NextStep::Onward {
                    self.next = NextStep::Shorter;
                    let bend = loss - before - self.slope;
                    let known = self.slope < 0.0 && bend.is_finite();
                    let least = if known { -0.5 * self.slope / bend } else { 0.0 };
                    return least.clamp(SHORTENED[0], SHORTENED[1]);
                }
                self.next = NextStep::Safe;
                self.pairs.clear();
                self.scale = 1.0;
            }
            _ => {
                self.loss = Some(loss);
                self.next = NextStep::Onward;
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
#[path = "lbfgs_tests.rs"]
mod tests;
