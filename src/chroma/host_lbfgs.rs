//! L-BFGS on the host, in f64, for unknowns that wait there: step by step what
//! `shaders/lbfgs.wgsl` does on the device.

use std::collections::VecDeque;

use super::lbfgs::{MEMORY, REST, UNBOUNDED};

/// Twins of constants in `shaders/lbfgs.wgsl`.
const TOLERANCE: f64 = 1e-4;
const LEAST_SCALE: f64 = 1e-3;
const SHORTENED: [f64; 2] = [0.1, 0.5];
const AGE: usize = 2;

/// A displacement, the gradient's change along it, and one over their product; empty in the place
/// of a pair that does not count.
#[derive(Clone, Debug, Default)]
struct Pair {
    displacement: Vec<f64>,
    change: Vec<f64>,
    rho: f64,
}

/// The next step: along a new direction, a shorter one along the last, or the majorizer's.
#[derive(Clone, Copy, Debug, PartialEq)]
enum NextStep {
    Onward,
    Shorter,
    Safe,
}

/// A minimization between two steps.
#[derive(Clone, Debug)]
pub(super) struct HostLbfgs {
    pub unknowns: Vec<f64>,
    displacement: Vec<f64>,
    /// Points that unknowns are drawn to, and the strengths.
    anchors: Vec<f64>,
    pulls: Vec<f64>,
    /// The accepted point and its gradient, priors included.
    accepted: Vec<f64>,
    gradient: Vec<f64>,
    direction: Vec<f64>,
    /// One over the majorizer's diagonal; zero for unknowns held at their floors.
    preconditioner: Vec<f64>,
    /// Newest first.
    pairs: VecDeque<Pair>,
    /// The loss at the accepted point, priors included.
    loss: Option<f64>,
    next: NextStep,
    slope: f64,
    scale: f64,
    /// Points accepted so far.
    age: usize,
    /// True if the loss has changed slightly since the accepted point.
    changed: bool,
    /// Empty where nothing is bounded.
    floors: Vec<f32>,
    ridge: f64,
    constants: usize,
}

impl HostLbfgs {
    /// Begins at `unknowns`, of which the first `constants` have this ridge and the others
    /// [`REST`] times as much.
    pub fn new(unknowns: Vec<f64>, ridge: f64, constants: usize) -> Self {
        let zeros = || vec![0.0; unknowns.len()];
        Self {
            displacement: zeros(),
            anchors: unknowns.clone(),
            pulls: zeros(),
            accepted: unknowns.clone(),
            gradient: zeros(),
            direction: zeros(),
            preconditioner: zeros(),
            pairs: VecDeque::new(),
            loss: None,
            next: NextStep::Onward,
            slope: 0.0,
            scale: 1.0,
            age: 0,
            changed: false,
            floors: Vec::new(),
            ridge,
            constants,
            unknowns,
        }
    }

    /// Twin of `penalty_factor`: the ridge of unknown `k` in units of a constant harmonic's.
    pub fn factor(&self, k: usize) -> f64 {
        if k < self.constants { 1.0 } else { REST }
    }

    /// No unknown falls below these from now on.
    pub fn set_floors(&mut self, floors: &[f32]) {
        self.floors = floors.to_vec();
    }

    /// See [`Lbfgs::restart`](super::Lbfgs::restart).
    pub fn restart(&mut self) {
        self.loss = None;
    }

    /// See [`Lbfgs::changed`](super::Lbfgs::changed).
    pub fn changed(&mut self) {
        self.changed = true;
    }

    /// The loss at the accepted point, priors included.
    pub fn loss(&self) -> Option<f64> {
        self.loss
    }

    /// Draws each unknown to its accepted value, by `pulls / 2` times the squared distance.
    pub fn anchor(&mut self, pulls: Vec<f64>) {
        self.anchors.clone_from(&self.accepted);
        self.pulls = pulls;
    }

