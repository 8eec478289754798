//! L-BFGS that stays on the device (`shaders/lbfgs.wgsl`).

mod slots;

use bytemuck::{Pod, Zeroable};
use slots::*;

use crate::{
    gpu::{Buffer, Gpu, GpuError, Kernel, Readback, Recorder, groups_for, shaders},
    splats::sh,
};

/// Twin of `struct LbfgsParameters`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct LbfgsParameters {
    /// Number of unknowns.
    pub length: u32,
    /// Gaussians; there are as many unknowns in a plane.
    pub splats: u32,
    /// Planes of the diagonal.
    pub diagonals: u32,
    /// Workgroups that leave a partial sum.
    pub blocks: u32,
    /// Added to the matrix's diagonal.
    pub ridge: f32,
    /// Ratio of a diagonal entry to the sum of weights.
    pub diagonal_scale: f32,
    /// Number of constant harmonics, the first of the unknowns.
    pub constants: u32,
    /// Color of a constant harmonic of one.
    pub color: f32,
    /// Pull of an anchor, as a share of the pictures'.
    pub anchor: f32,
    /// Factor of ridge and bound of a harmonic that is not constant.
    pub rest: f32,
}

/// Factor of ridge and bound of harmonics beyond the constant one. Photos see a
/// Gaussian from one side, where many fields of degree 3 show the same: of these the one is found
/// whose view dependence, weighted so, is least (docs/experiments.md).
pub const REST: f64 = 20.0;

/// Twin of `MEMORY`: pairs that are remembered. Eight do no better.
pub(super) const MEMORY: usize = 5;

/// Twin of `RHO`: scalars before those of the pairs, of which each has two.
const SHARED_SCALARS: usize = 11;

/// Twins of the scalars that the host knows.
const LOSS: usize = 0;
const NEXT: usize = 1;
const SCALE: usize = 4;
const MOVED: usize = 9;
const CHANGED: usize = 10;

/// Twin of `ONWARD`.
const ONWARD: f64 = 0.0;

/// The loss before the first point is accepted, as the first scalar.
const UNKNOWN: f32 = f32::MAX;

/// Unknowns, planes `[harmonics, channels, N]`, and the figures that the caller leaves
/// before [`Lbfgs::step`].
pub struct System {
    /// Unknowns: the first planes of this, as many as the gradient has.
    pub unknowns: Buffer<f32>,
    /// The loss's gradient.
    pub gradient: Buffer<f32>,
    /// Sums of the pixels' curvatures, weighed as Gaussians are drawn there: a plane for
    /// each channel, or one for all.
    pub diagonal: Buffer<f32>,
    /// The least that each unknown may be; [`UNBOUNDED`] where nothing bounds it.
    pub floors: Buffer<f32>,
    /// The losses whose sum is minimized.
    pub losses: Buffer<f32>,
}

/// The floor of an unknown that has none.
pub const UNBOUNDED: f32 = f32::MIN;

/// Planes of floats that a system and its solver take for each plane of unknowns, beside
/// these: gradient, floors, the accepted point and its gradient, preconditioner,
/// direction, anchors, and the pairs.
const PLANES: usize = 7 + 2 * MEMORY;

/// Bytes of a system of `planes` planes of unknowns, and of its solver.
pub(super) fn bytes(splats: usize, planes: usize) -> u64 {
    // And the diagonal's, two at most, with as many pulls.
    4 * splats as u64 * ((1 + PLANES) * planes + 4) as u64
}

/// The compiled kernels.
pub struct LbfgsKernels {
    ridge: Kernel,
    judge: Kernel,
    keep: Kernel,
    anchor: Kernel,
    begin: Kernel,
    dot: Kernel,
    curvature: Kernel,
    spread: Kernel,
    scale: Kernel,
    moved: Kernel,
    mean: Kernel,
    alpha: Kernel,
    add: Kernel,
    precondition: Kernel,
    beta: Kernel,
    slope: Kernel,
    step: Kernel,
}

