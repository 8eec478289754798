//! One broken Gaussian: the others' picture and gradients stay, bit for bit.

use gs_chroma::splats::Splats;

use crate::kernels::{
    compare::{relative_l2, widen},
    harness::{Gradient, Stage, bits, splats},
    oracle::{
        random::{Random, oblique_view, random_scene},
        scene::Scene,
        view::View,
    },
};

const COUNT: usize = 60;

/// Index of the broken Gaussian.
const AT: usize = 17;

/// Name of a defect, the defect, and the number of Gaussians counted as poisoned for it.
type Breakage = (&'static str, fn(&mut Splats), usize);

const GEOMETRY: [Breakage; 12] = [
    ("mean NaN", |s| s.means[AT][1] = f32::NAN, 1),
    ("mean infinite", |s| s.means[AT][0] = f32::INFINITY, 1),
    ("quaternion NaN", |s| s.quats[AT][3] = f32::NAN, 1),
    ("quaternion zero", |s| s.quats[AT] = [0.0; 4], 1),
    ("quaternion huge", |s| s.quats[AT] = [1e30; 4], 1),
    ("scale NaN", |s| s.log_scales[AT][2] = f32::NAN, 1),
    ("scale overflows", |s| s.log_scales[AT] = [100.0; 3], 1),
    ("one scale overflows", |s| s.log_scales[AT][0] = 89.0, 1),
    ("covariance overflows", |s| s.log_scales[AT] = [50.0; 3], 0),
    ("determinant overflows", |s| s.log_scales[AT] = [35.0; 3], 0),
    ("opacity NaN", |s| s.opacity_logits[AT] = f32::NAN, 1),
    (
        "opacity infinite",
        |s| s.opacity_logits[AT] = f32::INFINITY,
        1,
    ),
];

const FIELD: [Breakage; 3] = [
    ("constant NaN", |s| s.sh.coefficients[AT * 4] = f32::NAN, 1),
    (
        "slope infinite",
        |s| s.sh.coefficients[AT * 4 + 2] = f32::INFINITY,
        1,
    ),
    ("last NaN", |s| s.sh.coefficients[AT * 4 + 3] = f32::NAN, 1),
];

/// Draws and differentiates; gives what came out, checked to be finite.
fn run(splats: &Splats, view: &View) -> (Stage, Gradient) {
    let stage = Stage::new(splats, view);
    let mut random = Random::new(9);
    let upstream: Vec<f64> = (0..view.width * view.height)
        .map(|_| random.range(-1.0, 1.0))
        .collect();
    let gradient = stage.backward(&upstream);
    let all = [
        &stage.image(),
        &gradient.geometry,
        &gradient.statistics,
        &gradient.field,
    ];
    assert!(
        all.iter()
            .all(|values| values.iter().all(|v| v.is_finite()))
    );
    (stage, gradient)
}

/// A scene, its view, and the same scene without the Gaussian at [`AT`].
fn scenes() -> (Splats, View, Splats) {
    let (mut scene, _) = random_scene::<1>(7, COUNT, 1);
    let view = oblique_view();
    // In front, in the middle: what is wrong with it would be seen everywhere.
    let center = view.center();
    scene.means[AT] = std::array::from_fn(|k| f64::from((center[k] + view.rotation[2][k]) as f32));
    let others = (0..COUNT).filter(|&i| i != AT).map(|i| scene.gaussian(i));
    (splats(&scene), view.clone(), splats(&Scene::of(1, others)))
}

#[test]
fn broken_geometry_leaves_no_trace() {
    let (whole, view, without) = scenes();
    let (stage, gradient) = run(&without, &view);
    let (picture, gradient) = (bits(&stage.image()), gradient.bits_without(None));
    assert_ne!(bits(&run(&whole, &view).0.image()), picture);
    for (name, harm, poisoned) in GEOMETRY {
        let mut splats = whole.clone();
        harm(&mut splats);
        let (stage, broken) = run(&splats, &view);
        assert_eq!(stage.status().poisoned, poisoned, "{name}");
        assert!(
            bits(&stage.image()) == picture,
            "{name}: the picture changed"
        );
        assert!(
            broken.bits_without(Some(AT)) == gradient,
            "{name}: gradients changed"
        );
        assert!(
            own(&broken).all(|v| v == 0.0),
            "{name}: a gradient of its own"
        );
    }
}

/// The broken Gaussian keeps its places in the tile lists, which moves the
/// order in which an adjoint's 32 shares are added: rounding may differ.
#[test]
fn broken_colors_leave_no_trace_but_rounding() {
    let (whole, view, without) = scenes();
    let (stage, gradient) = run(&without, &view);
    let picture = bits(&stage.image());
    for (name, harm, poisoned) in FIELD {
        let mut splats = whole.clone();
        harm(&mut splats);
        let (stage, broken) = run(&splats, &view);
        assert_eq!(stage.status().poisoned, poisoned, "{name}");
        assert!(
            bits(&stage.image()) == picture,
            "{name}: the picture changed"
        );
        assert!(
            own(&broken).all(|v| v == 0.0),
            "{name}: a gradient of its own"
        );
        let values = |gradient: &Gradient, index| {
            let bits = gradient.bits_without(index);
            widen(&bits.into_iter().map(f32::from_bits).collect::<Vec<f32>>())
        };
        let figure = relative_l2(&values(&broken, Some(AT)), &values(&gradient, None), 1e-6);
        figure
            .check()
            .unwrap_or_else(|error| panic!("{name}: {error}"));
    }
}

/// Gradients and statistics of the Gaussian at [`AT`].
fn own(gradient: &Gradient) -> impl Iterator<Item = f32> {
    let planes = [&gradient.geometry, &gradient.statistics, &gradient.field];
    (planes.into_iter()).flat_map(|planes| planes.iter().skip(AT).step_by(COUNT).copied())
}

#[test]
fn poison_adds_up_over_views_until_the_reset() {
    let (mut splats, view, _) = scenes();
    splats.means[AT][0] = f32::NAN;
    splats.quats[AT + 1] = [0.0; 4];
    let stage = Stage::new(&splats, &view);
    stage.forward();
    stage.forward();
    assert_eq!(stage.status().poisoned, 4);
    stage.lists.reset_status(crate::kernels::harness::gpu());
    assert_eq!(stage.status().poisoned, 0);
}
