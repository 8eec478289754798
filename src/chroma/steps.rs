//! The steps of L-BFGS: on the device ([`Lbfgs`]), or on the host, in f64, where the unknowns wait
//! there.

use std::collections::BTreeMap;

use super::{
    ChromaError,
    checkpoint::SolverState,
    host_lbfgs::HostLbfgs,
    lbfgs::{Lbfgs, LbfgsKernels, LbfgsState, System, UNBOUNDED, diagonal_scale},
    passes::Passes,
};
use crate::{
    gpu::{Buffer, Gpu, Recorder},
    splats::sh,
};

/// Weights of the priors beside the pictures.
#[derive(Clone, Copy, Debug)]
pub(super) struct Priors {
    /// Added to the matrix's diagonal.
    pub ridge: f64,
    /// Pull of an anchor, as a share of the pictures'.
    pub anchor: f64,
}

/// Minimizer, on the device or on the host.
pub(super) enum Steps {
    Device(System, Box<Lbfgs>),
    Host(Box<HostSteps>),
}

/// On the host.
pub(super) struct HostSteps {
    lbfgs: HostLbfgs,
    priors: Priors,
    splats: usize,
    diagonal_scale: f64,
}

/// Figures that a step goes by: in f32 on the device, in f64 on the host.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct StepStatus {
    pub newest: usize,
    pub buffers: BTreeMap<String, Vec<f32>>,
    pub doubles: BTreeMap<String, Vec<f64>>,
}

impl Steps {
    /// Begins where `passes` are.
    pub fn new(
        kernels: &LbfgsKernels,
        passes: &Passes<'_>,
        priors: Priors,
    ) -> Result<Self, ChromaError> {
        let gpu = passes.frozen.gpu();
        let channels = passes.field.kind.channels();
        let Some(on_host) = &passes.on_host else {
            let system = System {
                unknowns: passes.field.planes.clone(),
                gradient: passes.gradient.clone(),
                diagonal: passes.diagonal.clone(),
                floors: Buffer::from_slice(gpu, "floors", &vec![UNBOUNDED; passes.gradient.len()])?,
                losses: passes.log.losses.clone(),
            };
            let size = [passes.frozen.primitives().count(), channels];
            let priors = [priors.ridge, priors.anchor].map(|prior| prior as f32);
            let lbfgs = Lbfgs::new(gpu, kernels, &system, size, priors)?;
            return Ok(Self::Device(system, Box::new(lbfgs)));
        };
        let length = on_host.gradient.len();
        let splats = passes.frozen.primitives().count();
        let constants = channels * splats;
        let unknowns = widened(&on_host.unknowns[..length]);
        Ok(Self::Host(Box::new(HostSteps {
            lbfgs: HostLbfgs::new(unknowns, priors.ridge, constants),
            priors,
            splats,
            diagonal_scale: diagonal_scale(length / constants.max(1)),
        })))
    }

    /// Lets no unknown fall below these, planes as the unknowns are.
    pub fn set_floors(&mut self, gpu: &Gpu, floors: &[f32]) {
        match self {
            Self::Device(system, _) => system.floors.write(gpu, floors),
            Self::Host(host) => host.lbfgs.set_floors(floors),
        }
    }

    /// A step from where all views are drawn, and where it stands.
    pub fn step(&mut self, passes: &mut Passes<'_>) -> Result<LbfgsState, ChromaError> {
        match self {
            Self::Device(_, lbfgs) => {
                let mut recorder = Recorder::new(passes.frozen.gpu());
                lbfgs.step(&mut recorder);
                recorder.submit();
                state(lbfgs, passes.frozen.gpu())
            }
            Self::Host(host) => host.step(passes),
        }
    }

    /// Judges the last step, where all views are drawn for their loss.
    pub fn end(&mut self, passes: &mut Passes<'_>) -> Result<LbfgsState, ChromaError> {
        let gpu = passes.frozen.gpu();
        match self {
            Self::Device(_, lbfgs) => {
                let mut recorder = Recorder::new(gpu);
                lbfgs.end(gpu, &mut recorder);
                recorder.submit();
                state(lbfgs, gpu)
            }
            Self::Host(host) => host.end(passes),
        }
    }

    /// From now on each unknown is drawn to where it was accepted: after [`Steps::step`] that
    /// accepted it, before the curvature is another point's.
    pub fn anchor(&mut self, passes: &Passes<'_>) {
        match self {
            Self::Device(_, lbfgs) => {
                let mut recorder = Recorder::new(passes.frozen.gpu());
                lbfgs.anchor(&mut recorder);
                recorder.submit();
            }
            Self::Host(host) => host.anchor(passes),
        }
    }

    /// See [`Lbfgs::restart`].
    pub fn restart(&mut self, gpu: &Gpu) {
        match self {
            Self::Device(_, lbfgs) => lbfgs.restart(gpu),
            Self::Host(host) => host.lbfgs.restart(),
        }
    }

    /// See [`Lbfgs::changed`].
    pub fn changed(&mut self, gpu: &Gpu) {
        match self {
            Self::Device(_, lbfgs) => lbfgs.changed(gpu),
            Self::Host(host) => host.lbfgs.changed(),
        }
    }

