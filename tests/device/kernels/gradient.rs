//! Gradients and statistics accumulated over several views.

use gs_chroma::raster::constants::{STAT_PULL, STAT_VIEWS};

use crate::kernels::{
    harness::{Stage, splats},
    oracle::random::{random_scene_before, random_view},
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
