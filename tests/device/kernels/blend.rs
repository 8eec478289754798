//! `shade`: harmonics of a lower degree than is stored.

use crate::kernels::{
    harness::{Stage, splats},
    oracle::{
        random::{random_scene_before, random_view},
        scene::Scene,
    },
};

#[test]
fn a_lower_degree_shows_the_lower_terms_only() {
    let view = random_view(5);
    let scene = random_scene_before::<1>(&view, 5, 80, 3);
    let mut stage = Stage::new(&splats(&scene), &view);
    stage.view.sh_degree = 1;
    let lower = (0..scene.len()).map(|i| {
        let mut gaussian = scene.gaussian(i);
        gaussian.sh.truncate(4);
        gaussian
    });
    let stored = Stage::new(&splats(&Scene::of(1, lower)), &view);
    assert_eq!(stage.forward(), stored.forward());
}