    /// A step from loss and gradient without priors. `diagonal` is the majorizer's, the ridge
    /// included.
    pub fn step(&mut self, loss: f64, mut gradient: Vec<f64>, diagonal: &[f64]) {
        for (k, g) in gradient.iter_mut().enumerate() {
            let (ridge, off) = self.priors(k);
            *g = *g + ridge * self.unknowns[k] + self.pulls[k] * off;
        }
        let changed = std::mem::take(&mut self.changed);
        let paired = self.loss.is_some() && self.age >= AGE && !changed;
        let length = self.judge(loss);
        let accepted = self.next == NextStep::Onward;
        let pair = accepted.then(|| self.accept(gradient, diagonal, paired));
        self.remember(pair.unwrap_or_default());
        if self.next != NextStep::Shorter {
            self.direction = self.descent();
        }
        self.slope = -dot(&self.gradient, &self.direction);
        for k in 0..self.unknowns.len() {
            if self.preconditioner[k] > 0.0 {
                let to = self.unknowns[k] - length * self.direction[k];
                self.unknowns[k] = to.max(self.floor(k));
            }
        }
    }

    /// The end, at this loss: a last step that raised it is undone.
    pub fn end(&mut self, loss: f64) {
        self.judge(loss);
        if self.next == NextStep::Onward {
            self.displacement = difference(&self.unknowns, &self.accepted);
            self.accepted.clone_from(&self.unknowns);
        }
        self.remember(Pair::default());
    }

    /// The last step's mean length, weighed; the weights of the constant harmonics sum to the
    /// whole. `None` where it was undone.
    pub fn moved(&self, weights: &[f64]) -> Option<f64> {
        let moved = weights.iter().zip(&self.displacement);
        let moved: f64 = moved.map(|(w, s)| w * s.abs()).sum();
        let whole: f64 = weights[..self.constants].iter().sum();
        // Nothing is drawn.
        let mean = if whole > 0.0 { moved / whole } else { 0.0 };
        (self.next == NextStep::Onward).then_some(mean)
    }

    /// Accepts the present point or goes back; gives the length of the next step.
    fn judge(&mut self, loss: f64) -> f64 {
        let loss = self.with_priors(loss);
        let Some(before) = self.loss.filter(|&before| rises(before, loss)) else {
            self.loss = Some(loss);
            self.next = NextStep::Onward;
            self.age += 1;
            return 1.0;
        };
        self.unknowns.clone_from(&self.accepted);
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
        1.0
    }

    /// Takes the present point, and gives the pair that leads there.
    fn accept(&mut self, gradient: Vec<f64>, diagonal: &[f64], paired: bool) -> Pair {
        let displacement = difference(&self.unknowns, &self.accepted);
        let change = difference(&gradient, &self.gradient);
        self.accepted.clone_from(&self.unknowns);
        self.gradient = gradient;
        for (k, &diagonal) in diagonal.iter().enumerate() {
            let held = self.unknowns[k] <= self.floor(k) && self.gradient[k] >= 0.0;
            let free = 1.0 / (diagonal + self.pulls[k]);
            self.preconditioner[k] = if held { 0.0 } else { free };
        }
        self.displacement.clone_from(&displacement);
        let spread: f64 = (change.iter().zip(&self.preconditioner))
            .map(|(y, m)| y * m * y)
            .sum();
        let curvature = dot(&displacement, &change);
        let counts = paired && spread > 0.0 && curvature > LEAST_SCALE * spread;
        if !counts {
            return Pair::default();
        }
        self.scale = curvature / spread;
        Pair {
            displacement,
            change,
            rho: 1.0 / curvature,
        }
    }

    fn remember(&mut self, pair: Pair) {
        self.pairs.push_front(pair);
        self.pairs.truncate(MEMORY);
    }

    /// The direction from the accepted point, turned around: two passes over the pairs.
    fn descent(&self) -> Vec<f64> {
        let of_free = |(&g, &m): (&f64, &f64)| if m > 0.0 { g } else { 0.0 };
        let mut direction: Vec<f64> = (self.gradient.iter().zip(&self.preconditioner))
            .map(of_free)
            .collect();
        let mut alphas = Vec::new();
        for pair in &self.pairs {
            let alpha = pair.rho * dot(&pair.displacement, &direction);
            add(&mut direction, -alpha, &pair.change);
            alphas.push(alpha);
        }
        for (d, m) in direction.iter_mut().zip(&self.preconditioner) {
            *d *= self.scale * m;
        }
        for (pair, alpha) in self.pairs.iter().zip(&alphas).rev() {
            let beta = pair.rho * dot(&pair.change, &direction);
            add(&mut direction, alpha - beta, &pair.displacement);
        }
        direction
    }

