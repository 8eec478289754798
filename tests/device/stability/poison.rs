//! Poison in any parameter of any Gaussian: no silent corruption.
//!
//! Values that are no numbers are culled and counted, and nobody else notices.
//! Numbers, however odd, are drawn as the oracle draws them or not at all.

use std::sync::{Arc, LazyLock};

use gs_chroma::{
    low_level::{
        doctor::{
            MARGIN,
            stage::{Gradient, Stage, splats},
        },
        oracle::{
            random::random_scene,
            render::{render_pixels, visible},
            scene::Scene,
            shade::Shading,
            view::View,
        },
    },
    raster::Raster,
    splats::Splats,
};
use proptest::prelude::*;

use crate::gpu;

const COUNT: usize = 30;
const DEGREE: usize = 1;
/// Parameters of one Gaussian: mean, quaternion, log-scales, logit, harmonics.
const PARAMETERS: usize = 11 + (DEGREE + 1) * (DEGREE + 1);

const POISON: [f32; 14] = [
    0.0,
    -0.0,
    1e-45,
    -1e-45,
    f32::MIN_POSITIVE,
    1e-38,
    -1e-38,
    1e38,
    -1e38,
    f32::MAX,
    f32::MIN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::NAN,
];

static RASTER: LazyLock<Arc<Raster>> = LazyLock::new(|| Arc::new(Raster::new(gpu())));
static SCENE: LazyLock<(Scene<f64, 1>, View)> = LazyLock::new(|| random_scene(3, COUNT, DEGREE));

/// The parameter's place in the arrays.
fn parameter(splats: &mut Splats, gaussian: usize, parameter: usize) -> &mut f32 {
    match parameter {
        0..3 => &mut splats.means[gaussian][parameter],
        3..7 => &mut splats.quats[gaussian][parameter - 3],
        7..10 => &mut splats.log_scales[gaussian][parameter - 7],
        10 => &mut splats.opacity_logits[gaussian],
        _ => &mut splats.sh.coefficients[gaussian * (PARAMETERS - 11) + parameter - 11],
    }
}

/// The picture, how many were poisoned, and the gradient of its mean.
fn run(splats: &Splats) -> (Vec<f32>, usize, Gradient) {
    let view = &SCENE.1;
    let stage = Stage::new(&RASTER, splats, view).unwrap();
    let gradient = stage
        .backward(&vec![1.0; view.width * view.height])
        .unwrap();
    let poisoned = stage.status().unwrap().poisoned;
    (stage.image().unwrap(), poisoned, gradient)
}

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|v| v.to_bits()).collect()
}

/// Returns true if the oracle, which has the range of `f64`, draws the same picture.
fn as_the_oracle_says(picture: &[f32], changed: &Splats) -> bool {
    let (scene, view) = &*SCENE;
    let mut wanted = scene.clone();
    let widen = |values: &[f32]| values.iter().map(|&v| f64::from(v)).collect::<Vec<_>>();
    wanted.means = changed.means.iter().map(|v| v.map(f64::from)).collect();
    wanted.quats = changed.quats.iter().map(|v| v.map(f64::from)).collect();
    wanted.log_scales = changed
        .log_scales
        .iter()
        .map(|v| v.map(f64::from))
        .collect();
    wanted.opacity_logits = widen(&changed.opacity_logits);
    wanted.sh = widen(&changed.sh.coefficients)
        .into_iter()
        .map(|v| [v])
        .collect();
    (render_pixels(&wanted, view, Shading::Offset)
        .iter()
        .zip(picture))
    .all(|(pixel, &actual)| {
        let [expected] = pixel.color;
        pixel.margin < MARGIN
            || (f64::from(actual) - expected).abs() <= 1e-4 * expected.abs().max(1.0)
    })
}

/// Returns true if a Gaussian of the healthy scene is in view.
fn seen(gaussian: usize) -> bool {
    let (scene, view) = &*SCENE;
    let list = visible(scene, view, Shading::Offset);
    list.iter().any(|visible| visible.index == gaussian)
}

/// Checks the effect of poison `value` in one place.
fn check(gaussian: usize, place: usize, value: f32) -> Result<(), TestCaseError> {
    let healthy = splats(&SCENE.0);
    let mut changed = healthy.clone();
    *parameter(&mut changed, gaussian, place) = value;
    // What is seen without it: the same arrays, so that shares add up in the same order.
    let mut without = healthy;
    without.opacity_logits[gaussian] = -1e3;

    let (picture, poisoned, gradient) = run(&changed);
    let (expected, _, others) = run(&without);
    let finite = |values: &[f32]| values.iter().all(|v| v.is_finite());
    prop_assert!(finite(&picture), "the picture is not finite");
    prop_assert!(
        finite(&gradient.geometry) && finite(&gradient.field),
        "a gradient is not finite"
    );
    let vanished = bits(&picture) == bits(&expected);
    if value.is_finite() {
        prop_assert!(
            vanished || as_the_oracle_says(&picture, &changed),
            "a wrong picture"
        );
        prop_assert!(poisoned == 0 || vanished, "poisoned, but seen");
    } else {
        // Harmonics of what no pixel shows are not even read.
        let idle = place >= 11 && !seen(gaussian);
        prop_assert_eq!(poisoned, usize::from(!idle));
        prop_assert!(vanished, "the picture changed");
        let same = place >= 11
            || gradient.bits_without(Some(gaussian)) == others.bits_without(Some(gaussian));
        prop_assert!(same, "others' gradients changed");
    }
    Ok(())
}

/// Every poison in every parameter of one Gaussian that is seen.
#[test]
fn every_poison_in_every_parameter() {
    let gaussian = 4;
    for place in 0..PARAMETERS {
        for value in POISON {
            check(gaussian, place, value)
                .unwrap_or_else(|reason| panic!("{value:e} in parameter {place}: {reason}"));
        }
    }
}

/// However long and thin: the covariance of such a one has no digits left in `f64`.
#[test]
fn needles_are_drawn() {
    for log_length in [4.0, 12.0, 18.0, 24.0, 40.0] {
        let mut changed = splats(&SCENE.0);
        *parameter(&mut changed, 0, 7) = log_length;
        let (picture, poisoned, _) = run(&changed);
        assert_eq!(poisoned, 0);
        assert!(as_the_oracle_says(&picture, &changed), "{log_length}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn poison_anywhere(
        gaussian in 0..COUNT,
        place in 0..PARAMETERS,
        value in prop_oneof![proptest::sample::select(POISON.to_vec()), proptest::num::f32::ANY],
    ) {
        check(gaussian, place, value)?;
    }
}
