//! `lbfgs_*`: steps on quadratics small enough to be solved by elimination, loss and gradient
//! made on the host between the kernels.

use std::sync::Arc;

use crate::{
    chroma::{Lbfgs, LbfgsKernels, LbfgsState, REST, System, UNBOUNDED, diagonal_scale},
    compare::{narrow, widen},
    doctor::measured::{Allowance, Row, Sample},
    gpu::{Buffer, Gpu, GpuError, Recorder},
    oracle::{
        constants::SH_C0,
        lbfgs::{self as oracle, Matrix, multiply, solve},
        random::{Random, round},
    },
    raster::Raster,
};

/// A system as the solver meets it.
struct Problem {
    splats: usize,
    /// AᵀWA, without the ridge; of a long system nothing but the diagonal.
    matrix: Product,
    /// Sums of weights, `[2, N]`.
    weights: Vec<f64>,
    gradient: Vec<f64>,
    start: Vec<f64>,
    floors: Vec<f64>,
    ridge: f64,
    /// Steps after which the unknowns are anchored.
    anchored: Option<usize>,
    /// Steps after which the last is judged by its loss alone, before others follow.
    judged: Option<usize>,
    /// The loss at the start.
    offset: f64,
}

enum Product {
    Full(Matrix),
    Diagonal(Vec<f64>),
}

impl Product {
    fn with(&self, vector: &[f64]) -> Vec<f64> {
        match self {
            Self::Full(matrix) => multiply(matrix, vector),
            Self::Diagonal(diagonal) => diagonal.iter().zip(vector).map(|(d, v)| d * v).collect(),
        }
    }
}

/// Gaussians that show in no pixel.
const UNSEEN: [usize; 2] = [3, 7];

impl Problem {
    /// Blend weights of `splats` Gaussians in `pixels` pixels, `planes` harmonics of two
    /// channels, pixels weighed by about `scale`.
    fn random(seed: u64, [splats, pixels, harmonics]: [usize; 3], scale: f64) -> Self {
        let mut random = Random::new(seed);
        let length = 2 * harmonics * splats;
        let mut matrix = vec![vec![0.0; length]; length];
        let mut weights = vec![0.0; 2 * splats];
        for _ in 0..pixels {
            // Few Gaussians show in a pixel; their weights sum to at most one.
            let mut left = 1.0;
            let shows: Vec<f64> = (0..splats)
                .map(|i| {
                    if UNSEEN.contains(&i) || random.range(0.0, 1.0) < 0.7 {
                        return 0.0;
                    }
                    let share = left * random.range(0.1, 0.8);
                    left -= share;
                    share
                })
                .collect();
            for channel in 0..2 {
                let weight = scale * random.range(0.2, 2.0);
                let mut row = vec![0.0; length];
                for (i, show) in shows.iter().enumerate() {
                    weights[channel * splats + i] += SH_C0 * weight * show;
                    for k in 0..harmonics {
                        let basis = if k == 0 {
                            SH_C0
                        } else {
                            random.range(-0.4, 0.4)
                        };
                        row[(2 * k + channel) * splats + i] = basis * show;
                    }
                }
                for (i, a) in row.iter().enumerate().filter(|(_, a)| **a != 0.0) {
                    for (m, b) in matrix[i].iter_mut().zip(&row) {
                        *m += weight * a * b;
                    }
                }
            }
        }
        let wanted: Vec<f64> = (0..length).map(|_| random.range(-200.0, 200.0)).collect();
        // What no pixel shows has no gradient either.
        let gradient = multiply(&matrix, &wanted)
            .iter()
            .map(|g| round(-g))
            .collect();
        Self {
            splats,
            // More than the wanted are worth, so that no loss is negative.
            offset: round(scale * 4e4 * pixels as f64),
            weights: weights.into_iter().map(round).collect(),
            gradient,
            start: (0..length).map(|_| random.range(-20.0, 20.0)).collect(),
            floors: vec![f64::from(UNBOUNDED); length],
            ridge: round(0.02 * scale * SH_C0 * SH_C0),
            anchored: None,
            judged: None,
            matrix: Product::Full(matrix),
        }
    }

