//! `project`: which Gaussians are shown, where and how wide.

use std::sync::LazyLock;

use crate::{
    compare::widen,
    errors::{Row, Sample, assert_all, relative},
    harness::{Stage, splats},
    oracle::random::{oblique_view, random_scene_before, random_view},
};

const SCENES: u64 = 8;

pub static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| {
    let mut samples: [Vec<Sample>; 4] = Default::default();
    for seed in 0..SCENES {
        let view = if seed == 0 {
            oblique_view()
        } else {
            random_view(seed)
        };
        let scene = random_scene_before::<1>(&view, seed, 300, 0);
        let stage = Stage::new(&splats(&scene), &view);
        stage.forward();
        let mut actual: [Vec<f32>; 4] = Default::default();
        let mut expected: [Vec<f64>; 4] = Default::default();
        for (i, given) in stage.projected().into_iter().enumerate() {
            let wanted = scene.gaussian(i).project(&view);
            // Scenes keep clear of every culling decision, so these agree.
            assert_eq!(given.is_some(), wanted.is_ok(), "seed {seed}, Gaussian {i}");
            let (Some(given), Ok(wanted)) = (given, wanted) else {
                continue;
            };
            let [a, b, c, opacity] = given.conic_opacity;
            actual[0].extend(given.mean);
            actual[1].extend([a, b, c]);
            actual[2].push(opacity);
            actual[3].extend(given.extent);
            expected[0].extend(wanted.mean2d);
            expected[1].extend(wanted.conic);
            expected[2].push(wanted.opacity);
            expected[3].extend(wanted.half_extent);
        }
        let shown = expected[2].len();
        assert_eq!(stage.status().visible, shown);
        assert_eq!(stage.status().poisoned, 0);
        assert!(shown > 100 && shown < 300, "{shown}: both kinds are needed");
        for (k, (actual, expected)) in actual.iter().zip(expected).enumerate() {
            samples[k].push(Sample::new(widen(actual), expected));
        }
    }
    let row = |k: usize, what, bound| Row::elementwise("project", what, bound, &samples[k]);
    vec![
        row(0, "mean2d, px", relative(9.06e-7, 10.0)),
        row(1, "conic, px⁻²", relative(6.69e-6, 0.01)),
        row(2, "opacity", relative(2.99e-7, 0.0)),
        row(3, "half extent, px", relative(6.17e-7, 0.0)),
    ]
});

#[test]
fn projection_is_that_of_the_oracle() {
    assert_all(&ROWS);
}
