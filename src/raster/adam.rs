//! Adam over planes `[planes, N]` (`shaders/adam.wgsl`).

use bytemuck::{Pod, Zeroable};

use super::StepBuffers;
use crate::gpu::{Bindings, Buffer, Gpu, GpuError, Kernel, Recorder, groups_for, shaders};

const BETA1: f64 = 0.9;
const BETA2: f64 = 0.999;

/// Planes that the uniform has learning rates for: 16 coefficients of 3 channels.
const MAX_PLANES: usize = 48;

/// Twin of `struct AdamParameters`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct AdamParameters {
    /// Elements of a plane.
    pub splat_count: u32,
    /// Planes.
    pub planes: u32,
    /// 1 / (1 - β₁ᵗ).
    pub correction1: f32,
    /// 1 / (1 - β₂ᵗ).
    pub correction2: f32,
    /// Weight of each opacity in the loss.
    pub opacity_weight: f32,
    /// Weight of each standard deviation in the loss.
    pub scale_weight: f32,
    /// Keeps the rates aligned.
    pub padding: [u32; 2],
    /// One rate a plane.
    pub learning_rates: [f32; MAX_PLANES],
}

/// The kernel.
pub struct AdamKernel(Kernel);

impl AdamKernel {
    /// Compiles it.
    pub fn new(gpu: &Gpu) -> Self {
        Self(Kernel::new(gpu, "adam", shaders::ADAM))
    }
}

/// Adam's state for one buffer of parameters.
pub struct AdamState {
    /// First moments.
    pub first: Buffer<f32>,
    /// Second moments.
    pub second: Buffer<f32>,
    parameters: Buffer<AdamParameters>,
    planes: usize,
    count: usize,
}

impl AdamState {
    /// For planes of `count` elements, `len` in all, starting from the given moments,
    /// or from rest.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        gpu: &Gpu,
        len: usize,
        count: usize,
        moments: Option<[Buffer<f32>; 2]>,
    ) -> Result<Self, GpuError> {
        let zeros = |label| Buffer::zeros(gpu, label, len);
        let [first, second] = match moments {
            Some(moments) => moments,
            None => [zeros("first moments")?, zeros("second moments")?],
        };
        Ok(Self {
            first,
            second,
            parameters: Buffer::uniform(gpu, "adam parameters", &AdamParameters::zeroed())?,
            planes: len / count.max(1),
            count,
        })
    }

    /// What an adjoint that steps at once binds.
    pub fn step_buffers(&self) -> StepBuffers<'_> {
        StepBuffers {
            parameters: self.parameters.raw(),
            first: &self.first,
            second: &self.second,
        }
    }

    /// Chooses a learning rate for each plane for what is submitted next. `step`
    /// counts from 1 and sets the bias correction. `weights` are those of each opacity
    /// and each standard deviation in the loss.
    ///
    /// # Panics
    /// When there are fewer rates than planes, or more than 48 planes.
    pub fn set(&self, gpu: &Gpu, step: u32, rates: &[f32], weights: [f32; 2]) {
        let mut learning_rates = [0.0; MAX_PLANES];
        learning_rates[..self.planes].copy_from_slice(&rates[..self.planes]);
        let correction = |beta: f64| (1.0 / (1.0 - beta.powf(f64::from(step)))) as f32;
        self.parameters.write(
            gpu,
            &[AdamParameters {
                splat_count: self.count as u32,
                planes: self.planes as u32,
                correction1: correction(BETA1),
                correction2: correction(BETA2),
                opacity_weight: weights[0],
                scale_weight: weights[1],
                padding: [0; 2],
                learning_rates,
            }],
        );
    }
}

/// Adam on a stored gradient.
pub struct Adam {
    /// Moments and rates.
    pub state: AdamState,
    bindings: Bindings,
}

impl Adam {
    /// Adam on `values` (planes of `count` elements) with `gradient`, starting
    /// from the given moments, or from rest.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(
        gpu: &Gpu,
        kernel: &AdamKernel,
        status: &Buffer<u32>,
        gradient: &Buffer<f32>,
        values: &Buffer<f32>,
        count: usize,
        moments: Option<[Buffer<f32>; 2]>,
    ) -> Result<Self, GpuError> {
        let state = AdamState::new(gpu, values.len(), count, moments)?;
        let bindings = kernel.0.bind(
            gpu,
            &[
                state.parameters.raw(),
                status.raw(),
                gradient.raw(),
                values.raw(),
                state.first.raw(),
                state.second.raw(),
            ],
        );
        Ok(Self { state, bindings })
    }

    /// Records one step as [`AdamState::set`] describes it.
    ///
    /// # Panics
    /// When there are fewer rates than planes, or more than 48 planes.
    pub fn record(
        &self,
        gpu: &Gpu,
        kernel: &AdamKernel,
        recorder: &mut Recorder,
        step: u32,
        rates: &[f32],
    ) {
        self.state.set(gpu, step, rates, [0.0; 2]);
        let elements = self.state.count * self.state.planes;
        recorder.dispatch(&kernel.0, &self.bindings, groups_for(elements));
    }
}
