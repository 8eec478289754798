//! `shade_backward` and `project_backward` with Adam's step: the same as Adam on the
//! gradient that they leave without it.

use std::sync::Arc;

use crate::{
    compare::{narrow, widen},
    doctor::{
        measured::{Allowance, Row, Sample},
        stage::{Stage, splats},
    },
    gpu::{Buffer, GpuError, Recorder},
    oracle::{
        adam::{Moments, adam},
        random::{Random, random_scene_before, random_view},
        view::View,
    },
    raster::{
        AdamMoments, AdamStep, AdamSteps, Field, Geometry, Layer, Lists, LumaAdjoint, Model,
        Outcome, Raster, RasterNumerics, RasterOptions,
    },
    splats::Splats,
};

/// The step, which the corrections of the moments depend on.
const STEP: u32 = 3;

/// Rate of plane `plane`.
fn rate(plane: usize) -> f32 {
    1e-2 * 1.1_f32.powi(plane as i32)
}

/// Planes after a step: values, first and second moments.
type Planes = [Vec<f32>; 3];

/// Geometry and field after a fused step from these moments.
fn stepped(
    raster: &Arc<Raster>,
    splats: &Splats,
    stage: &Stage,
    upstream: &[f32],
    moments: &[[Vec<f32>; 2]; 2],
) -> Result<[Planes; 2], GpuError> {
    let gpu = &raster.gpu;
    let (pixels, tiles) = (stage.view.pixel_count(), stage.view.tile_count());
    let mut model = Model::upload(gpu, splats)?;
    let step = |to: &mut AdamMoments, [first, second]: &[Vec<f32>; 2]| {
        to.first.write(gpu, first);
        to.second.write(gpu, second);
        let planes = first.len() / splats.len();
        let step = AdamStep::holding(gpu, planes, splats.len(), HELD)?;
        let rates: Vec<f32> = (0..planes).map(rate).collect();
        step.set(gpu, STEP, &rates);
        Ok::<_, GpuError>(step)
    };
    let geometry_step = step(&mut model.geometry_moments, &moments[0])?;
    let field_step = step(&mut model.field_moments, &moments[1])?;
    let (geometry, field) = (&model.geometry, &model.field);
    let lists = Lists::new(raster, geometry, tiles, splats.len() * tiles)?;
    let layer = Layer::new(raster, geometry, &lists, field, pixels, tiles)?;
    let outcome = Outcome::Step {
        geometry: geometry_step.of(&model.geometry_moments),
        field: field_step.of(&model.field_moments),
    };
    let adjoint = LumaAdjoint::new(raster, geometry, &lists, field, &layer, &outcome)?;
    adjoint.image_gradient.write(gpu, upstream);
    let mut recorder = Recorder::new(gpu);
    lists.set_view(gpu, &stage.view);
    lists.record(raster, &mut recorder);
    layer.record(raster, &mut recorder);
    adjoint.record(raster, &mut recorder);
    recorder.submit();
    let planes = |values: &Buffer<f32>, moments: &AdamMoments| {
        Ok::<_, GpuError>([
            values.read(gpu)?,
            moments.first.read(gpu)?,
            moments.second.read(gpu)?,
        ])
    };
    Ok([
        planes(&geometry.planes, &model.geometry_moments)?,
        planes(&field.planes, &model.field_moments)?,
    ])
}

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let antialiased = raster.drawing(RasterOptions {
        antialiased: true,
        ..RasterOptions::default()
    });
    let lazily = |raster: &Arc<Raster>| {
        raster.computing(RasterNumerics {
            adam: AdamSteps::Lazy,
            ..raster.numerics()
        })
    };
    let (lazy, antialiased_lazy) = (lazily(raster), lazily(&antialiased));
    // Shading is the same, antialiased or not.
    let mut rows = measure(raster, &["project_backward", "shade_backward"])?;
    rows.extend(measure(&antialiased, &["project_backward, antialiased"])?);
    rows.extend(measure(
        &lazy,
        &["project_backward, lazy", "shade_backward, lazy"],
    )?);
    rows.extend(measure(
        &antialiased_lazy,
        &["project_backward, antialiased, lazy"],
    )?);
    Ok(rows)
}

