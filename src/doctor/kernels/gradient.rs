//! `blend_backward`, `sum_instances`, `shade_backward`, `project_backward`:
//! gradients of every parameter against dual numbers.

use std::sync::Arc;

use crate::{
    compare::widen,
    doctor::{
        MARGIN,
        measured::{Allowance, Row, Sample},
        stage::{Stage, splats},
    },
    gpu::{Buffer, GpuError, Recorder},
    oracle::{
        gradient::{gradient, pulls},
        random::{Random, opaque_stack, random_scene_before, random_view},
        render::decision_margin,
        scene::{Scene, View},
        shade::Shading,
    },
    raster::{Field, Geometry, LayerAdjoint, Outcome, Raster},
};

/// The gradient of a picture: one random number a value, none where a pixel
/// stands close to a discontinuity.
pub(super) fn upstream<const C: usize>(
    seed: u64,
    scene: &Scene<f64, C>,
    view: &View,
) -> Vec<[f64; C]> {
    let mut random = Random::new(seed);
    (decision_margin(scene, view).into_iter())
        .map(|margin| {
            let value = random.array(-1.0, 1.0);
            if margin < MARGIN { [0.0; C] } else { value }
        })
        .collect()
}

fn oracle_groups<const C: usize>(gradient: &Scene<f64, C>) -> Vec<Vec<f64>> {
    let geometry = [
        gradient.means.as_flattened().to_vec(),
        gradient.quats.as_flattened().to_vec(),
        gradient.log_scales.as_flattened().to_vec(),
        gradient.opacity_logits.clone(),
    ];
    let sh = gradient.sh.as_flattened().to_vec();
    let geometry = geometry.into_iter().filter(|_| C != 2);
    geometry.chain([sh]).collect()
}

/// Samples by group of parameters.
pub(super) fn measure<const C: usize>(
    raster: &Arc<Raster>,
    scenes: &[(Scene<f64, C>, View)],
) -> Result<Vec<(&'static str, Vec<Sample>)>, GpuError> {
    let mut groups: Vec<(&'static str, Vec<Sample>)> = Vec::new();
    for (seed, (scene, view)) in scenes.iter().enumerate() {
        let upstream = upstream(seed as u64, scene, view);
        let expected = gradient(scene, view, Shading::of_channels(C), &upstream);
        let stage = Stage::new(raster, &splats(scene), view)?;
        let actual = stage.backward(upstream.as_flattened())?;
        let mut rows = actual.groups();
        let mut expected = oracle_groups(&expected);
        if C == 1 {
            rows.push(("pull", widen(&actual.statistics[..scene.len()])));
            expected.push(pulls(scene, view, Shading::of_channels(C), &upstream));
        }
        let pairs = rows.into_iter().zip(expected);
        for (k, ((name, actual), expected)) in pairs.enumerate() {
            if groups.len() <= k {
                groups.push((name, Vec::new()));
            }
            groups[k].1.push(Sample::new(actual, expected));
        }
    }
    Ok(groups)
}

/// The adjoint that adds, against the plain one and what was there.
fn added(raster: &Arc<Raster>, scenes: &[(Scene<f64, 2>, View)]) -> Result<Vec<Sample>, GpuError> {
    let gpu = &raster.gpu;
    (scenes.iter().enumerate())
        .map(|(seed, (scene, view))| {
            let (splats, upstream) = (splats(scene), upstream(seed as u64, scene, view));
            let stage = Stage::new(raster, &splats, view)?;
            let once = stage.backward(upstream.as_flattened())?.field;
            // Not the gradient itself: what nobody sees keeps what was there.
            let before: Vec<f32> = once.iter().map(|slope| 3.0 - 0.5 * slope).collect();
            let geometry = Geometry::upload(gpu, &splats)?;
            let field = Field::upload(gpu, &splats.sh)?;
            let sum = Buffer::from_slice(gpu, "sum", &before)?;
            let outcome = Outcome::Sum(&sum);
            let Stage { lists, layer, .. } = &stage;
            let adjoint = LayerAdjoint::new(raster, &geometry, lists, &field, layer, &outcome)?;
            let upstream: Vec<f32> = (upstream.as_flattened().iter())
                .map(|&v| v as f32)
                .collect();
            adjoint.image_gradient.write(gpu, &upstream);
            let mut recorder = Recorder::new(gpu);
            adjoint.record(raster, &mut recorder);
            recorder.submit();
            let pairs = before.iter().zip(&once);
            let expected = pairs.map(|(&b, &o)| f64::from(b) + f64::from(o)).collect();
            Ok(Sample::new(widen(&sum.read(gpu)?), expected))
        })
        .collect()
}

/// Scenes of every degree before views of odd sizes, and opaque stacks.
pub(super) fn scenes<const C: usize>(antialiased: bool) -> Vec<(Scene<f64, C>, View)> {
    let loose = (20..26).map(|seed| {
        let view = View {
            antialiased,
            ..random_view(seed)
        };
        let scene = random_scene_before(&view, seed, 60, seed as usize % 4);
        (scene, view)
    });
    loose
        .chain((30..32).map(|seed| {
            let (scene, view) = opaque_stack(seed, 40, 3);
            let view = View {
                antialiased,
                ..view
            };
            (scene, view)
        }))
        .collect()
}

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let allowed = Allowance::of(&raster.gpu);
    let bounds_of = |l2, worst| allowed.gradient(l2, allowed.relative(worst, 1.0));
    let bounds = |opacity| {
        [
            bounds_of(3.16e-6, 1.52e-5),
            bounds_of(4.34e-6, 5.29e-6),
            bounds_of(1.44e-6, 2.69e-6),
            bounds_of(opacity, 8.40e-7),
            bounds_of(1.97e-6, 1.98e-6),
            bounds_of(4.03e-7, 5.6e-6),
        ]
    };
    let chroma = bounds_of(1.94e-6, 2.22e-6);
    let mut rows = Vec::new();
    for (kernel, antialiased, opacity) in [
        ("luma adjoint", false, 2.02e-6),
        ("luma adjoint, antialiased", true, 3.21e-6),
    ] {
        let groups = measure::<1>(raster, &scenes(antialiased))?;
        for ((name, samples), bounds) in groups.into_iter().zip(bounds(opacity)) {
            rows.push(Row::gradient(kernel, name, bounds, &samples));
        }
    }
    for (name, samples) in measure::<2>(raster, &scenes(false))? {
        rows.push(Row::gradient("chroma adjoint", name, chroma, &samples));
    }
    rows.push(Row::elementwise(
        "chroma adjoint",
        "sh, added to what is there",
        allowed.relative(4.36e-8, 1.0),
        &added(raster, &scenes(false))?,
    ));
    Ok(rows)
}