    /// The ridge of an unknown, and its distance from its anchor.
    fn priors(&self, k: usize) -> (f64, f64) {
        let off = self.unknowns[k] - self.anchors[k];
        (self.factor(k) * self.ridge, off)
    }

    fn with_priors(&self, loss: f64) -> f64 {
        let (mut anchored, mut ridged) = (0.0, 0.0);
        for (k, x) in self.unknowns.iter().enumerate() {
            let (ridge, off) = self.priors(k);
            anchored += self.pulls[k] * off * off;
            ridged += ridge * x * x;
        }
        loss + 0.5 * (ridged + anchored)
    }

    fn floor(&self, k: usize) -> f64 {
        self.floors.get(k).copied().unwrap_or(UNBOUNDED).into()
    }

    /// All that the next step goes by: scalars, the reciprocals of the pairs' products, vectors.
    pub fn kept(&self) -> Vec<f64> {
        let [next, age] = [self.next as usize, self.age].map(|n| n as f64);
        let [changed, pairs] = [usize::from(self.changed), self.pairs.len()].map(|n| n as f64);
        let loss = self.loss.unwrap_or(f64::INFINITY);
        let mut kept = vec![loss, next, self.slope, self.scale, age, changed, pairs];
        kept.extend(self.pairs.iter().map(|pair| pair.rho));
        for vector in self.clone().vectors() {
            kept.extend_from_slice(vector);
        }
        kept
    }

    /// One that goes on from what another of the same problem kept; `None` of another.
    pub fn restored(&self, kept: &[f64]) -> Option<Self> {
        let (&[loss, next, slope, scale, age, changed, pairs], rest) = kept.split_first_chunk()?;
        let (rhos, mut rest) = rest.split_at_checked(pairs as usize)?;
        let pair = |&rho: &f64| {
            let length = if rho == 0.0 { 0 } else { self.unknowns.len() };
            Pair {
                displacement: vec![0.0; length],
                change: vec![0.0; length],
                rho,
            }
        };
        let mut found = Self {
            pairs: rhos.iter().map(pair).collect(),
            loss: loss.is_finite().then_some(loss),
            next: [NextStep::Onward, NextStep::Shorter, NextStep::Safe][(next as usize).min(2)],
            slope,
            scale,
            age: age as usize,
            changed: changed > 0.0,
            ..self.clone()
        };
        for vector in found.vectors() {
            let (values, more) = rest.split_at_checked(vector.len())?;
            vector.copy_from_slice(values);
            rest = more;
        }
        rest.is_empty().then_some(found)
    }