impl LbfgsKernels {
    /// Compiles them.
    pub fn new(gpu: &Gpu) -> Self {
        let kernel = |name| Kernel::new(gpu, name, shaders::LBFGS);
        Self {
            ridge: kernel("lbfgs_ridge"),
            judge: kernel("lbfgs_judge"),
            keep: kernel("lbfgs_pair"),
            anchor: kernel("lbfgs_anchor"),
            begin: kernel("lbfgs_begin"),
            dot: kernel("lbfgs_dot"),
            curvature: kernel("lbfgs_curvature"),
            spread: kernel("lbfgs_spread"),
            scale: kernel("lbfgs_scale"),
            moved: kernel("lbfgs_moved"),
            mean: kernel("lbfgs_mean"),
            alpha: kernel("lbfgs_alpha"),
            add: kernel("lbfgs_add"),
            precondition: kernel("lbfgs_precondition"),
            beta: kernel("lbfgs_beta"),
            slope: kernel("lbfgs_slope"),
            step: kernel("lbfgs_step"),
        }
    }
}

/// Kernels of one pair.
struct PairKernels {
    keep: Bound,
    curvature: [Bound; 2],
    spread: [Bound; 2],
    moved: [Bound; 2],
    along_displacement: Bound,
    alpha: Bound,
    add_change: Bound,
    along_change: Bound,
    beta: Bound,
    add_displacement: Bound,
}

impl PairKernels {
    /// Kernels of the pair `index`, whose buffers are in `slots`.
    fn new(kernels: &LbfgsKernels, index: usize, slots: &Slots<'_>) -> Result<Self, GpuError> {
        let index = Buffer::uniform(slots.gpu, "pair", &(index as u32))?;
        let slots = slots.put(PAIR, index.raw());
        let product = |left: u32, right: u32| {
            let slots = slots.copy(LEFT, left).copy(RIGHT, right);
            slots.bind(&kernels.dot, &[SUMS, LEFT, RIGHT])
        };
        let add = |left: u32| {
            let slots = slots.copy(LEFT, left);
            slots.bind(&kernels.add, &[DIRECTION, SCALARS, LEFT])
        };
        let sum = |kernel: &Kernel| slots.bind(kernel, &[PAIR, SUMS, SCALARS]);
        Ok(Self {
            keep: slots.bind(
                &kernels.keep,
                &[
                    UNKNOWNS,
                    GRADIENT,
                    ACCEPTED_UNKNOWNS,
                    ACCEPTED_GRADIENT,
                    DISPLACEMENT,
                    CHANGE,
                    SCALARS,
                ],
            ),
            curvature: [
                product(DISPLACEMENT, CHANGE),
                slots.bind(&kernels.curvature, &[SUMS, SCALARS]),
            ],
            spread: [
                slots.bind(&kernels.spread, &[INVERSE, CHANGE, SUMS]),
                sum(&kernels.scale),
            ],
            moved: [
                slots.bind(&kernels.moved, &[DIAGONAL, DISPLACEMENT, SUMS]),
                slots.bind(&kernels.mean, &[SUMS, SCALARS]),
            ],
            along_displacement: product(DISPLACEMENT, DIRECTION),
            alpha: sum(&kernels.alpha),
            add_change: add(CHANGE),
            along_change: product(CHANGE, DIRECTION),
            beta: sum(&kernels.beta),
            add_displacement: add(DISPLACEMENT),
        })
    }
}

/// The kernels tied to one system.
pub struct Lbfgs {
    scalars: Buffer<f32>,
    /// All that the next step goes by, by name.
    kept: Vec<(String, Buffer<f32>)>,
    ridge: Bound,
    judge: Bound,
    anchor: Bound,
    begin: Bound,
    precondition: Bound,
    slope: [Bound; 2],
    step: Bound,
    pairs: Vec<PairKernels>,
    newest: usize,
    blocks: u32,
}

/// State of the iteration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LbfgsState {
    /// The least loss so far, the parts of ridge and anchors included.
    pub loss: f64,
    /// Mean change of the colors by the last step: as Gaussians are drawn, and as the loss
    /// weighs the pixels. `None` where that step was undone.
    pub moved: Option<f64>,
}

