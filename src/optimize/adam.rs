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
    /// Planes.
    pub planes: u32,
    /// 1 / (1 - β₁ᵗ).
    pub correction1: f32,
    /// 1 / (1 - β₂ᵗ).
    pub correction2: f32,
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
pub struct Adam {
    /// First moments.
    pub first: Buffer<f32>,
    /// Second moments.
    pub second: Buffer<f32>,
    parameters: Buffer<AdamParameters>,
    bindings: Bindings,
    planes: usize,
    count: usize,
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
        let zeros = |label| Buffer::zeros(gpu, label, values.len());
        let [first, second] = match moments {
            Some(moments) => moments,
            None => [zeros("first moments")?, zeros("second moments")?],
        };
        let parameters = Buffer::uniform(gpu, "adam parameters", &AdamParameters::zeroed())?;
        let bindings = kernel.0.bind(
            gpu,
            &[
                parameters.raw(),
                status.raw(),
                gradient.raw(),
                values.raw(),
                first.raw(),
                second.raw(),
            ],
        );
        Ok(Self {
            first,
            second,
            parameters,
            bindings,
            planes: values.len() / count.max(1),
            count,
        })
    }

    /// Records one step with a learning rate for each plane. `step` counts from
    /// 1 and sets the bias correction.
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
                learning_rates,
            }],
        );
        recorder.dispatch(
            &kernel.0,
            &self.bindings,
            groups_for(self.count * self.planes),
        );
    }
}
