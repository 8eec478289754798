//! `densify`: copies, halves of splits, kept and dropped moments.

use std::sync::Arc;

use crate::{
    compare::widen,
    doctor::measured::{Allowance, Row, Sample},
    gpu::{Buffer, Gpu, GpuError, Kernel},
    luma::densify::{DensifyKernels, Descent, apply},
    oracle::{
        linear::{self, rotation},
        random::Random,
    },
    raster::{Raster, constants::*},
};

const OLD: usize = 300;

fn geometry(random: &mut Random) -> Vec<f32> {
    let plane = |random: &mut Random, low, high| -> Vec<f32> {
        (0..OLD).map(|_| random.range(low, high) as f32).collect()
    };
    (0..GEOMETRY_PLANES)
        .flat_map(|index| match index {
            PLANE_LOG_SCALE..PLANE_OPACITY => plane(random, -6.0, 0.0),
            _ => plane(random, -2.0, 2.0),
        })
        .collect()
}

/// Survivors with gaps, halves; 600 rows are three workgroups.
fn plan(random: &mut Random) -> Vec<Descent> {
    (0..600)
        .map(|j| Descent {
            source: (j * 7 % OLD) as u32,
            survives: u32::from(j % 3 == 0),
            offset: random.array::<3>(-2.0, 2.0).map(|v| v as f32),
            log_growth: random.array::<3>(-1.0, 0.5).map(|v| v as f32),
            logit_step: random.range(-2.0, 2.0) as f32,
            ..Descent::default()
        })
        .collect()
}

fn applied(
    gpu: &Gpu,
    kernel: &Kernel,
    plan: &[Descent],
    source: &[f32],
) -> Result<Vec<f32>, GpuError> {
    let plan = Buffer::from_slice(gpu, "plan", plan)?;
    let source = Buffer::from_slice(gpu, "source", source)?;
    apply(gpu, kernel, &plan, OLD, &source)?.read(gpu)
}

/// Geometry by one row of the plan, in `f64`.
fn descendant(old: &[f32], descent: &Descent) -> Vec<f64> {
    let i = descent.source as usize;
    let mut new: Vec<f64> = (0..GEOMETRY_PLANES)
        .map(|plane| f64::from(old[plane * OLD + i]))
        .collect();
    if descent.survives == 0 {
        let quat: [f64; 4] = std::array::from_fn(|k| new[PLANE_QUAT + k]);
        let norm = quat.iter().map(|q| q * q).sum::<f64>().sqrt();
        let offset: [f64; 3] = std::array::from_fn(|axis| {
            new[PLANE_LOG_SCALE + axis].exp() * f64::from(descent.offset[axis])
        });
        new[PLANE_OPACITY] += f64::from(descent.logit_step);
        let moved = linear::apply(&rotation(quat.map(|q| q / norm)), &offset);
        for axis in 0..3 {
            new[PLANE_MEAN + axis] += moved[axis];
            new[PLANE_LOG_SCALE + axis] += f64::from(descent.log_growth[axis]);
        }
    }
    new
}

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let allowed = Allowance::of(&raster.gpu);
    let mut random = Random::new(1);
    let (old, plan) = (geometry(&mut random), plan(&mut random));
    let kernels = DensifyKernels::new(&raster.gpu);
    let new = applied(&raster.gpu, &kernels.geometry, &plan, &old)?;
    let count = plan.len();
    let (mut copied, mut split) = ((Vec::new(), Vec::new()), (Vec::new(), Vec::new()));
    for (j, descent) in plan.iter().enumerate() {
        let side = if descent.survives == 0 {
            &mut split
        } else {
            &mut copied
        };
        side.0
            .extend((0..GEOMETRY_PLANES).map(|plane| new[plane * count + j]));
        side.1.extend(descendant(&old, descent));
    }
    let (mut fields, mut moments) = (Vec::new(), Vec::new());
    for planes in [1, 4, 16] {
        let old: Vec<f32> = (0..planes * OLD)
            .map(|_| random.range(-1.0, 1.0) as f32)
            .collect();
        let expected = |keeps: fn(&Descent) -> bool| -> Vec<f64> {
            (0..planes)
                .flat_map(|plane| plan.iter().map(move |descent| (plane, descent)))
                .map(|(plane, descent)| match keeps(descent) {
                    true => f64::from(old[plane * OLD + descent.source as usize]),
                    false => 0.0,
                })
                .collect()
        };
        let moved = |kernel| Ok(widen(&applied(&raster.gpu, kernel, &plan, &old)?));
        fields.push(Sample::new(moved(&kernels.sh)?, expected(|_| true)));
        // Newcomers have none.
        let kept = expected(|descent| descent.survives == 1);
        moments.push(Sample::new(moved(&kernels.moments)?, kept));
    }
    let sample = |(actual, expected): (Vec<f32>, Vec<f64>)| [Sample::new(widen(&actual), expected)];
    Ok(vec![
        Row::exact("densify_geometry", "copies", &sample(copied)),
        allowed.values(
            "densify_geometry",
            "halves of splits",
            [3.82e-7, 1.0],
            &sample(split),
        ),
        Row::exact("densify_sh", "copies", &fields),
        Row::exact("densify_moments", "kept and dropped", &moments),
    ])
}