impl LbfgsState {
    /// From what [`Lbfgs::state_later`] reads.
    pub fn of(scalars: &[f32]) -> Self {
        let at = |index: usize| f64::from(scalars[index]);
        Self {
            loss: at(LOSS),
            moved: (at(NEXT) == ONWARD).then(|| at(MOVED)),
        }
    }
}

/// Ratio of the majorizer's diagonal to the sum of weights, for a constant harmonic of so many.
pub fn diagonal_scale(harmonics: usize) -> f64 {
    sh::C0 * (1.0 + harmonics.saturating_sub(1) as f64 / REST)
}

impl Lbfgs {
    /// Ties the kernels to `system` of `splats` Gaussians with so many channels. `ridge` is
    /// added to the matrix's diagonal, [`REST`] times for harmonics that are not constant, and
    /// once the unknowns are anchored the share `anchor` of what pictures add to it.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        gpu: &Gpu,
        kernels: &LbfgsKernels,
        system: &System,
        [splats, channels]: [usize; 2],
        [ridge, anchor]: [f32; 2],
    ) -> Result<Self, GpuError> {
        let length = system.gradient.len();
        // The adjoint multiplies by the constant harmonic once, the matrix by all harmonics
        // twice, and the squares of those sum to as many of its own square (Unsöld 1927), each
        // divided by its factor: then the bound of each is its factor times the sum.
        let harmonics = length / (channels * splats).max(1);
        let blocks = groups_for(length);
        let parameters = Buffer::uniform(
            gpu,
            "lbfgs parameters",
            &LbfgsParameters {
                length: length as u32,
                splats: splats as u32,
                diagonals: (system.diagonal.len() / splats.max(1)).max(1) as u32,
                blocks,
                ridge,
                diagonal_scale: diagonal_scale(harmonics) as f32,
                constants: (channels * splats) as u32,
                color: sh::C0 as f32,
                anchor,
                rest: REST as f32,
            },
        )?;
        let zeros = |label| Buffer::<f32>::zeros(gpu, label, length);
        let named = |name: &str, buffer: &Buffer<f32>| (name.to_owned(), buffer.clone());
        let [accepted_unknowns, accepted_gradient] = [zeros("accepted")?, zeros("accepted")?];
        let (preconditioner, direction) = (zeros("preconditioner")?, zeros("direction")?);
        let anchors = zeros("anchors")?;
        let pulls = Buffer::<f32>::zeros(gpu, "pulls", system.diagonal.len())?;
        let block_sums = Buffer::<f32>::zeros(gpu, "lbfgs sums", 2 * blocks as usize)?;
        let scalars = Buffer::<f32>::zeros(gpu, "scalars", SHARED_SCALARS + 2 * MEMORY)?;
        let mut kept = vec![
            named("accepted unknowns", &accepted_unknowns),
            named("accepted gradient", &accepted_gradient),
            named("preconditioner", &preconditioner),
            named("direction", &direction),
            named("anchors", &anchors),
            named("pulls", &pulls),
        ];
        let slots = Slots::new(gpu, parameters.raw()).with([
            (UNKNOWNS, &system.unknowns),
            (GRADIENT, &system.gradient),
            (DIAGONAL, &system.diagonal),
            (FLOORS, &system.floors),
            (LOSSES, &system.losses),
            (ACCEPTED_UNKNOWNS, &accepted_unknowns),
            (ACCEPTED_GRADIENT, &accepted_gradient),
            (INVERSE, &preconditioner),
            (DIRECTION, &direction),
            (SUMS, &block_sums),
            (SCALARS, &scalars),
            (LEFT, &system.gradient),
            (RIGHT, &direction),
            (ANCHORS, &anchors),
            (PULLS, &pulls),
        ]);
        let mut pairs = Vec::with_capacity(MEMORY);
        for index in 0..MEMORY {
            let [displacement, change] = [zeros("displacement")?, zeros("change")?];
            kept.push(named(&format!("displacement {index}"), &displacement));
            kept.push(named(&format!("change {index}"), &change));
            let slots = slots.with([(DISPLACEMENT, &displacement), (CHANGE, &change)]);
            pairs.push(PairKernels::new(kernels, index, &slots)?);
        }
        kept.push(named("scalars", &scalars));
        let sum = [SUMS, SCALARS];
        let lbfgs = Self {
            kept,
            ridge: slots.bind(&kernels.ridge, &[UNKNOWNS, GRADIENT, SUMS, ANCHORS, PULLS]),
            judge: slots.bind(&kernels.judge, &[LOSSES, SUMS, SCALARS]),
            anchor: slots.bind(
                &kernels.anchor,
                &[ACCEPTED_UNKNOWNS, DIAGONAL, ANCHORS, PULLS],
            ),
            begin: slots.bind(
                &kernels.begin,
                &[
                    UNKNOWNS, GRADIENT, DIAGONAL, FLOORS, INVERSE, DIRECTION, SCALARS, PULLS,
                ],
            ),
            precondition: slots.bind(&kernels.precondition, &[INVERSE, DIRECTION, SCALARS]),
            slope: [
                slots.bind(&kernels.dot, &[SUMS, LEFT, RIGHT]),
                slots.bind(&kernels.slope, &sum),
            ],
            step: slots.bind(
                &kernels.step,
                &[UNKNOWNS, FLOORS, INVERSE, DIRECTION, SCALARS],
            ),
            pairs,
            newest: 0,
            blocks,
            scalars,
        };
        lbfgs.scalars.write_at(gpu, SCALE, &[1.0]);
        lbfgs.restart(gpu);
        Ok(lbfgs)
    }

    /// The minimized function is another from now on, though one like that before: the
    /// present point is accepted whatever the loss there.
    pub fn restart(&self, gpu: &Gpu) {
        self.scalars.write_at(gpu, LOSS, &[UNKNOWN]);
    }

    /// The minimized function is a little different from now on: the next step is judged by the
    /// loss so far, but what the gradient changes by says nothing of the curvature.
    pub fn changed(&self, gpu: &Gpu) {
        self.scalars.write_at(gpu, CHANGED, &[1.0]);
    }

    /// Records that from now on each unknown is drawn to where it is accepted: after
    /// [`Lbfgs::step`] that accepted it, before the diagonal is another point's.
    pub fn anchor(&self, recorder: &mut Recorder) {
        self.all(recorder, &self.anchor);
    }

    /// The newest pair, and the buffers that the next step goes by.
    pub(super) fn kept(&self) -> (usize, &[(String, Buffer<f32>)]) {
        (self.newest, &self.kept)
    }

    /// Goes on after this pair, where the buffers hold what they held then.
    pub(super) fn go_on_after(&mut self, newest: usize) {
        self.newest = newest % MEMORY;
    }

    /// Records a step from where loss and gradient are ready.
    pub fn step(&mut self, recorder: &mut Recorder) {
        self.judge(recorder);
        self.all(recorder, &self.begin);
        self.compare(recorder);
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
        let [terms, sum] = &self.slope;
        self.all(recorder, terms);
        self.one(recorder, sum);
        self.all(recorder, &self.step);
    }

    /// Records the end of what is minimized, where the loss is ready: a last step that raised
    /// it is undone. Nothing may have been recorded before.
    pub fn end(&mut self, gpu: &Gpu, recorder: &mut Recorder) {
        // No gradient, no pair.
        self.changed(gpu);
        self.judge(recorder);
        self.compare(recorder);
    }

    /// Orders where it stands.
    pub fn state_later(&self, gpu: &Gpu) -> Readback<f32> {
        self.scalars.read_later(gpu)
    }

    /// Records whether the present point is accepted, and the return from it if it is not.
    fn judge(&mut self, recorder: &mut Recorder) {
        self.newest = (self.newest + 1) % MEMORY;
        self.all(recorder, &self.ridge);
        self.one(recorder, &self.judge);
        self.all(recorder, &self.pairs[self.newest].keep);
    }

    /// Records what the newest pair is worth, and how far it goes.
    fn compare(&self, recorder: &mut Recorder) {
        let newest = &self.pairs[self.newest];
        for [terms, sum] in [&newest.curvature, &newest.spread, &newest.moved] {
            self.all(recorder, terms);
            self.one(recorder, sum);
        }
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
