//! Viewers' drawing, and the adjoint that fits scenes to them: `project` and `blend` by PlayCanvas'
//! falloff; `blend_backward`, `sum_instances`, `shade_backward` and `project_backward` of RGB, by
//! either falloff.

use std::sync::Arc;

use super::{blend::bounds, gradient::upstream};
use crate::{
    doctor::{
        measured::{Allowance, Groups, Row, Sample, add},
        stage::{Gradient, splats},
    },
    gpu::{GpuError, Recorder},
    oracle::{
        gradient::gradient,
        numerics::{Falloff, Numerics},
        scene::Scene,
        shade::Shading,
        view::View,
    },
    raster::{
        self, AdamStep, Layer, Lists, Model, Raster, RasterOptions, RgbAdjoint, RgbAdjointKernels,
        ViewUniform, constants::*,
    },
    splats::sh,
};

/// Adam's share of a gradient in the first moment of a first step.
const SHARE: f64 = 0.1;

/// The scenes as PlayCanvas' engine would draw them.
fn clipped<const C: usize>(scenes: Vec<(Scene<f64, C>, View)>) -> Vec<(Scene<f64, C>, View)> {
    let clip = |(scene, view): (Scene<f64, C>, View)| {
        let numerics = Numerics {
            falloff: Falloff::PlayCanvas,
            ..view.numerics
        };
        (scene, View { numerics, ..view })
    };
    scenes.into_iter().map(clip).collect()
}

/// A scene without a channel that is black: black ones have a rule of their own, which the
/// adjoint on frozen geometry is measured by.
fn bright(mut scene: Scene<f64, 3>) -> Scene<f64, 3> {
    let harmonics = scene.sh.len() / scene.len();
    for constant in scene.sh.iter_mut().step_by(harmonics) {
        *constant = constant.map(|value| f64::from((value.abs() + 4.0) as f32));
    }
    scene
}

/// The gradient, as a first step of Adam that goes nowhere leaves it in its first moments.
fn gradient_of(
    raster: &Arc<Raster>,
    scene: &Scene<f64, 3>,
    view: &View,
    upstream: &[[f64; 3]],
) -> Result<Gradient, GpuError> {
    let falloff = match view.numerics.falloff {
        Falloff::Gaussian => raster::Falloff::Gaussian,
        Falloff::PlayCanvas => raster::Falloff::PlayCanvas,
    };
    let raster = raster.drawing(RasterOptions {
        antialiased: false,
        falloff,
    });
    let gpu = &raster.gpu;
    let splats = splats(scene);
    let model = Model::upload(gpu, &splats)?;
    let (geometry, field) = (&model.geometry, &model.field);
    let degree = splats.sh.degree;
    let camera = crate::doctor::stage::camera(view);
    let uniform = ViewUniform::new(&camera, view.near, splats.len(), degree);
    let (pixels, tiles) = (uniform.pixel_count(), uniform.tile_count());
    let lists = Lists::new(&raster, geometry, tiles, splats.len() * tiles)?;
    let layer = Layer::new(&raster, geometry, &lists, field, pixels, tiles)?;
    let planes = [GEOMETRY_PLANES, 3 * sh::coefficient_count(degree)];
    let steps = [
        AdamStep::new(gpu, planes[0], splats.len())?,
        AdamStep::new(gpu, planes[1], splats.len())?,
    ];
    for step in &steps {
        step.set(gpu, 1, &[]);
    }
    let kernels = RgbAdjointKernels::new(&raster);
    let stepping = [
        steps[0].of(&model.geometry_moments),
        steps[1].of(&model.field_moments),
    ];
    let trained = (geometry, field);
    let adjoint = RgbAdjoint::new(&raster, &kernels, stepping, trained, &lists, &layer)?;
    let narrow = |[r, g, b]: &[f64; 3]| [*r as f32, *g as f32, *b as f32, 0.0];
    let upstream: Vec<f32> = upstream.iter().flat_map(narrow).collect();
    adjoint.image_gradient.write(gpu, &upstream);
    let mut recorder = Recorder::new(gpu);
    lists.set_view(gpu, &uniform);
    lists.record(&raster, &mut recorder);
    layer.record(&raster, &mut recorder);
    adjoint.record(&kernels, &mut recorder);
    recorder.submit();
    Ok(Gradient::of_planes(
        splats.len(),
        model.geometry_moments.first.read(gpu)?,
        model.field_moments.first.read(gpu)?,
    ))
}

/// Samples by group of parameters.
fn gradients(raster: &Arc<Raster>, scenes: Vec<(Scene<f64, 3>, View)>) -> Result<Groups, GpuError> {
    let mut groups = Groups::new();
    for (seed, (scene, view)) in (0..).zip(scenes) {
        let scene = bright(scene);
        let upstream = upstream(seed, &scene, &view);
        let actual = gradient_of(raster, &scene, &view, &upstream)?.groups();
        let expected = gradient(&scene, &view, Shading::Offset, &upstream);
        for ((name, actual), expected) in actual.into_iter().zip(expected.groups()) {
            let actual = actual.iter().map(|value| value / SHARE).collect();
            add(&mut groups, name, [Sample::new(actual, expected.to_vec())]);
        }
    }
    Ok(groups)
}

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let allowed = Allowance::of(&raster.gpu);
    let mut rows = vec![Row::picture(
        "blend, PlayCanvas",
        "RGB, 0 to 1",
        bounds(allowed, 2.29e-6, 1.0),
        &super::blend::pictures::<3>(raster, clipped(super::blend::scenes()))?,
    )];
    // Colors are up to five times white here.
    let seen = [
        [3.26e-6, 4.03e-5],
        [7.59e-6, 3.18e-5],
        [2.22e-6, 1.35e-5],
        [2.20e-6, 4.86e-6],
        [2.51e-6, 2.51e-6],
    ];
    let scenes = || super::gradient::scenes::<3>(false);
    for (kernel, scenes) in [
        ("rgb training", scenes()),
        ("rgb training, PlayCanvas", clipped(scenes())),
    ] {
        rows.extend(allowed.groups(kernel, &seen, gradients(raster, scenes)?));
    }
    Ok(rows)
}
