//! Adam over planes `[planes, N]` (`shaders/adam.wgsl`).

use bytemuck::{Pod, Zeroable};

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
    /// Number of parameter planes.
    pub planes: u32,
    /// 1 / (1 - β₁ᵗ).
    pub correction1: f32,
    /// 1 / (1 - β₂ᵗ).
    pub correction2: f32,
    /// Elements of a plane that are trained; those behind them stay. The adjoints that step at
    /// once look at it.
    pub trained: u32,
    /// Keeps the rates aligned.
    pub padding: [u32; 3],
    /// One rate a plane.
    pub learning_rates: [f32; MAX_PLANES],
}

/// The compiled `adam` kernel.
pub struct AdamKernel(Kernel);

impl AdamKernel {
    /// Compiles the kernel for a device.
    pub fn new(gpu: &Gpu) -> Self {
        Self(Kernel::new(gpu, "adam", shaders::ADAM))
    }
}

/// First and second moments of planes of parameters, in the same layout. Clones share them.
#[derive(Clone)]
pub struct AdamMoments {
    /// Running mean of the gradient.
    pub first: Buffer<f32>,
    /// Running mean of its square.
    pub second: Buffer<f32>,
}

impl AdamMoments {
    /// AdamMoments at rest of `len` parameters.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn zeros(gpu: &Gpu, len: usize) -> Result<Self, GpuError> {
        Ok(Self {
            first: Buffer::zeros(gpu, "first moments", len)?,
            second: Buffer::zeros(gpu, "second moments", len)?,
        })
    }
}

/// Learning rates and bias corrections of a step.
pub struct AdamStep {
    parameters: Buffer<AdamParameters>,
    planes: usize,
    count: usize,
    trained: usize,
}

impl AdamStep {
    /// For at most 48 `planes` of `count` elements each.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(gpu: &Gpu, planes: usize, count: usize) -> Result<Self, GpuError> {
        Self::holding(gpu, planes, count, 0)
    }

    /// The same for an adjoint that steps at once, where the last `held` elements of each plane
    /// stay as they are.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn holding(gpu: &Gpu, planes: usize, count: usize, held: usize) -> Result<Self, GpuError> {
        Ok(Self {
            trained: count.saturating_sub(held),
            parameters: Buffer::uniform(gpu, "adam parameters", &AdamParameters::zeroed())?,
            planes,
            count,
        })
    }

    /// Chooses a learning rate for each plane for what is submitted next; a plane without
    /// one stays. `step` counts from 1 and sets the bias correction.
    pub fn set(&self, gpu: &Gpu, step: u32, rates: &[f32]) {
        let mut learning_rates = [0.0; MAX_PLANES];
        for (to, &rate) in learning_rates.iter_mut().zip(rates).take(self.planes) {
            *to = rate;
        }
        let correction = |beta: f64| (1.0 / (1.0 - beta.powf(f64::from(step)))) as f32;
        self.parameters.write(
            gpu,
            &[AdamParameters {
                splat_count: self.count as u32,
                planes: self.planes as u32,
                correction1: correction(BETA1),
                correction2: correction(BETA2),
                trained: self.trained as u32,
                padding: [0; 3],
                learning_rates,
            }],
        );
    }

    /// Buffers to bind in an adjoint that steps at once.
    pub fn of<'a>(&'a self, moments: &'a AdamMoments) -> StepBuffers<'a> {
        StepBuffers {
            parameters: &self.parameters,
            moments,
        }
    }
}

/// Buffers of an Adam step.
#[derive(Clone, Copy)]
pub struct StepBuffers<'a> {
    /// Uniform with rates and corrections.
    pub parameters: &'a Buffer<AdamParameters>,
    /// The parameters' moments.
    pub moments: &'a AdamMoments,
}

/// Adam on a stored gradient.
pub struct Adam {
    /// Moments of the values.
    pub moments: AdamMoments,
    step: AdamStep,
    bindings: Bindings,
}

impl Adam {
    /// Adam on the first of `values` (planes of `count` elements), as many as have a
    /// `gradient`, from rest.
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
    ) -> Result<Self, GpuError> {
        let moments = AdamMoments::zeros(gpu, gradient.len())?;
        let step = AdamStep::new(gpu, gradient.len() / count.max(1), count)?;
        let bindings = kernel.0.bind(
            gpu,
            &[
                step.parameters.raw(),
                status.raw(),
                gradient.raw(),
                values.raw(),
                moments.first.raw(),
                moments.second.raw(),
            ],
        );
        Ok(Self {
            moments,
            step,
            bindings,
        })
    }

    /// Records one step as [`AdamStep::set`] describes it.
    pub fn record(
        &self,
        gpu: &Gpu,
        kernel: &AdamKernel,
        recorder: &mut Recorder,
        step: u32,
        rates: &[f32],
    ) {
        self.step.set(gpu, step, rates);
        let elements = self.step.count * self.step.planes;
        recorder.dispatch(&kernel.0, &self.bindings, groups_for(elements));
    }
}
