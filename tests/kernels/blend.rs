//! `shade` and `blend`: pictures of luma, chroma and RGB.

use std::sync::LazyLock;

use gs_chroma::doctor::MARGIN;

use crate::{
    compare::{FlipBounds, widen},
    errors::{Row, Sample, assert_all, relative},
    harness::{Stage, splats},
    oracle::{
        constants::ALPHA_MIN,
        random::{opaque_stack, random_scene_before, random_view},
        render::render_pixels,
        scene::{Scene, View},
        shade::Shading,
    },
};

/// Scenes of every degree before views of odd sizes, and opaque stacks.
fn scenes<const C: usize>() -> Vec<(Scene<f64, C>, View)> {
    let loose = (0..4).map(|seed| {
        let view = random_view(seed);
        let scene = random_scene_before(&view, seed, 150, seed as usize);
        (scene, view)
    });
    loose
        .chain((8..10).map(|seed| opaque_stack(seed, 60, 1)))
        .collect()
}

fn pictures<const C: usize>() -> Vec<Sample> {
    let pictures = scenes::<C>().into_iter().map(|(scene, view)| {
        let actual = Stage::new(&splats(&scene), &view).forward();
        let pixels = render_pixels(&scene, &view, Shading::of_channels(C));
        Sample {
            actual: widen(&actual),
            expected: pixels.iter().flat_map(|p| p.colour).collect(),
            may_flip: (pixels.iter())
                .flat_map(|p| [p.margin < MARGIN; C])
                .collect(),
        }
    });
    pictures.collect()
}

/// `worst` is the largest error seen per unit of colour, `brightest` the largest colour.
fn bounds(worst: f64, brightest: f64) -> FlipBounds {
    FlipBounds {
        rest: relative(worst, brightest),
        // What a contribution at the floor of alpha shows, or of transmittance.
        jump: relative(ALPHA_MIN, brightest),
        cap: 0.01,
    }
}

pub static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| {
    vec![
        Row::picture(
            "blend",
            "luma, 0 to 1",
            bounds(1.27e-6, 1.0),
            &pictures::<1>(),
        ),
        Row::picture(
            "blend",
            "chroma, Lab units",
            bounds(1.09e-6, 80.0),
            &pictures::<2>(),
        ),
        Row::picture(
            "blend",
            "RGB, 0 to 1",
            bounds(1.34e-6, 1.0),
            &pictures::<3>(),
        ),
    ]
});

#[test]
fn pictures_are_those_of_the_oracle() {
    assert_all(&ROWS);
}

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
