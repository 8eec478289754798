//! `blend_backward`, `sum_instances`, `shade_backward`, `project_backward`:
//! gradients of every parameter against dual numbers.

use std::sync::LazyLock;

use gs_chroma::{
    doctor::MARGIN,
    raster::constants::{STAT_PULL, STAT_VIEWS},
};

use crate::{
    compare::widen,
    errors::{Row, Sample, assert_all, gradient_bounds, relative},
    harness::{Stage, splats},
    oracle::{
        gradient::{gradient, pulls},
        random::{Random, opaque_stack, random_scene_before, random_view},
        render::decision_margin,
        scene::{Scene, View},
        shade::Shading,
    },
};

/// The gradient of a picture: one random number a value, none where a pixel
/// stands close to a discontinuity.
fn upstream<const C: usize>(seed: u64, scene: &Scene<f64, C>, view: &View) -> Vec<[f64; C]> {
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
fn measure<const C: usize>(scenes: &[(Scene<f64, C>, View)]) -> Vec<(&'static str, Vec<Sample>)> {
    let mut groups: Vec<(&'static str, Vec<Sample>)> = Vec::new();
    for (seed, (scene, view)) in scenes.iter().enumerate() {
        let upstream = upstream(seed as u64, scene, view);
        let expected = gradient(scene, view, Shading::of_channels(C), &upstream);
        let actual = Stage::new(&splats(scene), view).backward(upstream.as_flattened());
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
    groups
}

/// Scenes of every degree before views of odd sizes, and opaque stacks.
fn scenes<const C: usize>() -> Vec<(Scene<f64, C>, View)> {
    let loose = (20..26).map(|seed| {
        let view = random_view(seed);
        let scene = random_scene_before(&view, seed, 60, seed as usize % 4);
        (scene, view)
    });
    loose
        .chain((30..32).map(|seed| opaque_stack(seed, 40, 3)))
        .collect()
}

pub static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| {
    let bounds = [
        gradient_bounds(3.16e-6, relative(1.52e-5, 1.0)),
        gradient_bounds(4.34e-6, relative(5.29e-6, 1.0)),
        gradient_bounds(1.44e-6, relative(2.69e-6, 1.0)),
        gradient_bounds(2.02e-6, relative(8.40e-7, 1.0)),
        gradient_bounds(1.97e-6, relative(1.98e-6, 1.0)),
        gradient_bounds(4.03e-7, relative(5.6e-6, 1.0)),
    ];
    let chroma = gradient_bounds(1.94e-6, relative(2.22e-6, 1.0));
    let mut rows = Vec::new();
    for ((name, samples), bounds) in measure::<1>(&scenes()).into_iter().zip(bounds) {
        rows.push(Row::gradient("luma adjoint", name, bounds, &samples));
    }
    for (name, samples) in measure::<2>(&scenes()) {
        rows.push(Row::gradient("chroma adjoint", name, chroma, &samples));
    }
    rows
});

#[test]
fn gradients_are_those_of_dual_numbers() {
    assert_eq!(ROWS.len(), 7);
    assert_all(&ROWS);
}

#[test]
fn invisible_gaussians_have_no_gradient_even_after_another_view() {
    let view = random_view(21);
    let scene = random_scene_before::<1>(&view, 21, 60, 2);
    let mut stage = Stage::new(&splats(&scene), &view);
    let upstream = vec![1.0; view.width * view.height];
    let seen = stage.backward(&upstream);
    assert!(seen.geometry.iter().any(|&g| g != 0.0));
    // Everything lies behind this camera.
    for row in &mut stage.view.rows {
        *row = row.map(|v| -v);
    }
    let unseen = stage.backward(&upstream);
    let zero = |values: &[f32]| values.iter().all(|&g| g == 0.0);
    assert!(zero(&unseen.geometry) && zero(&unseen.field));
    assert!(stage.image().iter().all(|&value| value == 0.0));
}

#[test]
fn statistics_follow_the_views_that_show_a_gaussian() {
    let view = random_view(22);
    let scene = random_scene_before::<1>(&view, 22, 60, 0);
    let stage = Stage::new(&splats(&scene), &view);
    let upstream = vec![1.0; view.width * view.height];
    let once = stage.backward(&upstream).statistics;
    let twice = stage.backward(&upstream).statistics;
    for (i, projected) in stage.projected().into_iter().enumerate() {
        let at = |values: &[f32], plane: usize| values[plane * scene.len() + i];
        let views = if projected.is_some() { 1.0 } else { 0.0 };
        assert_eq!(at(&once, STAT_VIEWS), views);
        assert_eq!(at(&twice, STAT_VIEWS), 2.0 * views);
        assert_eq!(at(&twice, STAT_PULL), 2.0 * at(&once, STAT_PULL));
    }
}