    /// All that the next step goes by.
    pub fn kept(&self, passes: &Passes<'_>) -> Result<StepStatus, ChromaError> {
        let gpu = passes.frozen.gpu();
        let mut kept = StepStatus::default();
        match self {
            Self::Device(system, lbfgs) => {
                for (name, buffer) in of_system(system) {
                    kept.buffers.insert(name.to_owned(), buffer.read(gpu)?);
                }
                let (newest, buffers) = lbfgs.kept();
                kept.newest = newest;
                for (name, buffer) in buffers {
                    kept.buffers.insert(name.clone(), buffer.read(gpu)?);
                }
            }
            Self::Host(host) => {
                (kept.doubles).insert(LBFGS.to_owned(), host.lbfgs.kept());
                kept.buffers
                    .insert(DIAGONAL.to_owned(), passes.curvature()?);
            }
        }
        Ok(kept)
    }

    /// Goes on from what steps of the same problem kept; `false` where it is of another.
    pub fn go_on_from(&mut self, kept: &SolverState, passes: &mut Passes<'_>) -> bool {
        let gpu = passes.frozen.gpu();
        match self {
            Self::Device(system, lbfgs) => {
                let put = |name: &str, buffer: &Buffer<f32>| kept.put(name, buffer, gpu);
                let of_system = of_system(system).into_iter();
                let fits = of_system.fold(true, |fits, (name, buffer)| fits & put(name, buffer));
                let of_steps = lbfgs.kept().1.iter();
                let fits = of_steps.fold(fits, |fits, (name, buffer)| fits & put(name, buffer));
                lbfgs.go_on_after(kept.rounds.newest);
                fits
            }
            Self::Host(host) => {
                let Some(on_host) = &mut passes.on_host else {
                    return false;
                };
                let diagonal = kept.buffers.get(DIAGONAL);
                let Some(diagonal) = diagonal.filter(|d| d.len() == on_host.diagonal.len()) else {
                    return false;
                };
                on_host.diagonal.clone_from(diagonal);
                let steps = kept.doubles.get(LBFGS);
                let found = steps.and_then(|steps| host.lbfgs.restored(steps));
                let fits = found.map(|found| host.lbfgs = found).is_some();
                host.show(passes);
                fits
            }
        }
    }
}

/// Names in a checkpoint: of the curvature, and of the host's L-BFGS.
const DIAGONAL: &str = "diagonal";
const LBFGS: &str = "lbfgs";

/// Buffers of the system that a checkpoint has.
fn of_system(system: &System) -> [(&'static str, &Buffer<f32>); 2] {
    [("unknowns", &system.unknowns), (DIAGONAL, &system.diagonal)]
}

fn state(lbfgs: &Lbfgs, gpu: &Gpu) -> Result<LbfgsState, ChromaError> {
    Ok(LbfgsState::of(&lbfgs.state_later(gpu).wait(gpu)?))
}

fn widened(values: &[f32]) -> Vec<f64> {
    values.iter().map(|&value| f64::from(value)).collect()
}

impl HostSteps {
    /// Weight of each unknown's pixels: twin of `of_channel`.
    fn weights(&self, passes: &Passes<'_>) -> Vec<f64> {
        let Some(on_host) = &passes.on_host else {
            return Vec::new();
        };
        let (n, sums) = (self.splats, &on_host.diagonal);
        let diagonals = sums.len() / n.max(1);
        let of = |k: usize| f64::from(sums[(k / n) % diagonals * n + k % n]);
        (0..on_host.gradient.len()).map(of).collect()
    }

    /// The sum of all views' losses.
    fn loss(passes: &Passes<'_>) -> Result<f64, ChromaError> {
        let gpu = passes.frozen.gpu();
        let losses = passes.log.read_later(gpu).wait(gpu)?;
        Ok(losses.iter().map(|&loss| f64::from(loss)).sum())
    }

    fn step(&mut self, passes: &mut Passes<'_>) -> Result<LbfgsState, ChromaError> {
        let loss = Self::loss(passes)?;
        let weights = self.weights(passes);
        let of_pictures = weights.iter().enumerate().map(|(k, weight)| {
            self.lbfgs.factor(k) * (self.diagonal_scale * weight + self.priors.ridge)
        });
        let diagonal: Vec<f64> = of_pictures.collect();
        let on_host = passes.on_host.as_ref();
        let gradient = on_host.map(|on_host| widened(&on_host.gradient));
        (self.lbfgs).step(loss, gradient.unwrap_or_default(), &diagonal);
        self.show(passes);
        Ok(self.state(&weights))
    }

    fn end(&mut self, passes: &mut Passes<'_>) -> Result<LbfgsState, ChromaError> {
        self.lbfgs.end(Self::loss(passes)?);
        self.show(passes);
        Ok(self.state(&self.weights(passes)))
    }

    fn anchor(&mut self, passes: &Passes<'_>) {
        let pull = |weight| self.priors.anchor * sh::C0 * weight;
        let pulls = self.weights(passes).into_iter().map(pull).collect();
        self.lbfgs.anchor(pulls);
    }

    /// Brings the unknowns to where they are drawn from, in f32.
    fn show(&mut self, passes: &mut Passes<'_>) {
        let Some(on_host) = &mut passes.on_host else {
            return;
        };
        for (shown, x) in on_host.unknowns.iter_mut().zip(&mut self.lbfgs.unknowns) {
            *shown = *x as f32;
            *x = f64::from(*shown);
        }
    }

    fn state(&self, weights: &[f64]) -> LbfgsState {
        let moved = self.lbfgs.moved(weights);
        LbfgsState {
            loss: self.lbfgs.loss().unwrap_or(f64::MAX),
            moved: moved.map(|moved| sh::C0 * moved),
        }
    }
}
