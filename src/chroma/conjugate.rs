//! Preconditioned conjugate gradients that stay on the device
//! (`shaders/conjugate.wgsl`).

use bytemuck::{Pod, Zeroable};

use crate::{
    gpu::{Bindings, Buffer, Gpu, GpuError, Kernel, Recorder, groups_for, shaders},
    splats::sh,
};

/// Twin of `struct ConjugateParameters`.
#[repr(C)]
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
pub struct ConjugateParameters {
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

/// The arrays of one linear system, planes `[planes, N]`.
pub struct System {
    /// What is solved for.
    pub unknowns: Buffer<f32>,
    /// The caller leaves the gradient here before [`Conjugate::begin`].
    pub residual: Buffer<f32>,
    /// The direction that the caller multiplies by the matrix.
    pub direction: Buffer<f32>,
    /// Where it leaves the product.
    pub product: Buffer<f32>,
    /// The adjoint of the weights themselves, of which the planes of the constant
    /// harmonic count.
    pub diagonal: Buffer<f32>,
    /// The least that each unknown may be; [`UNBOUNDED`] where nothing bounds it.
    pub floors: Buffer<f32>,
}

/// The floor of an unknown that has none.
pub const UNBOUNDED: f32 = f32::MIN;

/// The kernels tied to one system.
pub struct Conjugate {
    kernels: [Kernel; 8],
    bindings: [Bindings; 8],
    blocks: u32,
}

/// Entry points in the order of `Conjugate::kernels`.
const ENTRIES: [(&str, &[u32]); 8] = [
    ("conjugate_begin", &[0, 1, 2, 3, 5, 6, 8, 9]),
    ("conjugate_rho", &[0, 6, 7]),
    ("conjugate_product", &[0, 3, 4, 6]),
    ("conjugate_alpha", &[0, 6, 7]),
    ("conjugate_step", &[0, 1, 2, 3, 4, 6, 7, 9]),
    ("conjugate_beta", &[0, 6, 7]),
    ("conjugate_direction", &[0, 2, 3, 7, 9]),
    ("conjugate_end", &[0, 1, 8]),
];

impl Conjugate {
    /// Compiles the kernels for `system` of `splats` Gaussians.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn new(gpu: &Gpu, system: &System, splats: usize, ridge: f32) -> Result<Self, GpuError> {
        let length = system.unknowns.len();
        let blocks = groups_for(length);
        let parameters = Buffer::uniform(
            gpu,
            "conjugate parameters",
            &ConjugateParameters {
                length: length as u32,
                splats: splats as u32,
                blocks,
                ridge,
                // The adjoint multiplies by the constant harmonic once, the matrix twice.
                diagonal_scale: sh::C0 as f32,
            },
        )?;
        let block_sums = Buffer::<f32>::zeros(gpu, "conjugate sums", blocks as usize)?;
        let scalars = Buffer::<f32>::zeros(gpu, "conjugate scalars", 3)?;
        let preconditioner = Buffer::<f32>::zeros(gpu, "preconditioner", length)?;
        let buffers = [
            parameters.raw(),
            system.unknowns.raw(),
            system.residual.raw(),
            system.direction.raw(),
            system.product.raw(),
            system.diagonal.raw(),
            block_sums.raw(),
            scalars.raw(),
            system.floors.raw(),
            preconditioner.raw(),
        ];
        let kernels = ENTRIES.map(|(name, _)| Kernel::new(gpu, name, shaders::CONJUGATE));
        let bindings = std::array::from_fn(|k| {
            let used: Vec<_> = (ENTRIES[k].1.iter())
                .map(|&binding| (binding, buffers[binding as usize]))
                .collect();
            kernels[k].bind_at(gpu, &used)
        });
        Ok(Self {
            kernels,
            bindings,
            blocks,
        })
    }

    fn run(&self, recorder: &mut Recorder, entry: usize) {
        // The odd ones add up what the workgroups of the one before left.
        let groups = if matches!(entry, 1 | 3 | 5) {
            1
        } else {
            self.blocks
        };
        recorder.dispatch(&self.kernels[entry], &self.bindings[entry], groups);
    }

    /// Records the start: the residual from the gradient, and the first direction.
    pub fn begin(&self, recorder: &mut Recorder) {
        self.run(recorder, 0);
        self.run(recorder, 1);
    }

    /// Records a step along the direction, whose product is ready, and the next
    /// direction.
    pub fn step(&self, recorder: &mut Recorder) {
        for entry in 2..7 {
            self.run(recorder, entry);
        }
    }

    /// Records the end of a round: what went below its floor is put onto it. The residual
    /// is not that of the unknowns any more.
    pub fn end(&self, recorder: &mut Recorder) {
        self.run(recorder, 7);
    }
}
