//! `conjugate_*`: steps on systems small enough to be solved by elimination, the product
//! with the matrix made on the host between the kernels.

use std::sync::Arc;

use crate::{
    chroma::{Conjugate, System, UNBOUNDED},
    compare::widen,
    doctor::measured::{Allowance, Row, Sample},
    gpu::{Buffer, Gpu, GpuError, Recorder},
    oracle::{
        conjugate::{self as oracle, Matrix, multiply, solve},
        constants::SH_C0,
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
            weights: weights.into_iter().map(round).collect(),
            gradient,
            start: (0..length).map(|_| random.range(-20.0, 20.0)).collect(),
            floors: vec![f64::from(UNBOUNDED); length],
            ridge: round(0.02 * scale * SH_C0 * SH_C0),
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
            matrix: Product::Diagonal(
                (weights.iter().zip(&shares))
                    .map(|(w, s)| w * s * SH_C0)
                    .collect(),
            ),
            gradient: draw(-10.0, 10.0),
            start: draw(-20.0, 20.0),
            floors: vec![f64::from(UNBOUNDED); 2 * splats],
            ridge: round(1e-3),
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

    fn with_ridge(&self, vector: &[f64]) -> Vec<f64> {
        let product = self.matrix.with(vector);
        product
            .iter()
            .zip(vector)
            .map(|(p, v)| p + self.ridge * v)
            .collect()
    }

    /// The oracle after a round of so many steps.
    fn expected(&self, steps: usize) -> Vec<f64> {
        let residual = (self.gradient.iter().zip(&self.start))
            .map(|(g, x)| -g - self.ridge * x)
            .collect();
        let diagonal: Vec<f64> = (0..self.start.len())
            .map(|k| {
                let of_channel = (k / self.splats) % 2 * self.splats + k % self.splats;
                round(SH_C0) * self.weights[of_channel] + self.ridge
            })
            .collect();
        let (start, floors) = (self.start.clone(), self.floors.clone());
        let mut cg = oracle::Conjugate::with_floors(start, residual, &diagonal, floors);
        for _ in 0..steps {
            cg.step(&self.with_ridge(&cg.direction.clone()));
        }
        cg.end();
        cg.unknowns
    }

    /// The device after a round of so many steps, and its residual.
    fn on_device(&self, gpu: &Gpu, steps: usize) -> Result<[Vec<f64>; 2], GpuError> {
        let buffer = |values: &[f64]| {
            let values: Vec<f32> = values.iter().map(|&v| v as f32).collect();
            Buffer::from_slice(gpu, "planes", &values)
        };
        let zeros = || Buffer::<f32>::zeros(gpu, "planes", self.start.len());
        let system = System {
            unknowns: buffer(&self.start)?,
            residual: buffer(&self.gradient)?,
            direction: zeros()?,
            product: zeros()?,
            diagonal: buffer(&self.weights)?,
            floors: buffer(&self.floors)?,
        };
        let conjugate = Conjugate::new(gpu, &system, self.splats, self.ridge as f32)?;
        let mut recorder = Recorder::new(gpu);
        conjugate.begin(&mut recorder);
        recorder.submit();
        for _ in 0..steps {
            let direction = widen(&system.direction.read(gpu)?);
            let product: Vec<f32> = (self.matrix.with(&direction).iter())
                .map(|&v| v as f32)
                .collect();
            system.product.write(gpu, &product);
            let mut recorder = Recorder::new(gpu);
            conjugate.step(&mut recorder);
            recorder.submit();
        }
        let mut recorder = Recorder::new(gpu);
        conjugate.end(&mut recorder);
        recorder.submit();
        let read = |buffer: &Buffer<f32>| Ok(widen(&buffer.read(gpu)?));
        Ok([read(&system.unknowns)?, read(&system.residual)?])
    }
}

/// Scales of the weights: a pixel of a large photo, one, and beyond anything.
const SCALES: [f64; 4] = [1e-9, 1e-6, 1.0, 1e6];

/// Shapes: Gaussians, pixels, harmonics.
const SHAPES: [[usize; 3]; 3] = [[1, 4, 1], [20, 60, 1], [9, 90, 4]];

fn problems() -> Vec<Problem> {
    let of_scale = |&scale: &f64| SHAPES.map(|shape| Problem::random(7, shape, scale));
    SCALES.iter().flat_map(of_scale).collect()
}

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let (gpu, allowed) = (&raster.gpu, Allowance::of(&raster.gpu));
    let mut free = problems();
    let solved = (free.iter())
        .map(|problem| {
            let length = problem.start.len();
            let Product::Full(matrix) = &problem.matrix else {
                unreachable!("long systems come later")
            };
            let mut matrix = matrix.clone();
            // b = Ax - gradient at the start.
            let right: Vec<f64> = (problem.matrix.with(&problem.start).iter())
                .zip(&problem.gradient)
                .map(|(ax, g)| ax - g)
                .collect();
            (0..length).for_each(|k| matrix[k][k] += problem.ridge);
            let [unknowns, _] = problem.on_device(gpu, 2 * length)?;
            Ok(Sample::new(unknowns, solve(matrix, &right)))
        })
        .collect::<Result<Vec<_>, GpuError>>()?;
    free.push(Problem::long(40_001));
    let after = |problems: &[Problem], steps: usize| {
        (problems.iter())
            .map(|problem| {
                let [unknowns, _] = problem.on_device(gpu, steps)?;
                Ok(Sample::new(unknowns, problem.expected(steps)))
            })
            .collect::<Result<Vec<_>, GpuError>>()
    };
    let rows_after = [after(&free, 1)?, after(&free, 3)?];
    let bounded: Vec<Problem> = problems().into_iter().map(Problem::bounded).collect();
    let above_floors = after(&bounded, 3)?;
    let still = (free.into_iter())
        .map(|mut problem| {
            problem.start.fill(0.0);
            problem.gradient.fill(0.0);
            let zeros = vec![0.0; 2 * problem.start.len()];
            Ok(Sample::new(problem.on_device(gpu, 2)?.concat(), zeros))
        })
        .collect::<Result<Vec<_>, GpuError>>()?;
    // In units of the colours.
    let row = |what, worst, samples: &[Sample]| {
        Row::elementwise("conjugate", what, allowed.relative(worst, 100.0), samples)
    };
    Ok(vec![
        row("unknowns after 1 step", 1.38e-7, &rows_after[0]),
        row("unknowns after 3 steps", 2.81e-7, &rows_after[1]),
        row("unknowns in the end", 5.99e-7, &solved),
        row("unknowns with floors", 3.57e-7, &above_floors),
        Row::exact("conjugate", "nothing to do", &still),
    ])
}