    /// More blocks than a workgroup has threads, the last cut short; Gaussians that
    /// nothing ties together.
    fn long(splats: usize) -> Self {
        let mut random = Random::new(5);
        let mut draw =
            |low, high| -> Vec<f64> { (0..2 * splats).map(|_| random.range(low, high)).collect() };
        let weights = draw(0.5, 2.0);
        let shares = draw(0.25, 1.0);
        Self {
            splats,
            offset: 1e8,
            matrix: Product::Diagonal(
                (weights.iter().zip(&shares))
                    .map(|(w, s)| w * s * SH_C0)
                    .collect(),
            ),
            gradient: draw(-10.0, 10.0),
            start: draw(-20.0, 20.0),
            floors: vec![f64::from(UNBOUNDED); 2 * splats],
            ridge: round(1e-3),
            anchored: None,
            judged: None,
            weights,
        }
    }

    /// The same with floors, of which every third unknown stands on its own, every third a
    /// little above.
    fn bounded(mut self) -> Self {
        for (k, floor) in self.floors.iter_mut().enumerate() {
            match k % 3 {
                0 => *floor = self.start[k],
                1 => *floor = round(self.start[k] - 5.0),
                _ => (),
            }
        }
        self
    }

    /// Loss and gradient at `x`, without the ridge.
    fn at(&self, x: &[f64]) -> (f64, Vec<f64>) {
        let off: Vec<f64> = x.iter().zip(&self.start).map(|(x, s)| x - s).collect();
        let product = self.matrix.with(&off);
        let sum = |of: &[f64]| -> f64 { of.iter().zip(&off).map(|(a, b)| a * b).sum() };
        let loss = self.offset + sum(&self.gradient) + 0.5 * sum(&product);
        let gradient = self.gradient.iter().zip(product).map(|(g, p)| g + p);
        (loss, gradient.collect())
    }

    /// The ridge of an unknown.
    fn ridge_of(&self, k: usize) -> f64 {
        let factor = if k < 2 * self.splats { 1.0 } else { REST };
        factor * self.ridge
    }

    /// The oracle after so many steps, told as much more than the loss; how far the last went.
    fn expected(&self, told: &[f64]) -> (Vec<f64>, Option<f64>) {
        let scale = round(diagonal_scale(self.start.len() / (2 * self.splats)));
        let weights: Vec<f64> = (0..self.start.len())
            .map(|k| self.weights[(k / self.splats) % 2 * self.splats + k % self.splats])
            .collect();
        let ridges: Vec<f64> = (0..weights.len()).map(|k| self.ridge_of(k)).collect();
        let diagonal: Vec<f64> = (weights.iter().zip(&ridges))
            .map(|(weight, ridge)| ridge / self.ridge * scale * weight + ridge)
            .collect();
        let mut lbfgs = oracle::Lbfgs::new(self.start.clone(), self.floors.clone(), ridges);
        for (step, more) in told.iter().enumerate() {
            let (loss, gradient) = self.at(&lbfgs.unknowns);
            lbfgs.step(loss + more, &gradient, &diagonal);
            if self.anchored == Some(step + 1) {
                let pulls = weights.iter().map(|weight| ANCHOR * SH_C0 * weight);
                lbfgs.anchor(pulls.collect());
            }
            if self.judged == Some(step + 1) {
                lbfgs.end(self.at(&lbfgs.unknowns).0);
            }
        }
        lbfgs.end(self.at(&lbfgs.unknowns).0);
        let moved = lbfgs.moved(&weights, 2 * self.splats);
        (lbfgs.unknowns, moved.map(|moved| SH_C0 * moved))
    }

