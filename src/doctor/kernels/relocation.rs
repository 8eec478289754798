//! `relocation_pull` and `relocation_noise`.

use std::sync::Arc;

use crate::{
    compare::widen,
    doctor::measured::{Allowance, Row, Sample},
    gpu::{Buffer, GpuError, Recorder},
    luma::relocation::{Relocation, RelocationKernels, RelocationParameters},
    oracle::{
        random::Random,
        relocation::{relocation_noise, relocation_pull},
    },
    raster::{Raster, constants::*},
};

/// Three workgroups, the last cut short.
const COUNT: usize = 600;

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let (gpu, allowed) = (&raster.gpu, Allowance::of(&raster.gpu));
    let mut random = Random::new(3);
    let mut geometry: Vec<f32> = Vec::new();
    for plane in 0..GEOMETRY_PLANES {
        let (low, high) = match plane {
            PLANE_LOG_SCALE..PLANE_OPACITY => (-5.0, 0.0),
            // Around where the noise falls off.
            PLANE_OPACITY => (-8.0, -2.0),
            _ => (-1.0, 1.0),
        };
        geometry.extend((0..COUNT).map(|_| random.range(low, high) as f32));
    }
    let parameters = RelocationParameters {
        splat_count: COUNT as u32,
        seed: 12_345,
        opacity_weight: 0.25,
        scale_weight: 0.5,
        noise: 2.0,
    };
    let values = Buffer::from_slice(gpu, "geometry", &geometry)?;
    let gradient = Buffer::<f32>::zeros(gpu, "gradient", geometry.len())?;
    let status = Buffer::zeros(gpu, "status", STATUS_WORDS)?;
    let kernels = RelocationKernels::new(gpu);
    let relocation = Relocation::new(gpu, &kernels, &status, &values, &gradient)?;
    relocation.set(gpu, &parameters);
    let mut recorder = Recorder::new(gpu);
    relocation.record_pull(&kernels, &mut recorder);
    relocation.record_noise(&kernels, &mut recorder);
    recorder.submit();

    let at = |plane: usize, i: usize| f64::from(geometry[plane * COUNT + i]);
    let mut pulled = vec![0.0; geometry.len()];
    let mut moved = widen(&geometry);
    for i in 0..COUNT {
        let quat = std::array::from_fn(|k| at(PLANE_QUAT + k, i));
        let log_scale = std::array::from_fn(|axis| at(PLANE_LOG_SCALE + axis, i));
        let logit = at(PLANE_OPACITY, i);
        let (by_logit, by_scale) = relocation_pull(logit, log_scale, [0.25, 0.5]);
        pulled[PLANE_OPACITY * COUNT + i] = by_logit;
        let noise = relocation_noise(quat, log_scale, logit, 2.0, 12_345, i as u32);
        for axis in 0..3 {
            pulled[(PLANE_LOG_SCALE + axis) * COUNT + i] = by_scale[axis];
            moved[(PLANE_MEAN + axis) * COUNT + i] += noise[axis];
        }
    }
    let sample = |actual: &Buffer<f32>, expected| -> Result<[Sample; 1], GpuError> {
        Ok([Sample::new(widen(&actual.read(gpu)?), expected)])
    };
    Ok(vec![
        Row::elementwise(
            "relocation_pull",
            "gradient",
            allowed.relative(2.6e-7, 0.01),
            &sample(&gradient, pulled)?,
        ),
        Row::elementwise(
            "relocation_noise",
            "geometry",
            allowed.relative(4.1e-7, 1.0),
            &sample(&values, moved)?,
        ),
    ])
}
