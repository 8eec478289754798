//! `blend_backward`, `sum_instances`, `shade_backward`, `project_backward`:
//! gradients of every parameter against dual numbers.

use std::sync::Arc;

use crate::{
    compare::widen,
    doctor::{
        MARGIN,
        measured::{Allowance, Groups, Row, Sample, add, by_quantity},
        stage::{Stage, splats},
    },
    gpu::GpuError,
    oracle::{
        gradient::{gradient, pulls},
        random::{Random, opaque_stack, random_scene_before, random_view},
        render::decision_margin,
        scene::Scene,
        shade::{Shading, unclamped},
        view::View,
    },
    raster::Raster,
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

/// The gradient of a luma picture.
pub(super) fn of_luma(scene: &Scene<f64, 1>, view: &View, upstream: &[[f64; 1]]) -> Scene<f64, 1> {
    gradient(scene, view, Shading::Offset, upstream)
}

/// Samples by group of parameters; `expect` gives the gradient of a picture.
pub(super) fn measure<const C: usize>(
    raster: &Arc<Raster>,
    scenes: &[(Scene<f64, C>, View)],
    expect: impl Fn(&Scene<f64, C>, &View, &[[f64; C]]) -> Scene<f64, C>,
) -> Result<Groups, GpuError> {
    let mut groups = Groups::new();
    for (seed, (scene, view)) in scenes.iter().enumerate() {
        let upstream = upstream(seed as u64, scene, view);
        let expected = expect(scene, view, &upstream);
        let stage = Stage::new(raster, &splats(scene), view)?;
        let actual = stage.backward(upstream.as_flattened())?;
        // Of color the harmonics alone.
        let expected = &expected.groups()[if C == 1 { 0 } else { 4 }..];
        for ((name, actual), expected) in actual.groups().into_iter().zip(expected) {
            add(&mut groups, name, [Sample::new(actual, expected.to_vec())]);
        }
        if C == 1 {
            let actual = widen(&actual.statistics[..scene.len()]);
            let expected = pulls(scene, view, Shading::of_channels(C), &upstream);
            add(&mut groups, "pull", [Sample::new(actual, expected)]);
        }
    }
    Ok(groups)
}

/// The adjoint on frozen geometry: the sums of the curvatures against the oracle, the
/// gradient added to what was there against the plain one.
fn frozen<const C: usize>(
    raster: &Arc<Raster>,
    scenes: &[(Scene<f64, C>, View)],
) -> Result<[Vec<Sample>; 2], GpuError> {
    by_quantity(scenes.iter().enumerate().map(|(seed, (scene, view))| {
        let upstream = upstream(seed as u64, scene, view);
        let stage = Stage::new(raster, &splats(scene), view)?;
        let once = stage.backward(upstream.as_flattened())?;
        // Curvatures pass black and white alike.
        let plain = gradient(scene, view, Shading::Plain, &upstream);
        let harmonics = scene.sh.len() / scene.len();
        let expected = (0..4 - C).flat_map(|c| (0..scene.len()).map(move |i| (c, i)));
        let expected = expected.map(|(c, i)| plain.sh[i * harmonics][c]).collect();
        let diagonal = Sample::new(widen(&once.diagonal), expected);
        // Not the gradient itself: what nobody sees keeps what was there.
        let before: Vec<f32> = once.field.iter().map(|slope| 3.0 - 0.5 * slope).collect();
        let sum = stage.backward_onto(upstream.as_flattened(), &before)?.field;
        let pairs = before.iter().zip(&once.field);
        let expected = pairs.map(|(&b, &o)| f64::from(b) + f64::from(o)).collect();
        Ok([diagonal, Sample::new(widen(&sum), expected)])
    }))
}

/// Result of the RGB adjoint: the plain gradient, but for channels that are black and would become
/// darker.
fn brightening(scene: &Scene<f64, 3>, view: &View, plain: Scene<f64, 3>) -> Scene<f64, 3> {
    let mut gradient = plain;
    let harmonics = scene.sh.len() / scene.len();
    for i in 0..scene.len() {
        let own = i * harmonics..(i + 1) * harmonics;
        let shown = unclamped(
            &scene.means[i],
            &scene.sh[own.clone()],
            view,
            Shading::Offset,
        );
        for c in 0..3 {
            if shown[c] <= 0.0 && gradient.sh[own.start][c] >= 0.0 {
                gradient.sh[own.clone()]
                    .iter_mut()
                    .for_each(|sh| sh[c] = 0.0);
            }
        }
    }
    gradient
}

/// Scenes of every degree before views of odd sizes, and opaque stacks.
pub(super) fn scenes<const C: usize>(antialiased: bool) -> Vec<(Scene<f64, C>, View)> {
    let loose = (20..26).map(|seed| {
        let view = random_view(seed);
        (
            random_scene_before(&view, seed, 60, seed as usize % 4),
            view,
        )
    });
    loose
        .chain((30..32).map(|seed| opaque_stack(seed, 40, 3)))
        .map(|(scene, view)| {
            (
                scene,
                View {
                    antialiased,
                    ..view
                },
            )
        })
        .collect()
}

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let allowed = Allowance::of(&raster.gpu);
    let mut rows = Vec::new();
    for (kernel, antialiased, opacity) in [
        ("luma adjoint", false, 2.03e-6),
        ("luma adjoint, antialiased", true, 3.21e-6),
    ] {
        let seen = [
            [3.16e-6, 1.52e-5],
            [4.34e-6, 5.29e-6],
            [1.44e-6, 2.69e-6],
            [opacity, 8.40e-7],
            [1.97e-6, 1.98e-6],
            [4.03e-7, 5.6e-6],
        ];
        let groups = measure(raster, &scenes(antialiased), of_luma)?;
        rows.extend(allowed.groups(kernel, &seen, groups));
    }
    let of_chroma = measure::<2>(raster, &scenes(false), |scene, view, upstream| {
        gradient(scene, view, Shading::Plain, upstream)
    })?;
    let of_rgb = measure::<3>(raster, &scenes(false), |scene, view, upstream| {
        brightening(scene, view, gradient(scene, view, Shading::Plain, upstream))
    })?;
    let frozen_chroma = frozen::<2>(raster, &scenes(false))?;
    let frozen_rgb = frozen::<3>(raster, &scenes(false))?;
    for (kernel, seen, groups, [diagonals, added]) in [
        (
            "chroma adjoint",
            [1.94e-6, 2.22e-6],
            of_chroma,
            frozen_chroma,
        ),
        ("rgb adjoint", [2.99e-6, 2.53e-6], of_rgb, frozen_rgb),
    ] {
        let curvatures = ("sums of curvatures", diagonals);
        let groups = groups.into_iter().chain([curvatures]);
        rows.extend(allowed.groups(kernel, &[seen; 2], groups));
        let what = "sh, added to what is there";
        rows.push(allowed.values(kernel, what, [4.66e-8, 1.0], &added));
    }
    Ok(rows)
}
