//! `relocation_noise`.

use std::sync::Arc;

use crate::{
    compare::widen,
    doctor::measured::{Allowance, Row, Sample},
    gpu::{Buffer, GpuError, Recorder},
    luma::relocation::{Relocation, RelocationKernel, RelocationParameters},
    oracle::{random::Random, relocation::relocation_noise},
    raster::{Raster, constants::*},
};

/// Three workgroups, the last cut short.
const COUNT: usize = 600;

/// Of these, the last, that stay.
const HELD: usize = 20;

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
        noise: 2.0,
        trained: (COUNT - HELD) as u32,
    };
    let values = Buffer::from_slice(gpu, "geometry", &geometry)?;
    let status = Buffer::zeros(gpu, "status", STATUS_WORDS)?;
    let kernel = RelocationKernel::new(gpu);
    let relocation = Relocation::new(gpu, &kernel, &status, &values)?;
    let mut recorder = Recorder::new(gpu);
    relocation.record(gpu, &kernel, &mut recorder, &parameters);
    recorder.submit();

    let at = |plane: usize, i: usize| f64::from(geometry[plane * COUNT + i]);
    let mut moved = widen(&geometry);
    for i in 0..COUNT - HELD {
        let quat = std::array::from_fn(|k| at(PLANE_QUAT + k, i));
        let log_scale = std::array::from_fn(|axis| at(PLANE_LOG_SCALE + axis, i));
        let logit = at(PLANE_OPACITY, i);
        let noise = relocation_noise(quat, log_scale, logit, 2.0, 12_345, i as u32);
        for axis in 0..3 {
            moved[(PLANE_MEAN + axis) * COUNT + i] += noise[axis];
        }
    }
    let sample = Sample::new(widen(&values.read(gpu)?), moved);
    let bound = allowed.relative(4.1e-7, 1.0);
    Ok(vec![Row::elementwise(
        "relocation_noise",
        "geometry",
        bound,
        &[sample],
    )])
}