/// Gaussians, and how many of them, the last, are held.
const COUNT: usize = 300;
const HELD: usize = 30;

/// Results of an optimizer step.
const QUANTITIES: [&str; 3] = ["value after a step", "first moment", "second moment"];

fn measure(raster: &Arc<Raster>, kernels: &[&'static str]) -> Result<Vec<Row>, GpuError> {
    let (gpu, allowed) = (&raster.gpu, Allowance::of(&raster.gpu));
    let mut samples: [[Vec<Sample>; 3]; 2] = Default::default();
    for seed in 40..43 {
        let view = View {
            antialiased: raster.options().antialiased,
            ..random_view(seed)
        };
        let scene = random_scene_before::<1>(&view, seed, COUNT, seed as usize % 4);
        let splats = splats(&scene);
        let stage = Stage::new(raster, &splats, &view)?;
        let mut random = Random::new(seed);
        let upstream: Vec<f64> = (0..view.width * view.height)
            .map(|_| random.range(-1.0, 1.0))
            .collect();
        let gradient = stage.backward(&upstream)?;
        let lazy = raster.numerics().adam == AdamSteps::Lazy;
        let mut still: Vec<bool> = (stage.projected()?.iter())
            .map(|projected| lazy && projected.is_none())
            .collect();
        assert!(!lazy || still.contains(&true), "everything is in view");
        still[COUNT - HELD..].fill(true);
        let starts = [
            Geometry::upload(gpu, &splats)?.planes.read(gpu)?,
            Field::upload(gpu, &splats.sh)?.planes.read(gpu)?,
        ];
        let gradients = [&gradient.geometry, &gradient.field];
        // Moments of the size of a plane's largest gradient, to a power of two: how a device rounds
        // must not change what it is asked.
        let moments = gradients.map(|gradient| {
            let sizes = gradient.chunks_exact(COUNT).flat_map(|plane| {
                let largest = plane.iter().fold(1e-3, |most: f32, g| most.max(g.abs()));
                [largest.log2().round().exp2(); COUNT]
            });
            let sizes: Vec<f32> = sizes.collect();
            let mut some = |size: &f32| random.range(0.5, 2.0) as f32 * size;
            [
                sizes.iter().map(&mut some).collect::<Vec<f32>>(),
                sizes.iter().map(|size| some(size).powi(2)).collect(),
            ]
        });
        let actual = stepped(raster, &splats, &stage, &narrow(&upstream), &moments)?;
        for (which, actual) in actual.iter().enumerate() {
            let mut expected: [Vec<f64>; 3] = Default::default();
            for at in 0..starts[which].len() {
                let mut value = f64::from(starts[which][at]);
                let mut moment = Moments {
                    first: f64::from(moments[which][0][at]),
                    second: f64::from(moments[which][1][at]),
                };
                let slope = f64::from(gradients[which][at]);
                let rate = f64::from(rate(at / splats.len()));
                if !still[at % splats.len()] {
                    adam(&mut value, &mut moment, slope, rate, STEP as i32);
                }
                expected[0].push(value);
                expected[1].push(moment.first);
                expected[2].push(moment.second);
            }
            for (k, expected) in expected.into_iter().enumerate() {
                samples[which][k].push(Sample::new(widen(&actual[k]), expected));
            }
        }
    }
    let seen = [[4.9e-8, 1.0], [6.0e-7, 1e-3], [5.4e-7, 1e-6]];
    let mut rows = Vec::new();
    for (kernel, samples) in kernels.iter().zip(&samples) {
        for ((what, seen), samples) in QUANTITIES.into_iter().zip(seen).zip(samples) {
            rows.push(allowed.values(kernel, what, seen, samples));
        }
    }
    Ok(rows)
}