    fn vectors(&mut self) -> impl Iterator<Item = &mut Vec<f64>> {
        let of_pairs =
            (self.pairs.iter_mut()).flat_map(|pair| [&mut pair.displacement, &mut pair.change]);
        let others = [
            &mut self.unknowns,
            &mut self.displacement,
            &mut self.anchors,
            &mut self.pulls,
            &mut self.accepted,
            &mut self.gradient,
            &mut self.direction,
            &mut self.preconditioner,
        ];
        others.into_iter().chain(of_pairs)
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn difference(to: &[f64], from: &[f64]) -> Vec<f64> {
    to.iter().zip(from).map(|(to, from)| to - from).collect()
}

fn add(to: &mut [f64], factor: f64, of: &[f64]) {
    for (to, of) in to.iter_mut().zip(of) {
        *to += factor * of;
    }
}

fn rises(before: f64, loss: f64) -> bool {
    loss.is_nan() || loss > before * (1.0 + TOLERANCE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oracle::{lbfgs::Lbfgs, random::Random};

    const CONSTANTS: usize = 4;

    /// A quadratic, and the steps of both; what is told of some is wrong, so that they are undone.
    struct Problem {
        matrix: Vec<Vec<f64>>,
        least: Vec<f64>,
    }

    impl Problem {
        fn random(seed: u64, size: usize) -> Self {
            let mut random = Random::new(seed);
            let mut row = |_| (0..size).map(|_| random.range(-1.0, 1.0)).collect();
            let b: Vec<Vec<f64>> = (0..size).map(&mut row).collect();
            let of = |i: usize, j: usize| {
                let sum: f64 = b.iter().map(|row| row[i] * row[j]).sum();
                sum + f64::from(u8::from(i == j))
            };
            Self {
                least: row(0),
                matrix: (0..size)
                    .map(|i| (0..size).map(|j| of(i, j)).collect())
                    .collect(),
            }
        }

        fn at(&self, x: &[f64], k: usize) -> (f64, Vec<f64>) {
            let off = difference(x, &self.least);
            let gradient: Vec<f64> = self.matrix.iter().map(|row| dot(row, &off)).collect();
            let wrong = if [4, 5, 8].contains(&k) { 50.0 } else { 0.0 };
            (10.0 + 0.5 * dot(&off, &gradient) + wrong, gradient)
        }

        fn diagonal(&self) -> Vec<f64> {
            let sum = |row: &Vec<f64>| row.iter().map(|v| v.abs()).sum::<f64>() + RIDGE * REST;
            self.matrix.iter().map(sum).collect()
        }
    }

    const RIDGE: f64 = 0.1;

    fn bits(values: &[f64]) -> Vec<u64> {
        values.iter().map(|value| value.to_bits()).collect()
    }

    fn step(problem: &Problem, lbfgs: &mut HostLbfgs, k: usize) {
        let (loss, gradient) = problem.at(&lbfgs.unknowns, k);
        lbfgs.step(loss, gradient, &problem.diagonal());
        match k {
            2 => lbfgs.changed(),
            6 => lbfgs.anchor(vec![0.2; lbfgs.unknowns.len()]),
            9 => lbfgs.restart(),
            _ => (),
        }
    }

    fn begin(size: usize) -> HostLbfgs {
        let mut lbfgs = HostLbfgs::new(vec![0.0; size], RIDGE, CONSTANTS);
        lbfgs.set_floors(&vec![-0.75; size]);
        lbfgs
    }

    #[test]
    fn its_steps_are_the_oracles() {
        for seed in 0..6 {
            let size = 8 + seed as usize;
            let problem = Problem::random(seed, size);
            let mut ours = begin(size);
            let ridges = (0..size).map(|k| ours.factor(k) * RIDGE).collect();
            let mut oracle = Lbfgs::new(vec![0.0; size], vec![-0.75; size], ridges);
            let weights: Vec<f64> = (1..=size).map(|k| k as f64).collect();
            for k in 0..14 {
                step(&problem, &mut ours, k);
                let (loss, gradient) = problem.at(&oracle.unknowns, k);
                oracle.step(loss, &gradient, &problem.diagonal());
                match k {
                    2 => oracle.changed(),
                    6 => oracle.anchor(vec![0.2; size]),
                    9 => oracle.restart(),
                    _ => (),
                }
                assert_eq!(bits(&ours.unknowns), bits(&oracle.unknowns), "step {k}");
                assert_eq!(ours.loss(), oracle.loss());
                let moved = oracle.moved(&weights, CONSTANTS);
                assert_eq!(ours.moved(&weights), moved);
            }
            assert!(oracle.undone >= 3, "{}", oracle.undone);
            ours.end(1e9);
            oracle.end(1e9);
            assert_eq!(bits(&ours.unknowns), bits(&oracle.unknowns));
        }
    }

    /// A solver that is restored from a kept state goes on from there to the same bits.
    #[test]
    fn goes_on_from_what_is_kept() {
        let problem = Problem::random(5, 10);
        for until in 0..9 {
            let (mut whole, mut other) = (begin(10), begin(10));
            (0..until).for_each(|k| step(&problem, &mut whole, k));
            other = other.restored(&whole.kept()).unwrap();
            for lbfgs in [&mut whole, &mut other] {
                (until..12).for_each(|k| step(&problem, lbfgs, k));
            }
            assert_eq!(
                bits(&whole.unknowns),
                bits(&other.unknowns),
                "after {until}"
            );
        }
        // Of another problem it is nothing.
        assert!(begin(3).restored(&begin(10).kept()).is_none());
    }
}
