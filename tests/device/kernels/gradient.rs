//! Gradients and statistics accumulated over several views.

use gs_chroma::{
    low_level::doctor::stage,
    raster::{
        RasterNumerics,
        constants::{STAT_PULL, STAT_VIEWS},
    },
};

use crate::kernels::{
    harness::{Stage, raster, splats},
    oracle::{
        gradient::{pulls, signed_pulls},
        random::{Random, random_scene_before, random_view},
        render::decision_margin,
        shade::Shading,
    },
};

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

/// What 3DGS's densification asks: the length of a center's gradient in normalized device
/// coordinates, in which pixels that pull apart cancel.
#[test]
fn signed_pulls_are_those_of_the_oracle() {
    let signed = raster().computing(RasterNumerics {
        signed_pulls: true,
        ..RasterNumerics::DEFAULT
    });
    for seed in 20..24 {
        let view = random_view(seed);
        let scene = random_scene_before::<1>(&view, seed, 60, 1);
        let mut random = Random::new(seed);
        let upstream: Vec<[f64; 1]> = (decision_margin(&scene, &view).into_iter())
            .map(|margin| [random.range(-1.0, 1.0) * f64::from(u8::from(margin > 1e-3))])
            .collect();
        let of = |pulls: fn(&_, &_, _, &[_]) -> Vec<f64>| {
            pulls(&scene, &view, Shading::Offset, &upstream)
        };
        let (expected, absolute) = (of(signed_pulls), of(pulls));
        let stage = stage::Stage::new(&signed, &splats(&scene), &view).unwrap();
        let found = stage.backward(upstream.as_flattened()).unwrap().statistics;
        let largest = expected.iter().copied().fold(0.0, f64::max);
        assert!(largest > 0.0);
        for (i, expected) in expected.into_iter().enumerate() {
            let found = f64::from(found[STAT_PULL * scene.len() + i]);
            assert!(
                (found - expected).abs() < 1e-4 * largest,
                "{found} {expected}"
            );
            assert!(expected <= absolute[i] * (1.0 + 1e-9));
        }
    }
}
