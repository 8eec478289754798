//! `project`: which Gaussians are shown, where and how wide.

use std::sync::Arc;

use crate::{
    compare::widen,
    doctor::{
        measured::{Allowance, Row, Sample},
        stage::{Stage, splats},
    },
    gpu::GpuError,
    oracle::{
        random::{oblique_view, random_scene_before, random_view},
        view::View,
    },
    raster::Raster,
};

const SCENES: u64 = 8;

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let mut rows = measure(raster, "project", false, [2.99e-7, 6.17e-7])?;
    let name = "project, antialiased";
    rows.extend(measure(raster, name, true, [3.80e-7, 6.54e-7])?);
    Ok(rows)
}

/// `seen` are the worst errors of opacity and half extent.
fn measure(
    raster: &Arc<Raster>,
    name: &'static str,
    antialiased: bool,
    seen: [f64; 2],
) -> Result<Vec<Row>, GpuError> {
    let (mut shown, mut samples): (Vec<Sample>, [Vec<Sample>; 4]) = Default::default();
    for seed in 0..SCENES {
        let view = View {
            antialiased,
            ..if seed == 0 {
                oblique_view()
            } else {
                random_view(seed)
            }
        };
        let scene = random_scene_before::<1>(&view, seed, 300, 0);
        let stage = Stage::new(raster, &splats(&scene), &view)?;
        stage.forward()?;
        let mut actual: [Vec<f32>; 4] = Default::default();
        let mut expected: [Vec<f64>; 4] = Default::default();
        let (mut is_shown, mut must_be) = (Vec::new(), Vec::new());
        for (i, given) in stage.projected()?.into_iter().enumerate() {
            let wanted = scene.gaussian(i).project(&view);
            is_shown.push(f64::from(u8::from(given.is_some())));
            must_be.push(f64::from(u8::from(wanted.is_ok())));
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
        shown.push(Sample::new(is_shown, must_be));
        for (k, (actual, expected)) in actual.iter().zip(expected).enumerate() {
            samples[k].push(Sample::new(widen(actual), expected));
        }
    }
    let allowed = Allowance::of(&raster.gpu);
    let row = |k: usize, what, seen| allowed.values(name, what, seen, &samples[k]);
    Ok(vec![
        // Scenes keep clear of every culling decision.
        Row::exact(name, "shown or not", &shown),
        row(0, "mean2d, px", [9.06e-7, 10.0]),
        row(1, "conic, px⁻²", [6.69e-6, 0.01]),
        row(2, "opacity", [seen[0], 0.0]),
        row(3, "half extent, px", [seen[1], 0.0]),
    ])
}