    /// The device after so many steps.
    fn on_device(
        &self,
        gpu: &Gpu,
        kernels: &LbfgsKernels,
        told: &[f64],
    ) -> Result<(Vec<f64>, Option<f64>), GpuError> {
        let buffer = |values: &[f64]| Buffer::from_slice(gpu, "planes", &narrow(values));
        let system = System {
            unknowns: buffer(&self.start)?,
            gradient: buffer(&self.gradient)?,
            diagonal: buffer(&self.weights)?,
            floors: buffer(&self.floors)?,
            losses: buffer(&[0.0; LOSSES])?,
        };
        let mut lbfgs = Lbfgs::new(
            gpu,
            kernels,
            &system,
            [self.splats, 2],
            [self.ridge, ANCHOR].map(|prior| prior as f32),
        )?;
        let tell = |loss: f64, more: f64| {
            let mut losses = [(loss / LOSSES as f64) as f32; LOSSES];
            losses[LOSSES - 1] += more as f32;
            system.losses.write(gpu, &losses);
        };
        let evaluate = |more: f64| {
            let (loss, gradient) = self.at(&widen(&system.unknowns.read(gpu)?));
            system.gradient.write(gpu, &narrow(&gradient));
            tell(loss, more);
            Ok::<(), GpuError>(())
        };
        for (step, &more) in told.iter().enumerate() {
            evaluate(more)?;
            let mut recorder = Recorder::new(gpu);
            lbfgs.step(&mut recorder);
            if self.anchored == Some(step + 1) {
                lbfgs.anchor(&mut recorder);
            }
            recorder.submit();
            if self.judged == Some(step + 1) {
                // The gradient is that of the point before.
                tell(self.at(&widen(&system.unknowns.read(gpu)?)).0, 0.0);
                let mut recorder = Recorder::new(gpu);
                lbfgs.end(gpu, &mut recorder);
                recorder.submit();
            }
        }
        evaluate(0.0)?;
        let mut recorder = Recorder::new(gpu);
        lbfgs.end(gpu, &mut recorder);
        recorder.submit();
        let moved = LbfgsState::of(&lbfgs.state_later(gpu).wait(gpu)?).moved;
        Ok((widen(&system.unknowns.read(gpu)?), moved))
    }
}

/// Weight of the anchors relative to the pictures.
const ANCHOR: f64 = 0.25;

/// Losses that sum to the whole: more than a workgroup has threads.
const LOSSES: usize = 300;

/// Scales of the weights: a pixel of a large photo, one, and beyond anything.
const SCALES: [f64; 4] = [1e-9, 1e-6, 1.0, 1e6];

/// Shapes: Gaussians, pixels, harmonics.
const SHAPES: [[usize; 3]; 3] = [[1, 4, 1], [20, 60, 1], [9, 90, 4]];

fn problems() -> Vec<Problem> {
    let of_scale = |&scale: &f64| SHAPES.map(|shape| Problem::random(7, shape, scale));
    SCALES.iter().flat_map(of_scale).collect()
}

/// Steps to the solution.
pub(super) fn end_rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let (gpu, allowed) = (&raster.gpu, Allowance::of(&raster.gpu));
    let kernels = LbfgsKernels::new(gpu);
    let solved = (problems().iter())
        .map(|problem| {
            let length = problem.start.len();
            let Product::Full(matrix) = &problem.matrix else {
                unreachable!("long systems are left out")
            };
            let mut matrix = matrix.clone();
            // b = Ax - gradient at the start.
            let right: Vec<f64> = (problem.matrix.with(&problem.start).iter())
                .zip(&problem.gradient)
                .map(|(ax, g)| ax - g)
                .collect();
            (0..length).for_each(|k| matrix[k][k] += problem.ridge_of(k));
            let to_the_end = vec![0.0; steps_to_the_end(length)];
            let unknowns = problem.on_device(gpu, &kernels, &to_the_end)?.0;
            Ok(Sample::new(unknowns, solve(matrix, &right)))
        })
        .collect::<Result<Vec<_>, GpuError>>()?;
    Ok(vec![row(&allowed, "unknowns in the end", 6e-7, &solved)])
}

/// Unknowns in units of the colors. Where steps go along pairs, what no pixel shows stays where
/// it is by terms that cancel.
fn row(allowed: &Allowance, what: &'static str, worst: f64, samples: &[Sample]) -> Row {
    allowed.values("lbfgs", what, [worst, 100.0], samples)
}

