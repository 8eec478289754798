//! L-BFGS that stays on the device (`shaders/lbfgs.wgsl`).

use bytemuck::{Pod, Zeroable};

use crate::{
    gpu::{Bindings, Buffer, Gpu, GpuError, Kernel, Recorder, groups_for, shaders},
    splats::sh,
};

/// Twin of `struct LbfgsParameters`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct LbfgsParameters {
    /// Unknowns.
    pub length: u32,
    /// Gaussians; there are as many unknowns in a plane.
    pub splats: u32,
    /// Workgroups that leave a partial sum.
    pub blocks: u32,
    /// Added to the matrix's diagonal.
    pub ridge: f32,
    /// What a diagonal entry is of the sum of weights.
    pub diagonal_scale: f32,
}

/// Twin of `MEMORY`: pairs that are remembered. Eight do no better (docs/decisions.md).
const MEMORY: usize = 5;

/// Twin of `RHO`: scalars before those of the pairs, of which each has two.
const SHARED_SCALARS: usize = 6;

/// The loss before the first point is accepted, as the first scalar.
const UNKNOWN: f32 = f32::MAX;

/// What is minimised over, planes `[planes, N]`, and what the caller leaves before
/// [`Lbfgs::step`].
pub struct System {
    /// What is solved for.
    pub unknowns: Buffer<f32>,
    /// The loss's gradient.
    pub gradient: Buffer<f32>,
    /// The adjoint of the weights themselves, of which the planes of the constant
    /// harmonic count.
    pub diagonal: Buffer<f32>,
    /// The least that each unknown may be; [`UNBOUNDED`] where nothing bounds it.
    pub floors: Buffer<f32>,
    /// The losses whose sum is minimised.
    pub losses: Buffer<f32>,
}

/// The floor of an unknown that has none.
pub const UNBOUNDED: f32 = f32::MIN;

/// An entry point and what it works on.
struct Bound(Kernel, Bindings);

/// What is done with one pair.
struct OfPair {
    keep: Bound,
    curvature: [Bound; 2],
    spread: [Bound; 2],
    along_displacement: Bound,
    alpha: Bound,
    add_change: Bound,
    along_change: Bound,
    beta: Bound,
    add_displacement: Bound,
}

/// The kernels tied to one system.
pub struct Lbfgs {
    scalars: Buffer<f32>,
    ridge: Bound,
    judge: Bound,
    begin: Bound,
    precondition: Bound,
    step: Bound,
    pairs: Vec<OfPair>,
    newest: usize,
    blocks: u32,
}

impl Lbfgs {
    /// Compiles the kernels for `system` of `splats` Gaussians.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(gpu: &Gpu, system: &System, splats: usize, ridge: f32) -> Result<Self, GpuError> {
        let length = system.unknowns.len();
        // The adjoint multiplies by the constant harmonic once, the matrix by all harmonics
        // twice, and the squares of those sum to as many of its own square (Unsöld 1927).
        let harmonics = length / (2 * splats).max(1);
        let blocks = groups_for(length);
        let parameters = Buffer::uniform(
            gpu,
            "lbfgs parameters",
            &LbfgsParameters {
                length: length as u32,
                splats: splats as u32,
                blocks,
                ridge,
                diagonal_scale: (sh::C0 * harmonics as f64) as f32,
            },
        )?;
        let zeros = |label| Buffer::<f32>::zeros(gpu, label, length);
        let [accepted_unknowns, accepted_gradient] = [zeros("accepted")?, zeros("accepted")?];
        let (preconditioner, direction) = (zeros("preconditioner")?, zeros("direction")?);
        let block_sums = Buffer::<f32>::zeros(gpu, "lbfgs sums", blocks as usize)?;
        let scalars = Buffer::<f32>::zeros(gpu, "scalars", SHARED_SCALARS + 2 * MEMORY)?;
        let kernel = |name| Kernel::new(gpu, name, shaders::LBFGS);
        let bind = |kernel: &Kernel, used: &[(u32, &wgpu::Buffer)]| {
            Bound(kernel.clone(), kernel.bind_at(gpu, used))
        };
        let (parameters, unknowns) = ((0, parameters.raw()), (2, system.unknowns.raw()));
        let (gradient, floors) = ((3, system.gradient.raw()), (5, system.floors.raw()));
        let inverse = (9, preconditioner.raw());
        let sums = (13, block_sums.raw());
        let (of_direction, of_scalars) = ((10, direction.raw()), (14, scalars.raw()));