/// Problems on the device and by the oracle: the unknowns after as many steps as are told of, and
/// how far the last went.
fn after(
    gpu: &Gpu,
    kernels: &LbfgsKernels,
    problems: &[Problem],
    told: &[f64],
) -> Result<(Vec<Sample>, Vec<Sample>), GpuError> {
    let sampled = problems.iter().map(|problem| {
        let told: Vec<f64> = told.iter().map(|more| more * problem.offset).collect();
        let (actual, expected) = (
            problem.on_device(gpu, kernels, &told)?,
            problem.expected(&told),
        );
        // Undone is told as less than nothing.
        let [far, near] = [actual.1, expected.1].map(|moved| vec![moved.unwrap_or(-1.0)]);
        Ok((Sample::new(actual.0, expected.0), Sample::new(far, near)))
    });
    sampled.collect()
}

/// Problems in which unknowns are free, and one of many.
fn free() -> Vec<Problem> {
    let mut free = problems();
    free.push(Problem::long(40_001));
    free
}

/// Steps that are good.
pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let (gpu, allowed) = (&raster.gpu, Allowance::of(&raster.gpu));
    let kernels = LbfgsKernels::new(gpu);
    let free = free();
    let [one, five] = [1, 5].map(|steps| after(gpu, &kernels, &free, &vec![0.0; steps]));
    let still = (free.into_iter())
        .map(|mut problem| {
            problem.start.fill(0.0);
            problem.gradient.fill(0.0);
            let zeros = vec![0.0; problem.start.len()];
            Ok(Sample::new(
                problem.on_device(gpu, &kernels, &[0.0; 2])?.0,
                zeros,
            ))
        })
        .collect::<Result<Vec<_>, GpuError>>()?;
    Ok(vec![
        row(&allowed, "unknowns after 1 step", 7e-8, &one?.0),
        row(&allowed, "unknowns after 5 steps", 1.85e-5, &five?.0),
        Row::exact("lbfgs", "nothing to do", &still),
    ])
}

/// Steps that are bounded or pulled.
pub(super) fn held_rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let (gpu, allowed) = (&raster.gpu, Allowance::of(&raster.gpu));
    let kernels = LbfgsKernels::new(gpu);
    let bounded: Vec<Problem> = problems().into_iter().map(Problem::bounded).collect();
    let above_floors = after(gpu, &kernels, &bounded, &[0.0; 5])?.0;
    let mut anchored = problems();
    anchored
        .iter_mut()
        .for_each(|problem| problem.anchored = Some(3));
    let drawn_to_anchors = after(gpu, &kernels, &anchored, &[0.0; 6])?.0;
    Ok(vec![
        row(&allowed, "unknowns with floors", 4.38e-5, &above_floors),
        row(
            &allowed,
            "unknowns with anchors",
            1.21e-5,
            &drawn_to_anchors,
        ),
    ])
}

/// Steps that are judged.
pub(super) fn judged_rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let (gpu, allowed) = (&raster.gpu, Allowance::of(&raster.gpu));
    let kernels = LbfgsKernels::new(gpu);
    let free = free();
    // The second is told to have done some harm: a parabola says how much shorter. Then the
    // third and its shorter step are told to have done much.
    let (shortened, mut moved) = after(gpu, &kernels, &free, &[0.0, 0.02, 0.0])?;
    let (undone, far) = after(gpu, &kernels, &free, &[0.0, 0.0, 0.0, 9.0, 9.0, 0.0])?;
    moved.extend(far);
    let mut judged = problems();
    judged
        .iter_mut()
        .for_each(|problem| problem.judged = Some(3));
    let (after_judged, far) = after(gpu, &kernels, &judged, &[0.0; 6])?;
    moved.extend(far);
    let row = |what, worst, samples: &[Sample]| row(&allowed, what, worst, samples);
    Ok(vec![
        row("unknowns after a step judged alone", 2.4e-6, &after_judged),
        row("unknowns after a shorter step", 1.39e-5, &shortened),
        row("unknowns after two steps undone", 1.01e-6, &undone),
        row("how far the last step went", 1.97e-6, &moved),
    ])
}

/// Steps after which so many unknowns move no more: conjugate gradients need one for each, in
/// exact arithmetic.
fn steps_to_the_end(unknowns: usize) -> usize {
    20 + 2 * unknowns
}