        let [keep, dot, add] = ["lbfgs_pair", "lbfgs_dot", "lbfgs_add"].map(kernel);
        let [curvature, spread, scale] =
            ["lbfgs_curvature", "lbfgs_spread", "lbfgs_scale"].map(kernel);
        let [alpha, beta] = ["lbfgs_alpha", "lbfgs_beta"].map(kernel);
        let pairs = (0..MEMORY)
            .map(|index| {
                let displacement = zeros("displacement")?;
                let change = zeros("change")?;
                let index = Buffer::uniform(gpu, "pair", &(index as u32))?;
                let index = (1, index.raw());
                let product = |left: &Buffer<f32>, right: &Buffer<f32>| {
                    bind(
                        &dot,
                        &[parameters, sums, (15, left.raw()), (16, right.raw())],
                    )
                };
                let sum = |kernel: &Kernel| bind(kernel, &[parameters, index, sums, of_scalars]);
                let add = |left: &Buffer<f32>| {
                    bind(
                        &add,
                        &[parameters, of_direction, of_scalars, (15, left.raw())],
                    )
                };
                Ok(OfPair {
                    keep: bind(
                        &keep,
                        &[
                            parameters,
                            unknowns,
                            gradient,
                            (7, accepted_unknowns.raw()),
                            (8, accepted_gradient.raw()),
                            (11, displacement.raw()),
                            (12, change.raw()),
                            of_scalars,
                        ],
                    ),
                    curvature: [
                        product(&displacement, &change),
                        bind(&curvature, &[parameters, sums, of_scalars]),
                    ],
                    spread: [
                        bind(&spread, &[parameters, inverse, (12, change.raw()), sums]),
                        sum(&scale),
                    ],
                    along_displacement: product(&displacement, &direction),
                    alpha: sum(&alpha),
                    add_change: add(&change),
                    along_change: product(&change, &direction),
                    beta: sum(&beta),
                    add_displacement: add(&displacement),
                })
            })
            .collect::<Result<_, GpuError>>()?;
        let lbfgs = Self {
            ridge: bind(
                &kernel("lbfgs_ridge"),
                &[parameters, unknowns, gradient, sums],
            ),
            judge: bind(
                &kernel("lbfgs_judge"),
                &[parameters, (6, system.losses.raw()), sums, of_scalars],
            ),
            begin: bind(
                &kernel("lbfgs_begin"),
                &[
                    parameters,
                    unknowns,
                    gradient,
                    (4, system.diagonal.raw()),
                    floors,
                    inverse,
                    of_direction,
                    of_scalars,
                ],
            ),
            precondition: bind(
                &kernel("lbfgs_precondition"),
                &[parameters, inverse, of_direction, of_scalars],
            ),
            step: bind(
                &kernel("lbfgs_step"),
                &[parameters, unknowns, floors, inverse, of_direction],
            ),
            pairs,
            newest: 0,
            blocks,
            scalars,
        };
        lbfgs.restart(gpu);
        Ok(lbfgs)
    }

    /// Forgets everything, because what is minimised is another function from now on.
    pub fn restart(&self, gpu: &Gpu) {
        self.scalars.write_at(gpu, 0, &[UNKNOWN]);
    }

    /// Records a step from where loss and gradient are ready.
    pub fn step(&mut self, recorder: &mut Recorder) {
        self.newest = (self.newest + 1) % MEMORY;
        self.judge(recorder);
        let newest = &self.pairs[self.newest];
        self.all(recorder, &self.begin);
        for [terms, sum] in [&newest.curvature, &newest.spread] {
            self.all(recorder, terms);
            self.one(recorder, sum);
        }
        let from_newest = || (0..MEMORY).map(|age| (self.newest + MEMORY - age) % MEMORY);
        for pair in from_newest().map(|k| &self.pairs[k]) {
            self.all(recorder, &pair.along_displacement);
            self.one(recorder, &pair.alpha);
            self.all(recorder, &pair.add_change);
        }
        self.all(recorder, &self.precondition);
        for pair in from_newest().rev().map(|k| &self.pairs[k]) {
            self.all(recorder, &pair.along_change);
            self.one(recorder, &pair.beta);
            self.all(recorder, &pair.add_displacement);
        }
        self.all(recorder, &self.step);
    }

    /// Records the end, where the loss is ready: a last step that raised it is undone.
    pub fn end(&mut self, recorder: &mut Recorder) {
        self.newest = (self.newest + 1) % MEMORY;
        self.judge(recorder);
    }

    /// Records whether the present point is accepted, and the return from it if it is not.
    fn judge(&self, recorder: &mut Recorder) {
        self.all(recorder, &self.ridge);
        self.one(recorder, &self.judge);
        self.all(recorder, &self.pairs[self.newest].keep);
    }

    /// A thread for each unknown.
    fn all(&self, recorder: &mut Recorder, bound: &Bound) {
        recorder.dispatch(&bound.0, &bound.1, self.blocks);
    }

    /// A single workgroup.
    fn one(&self, recorder: &mut Recorder, bound: &Bound) {
        recorder.dispatch(&bound.0, &bound.1, 1);
    }
}
