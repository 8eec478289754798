//! `shade` and `blend`: pictures of luma, chroma and RGB.

use std::sync::Arc;

use crate::{
    compare::{FlipBounds, widen},
    doctor::{
        MARGIN,
        measured::{Allowance, Row, Sample},
        stage::{Stage, splats},
    },
    gpu::{GpuError, Recorder},
    oracle::{
        constants::ALPHA_MIN,
        random::{opaque_stack, random_scene_before, random_view},
        render::{median_depths, render_pixels},
        scene::Scene,
        shade::Shading,
        view::View,
    },
    raster::{Raster, UNREACHED, blend_depth},
};

/// Scenes of every degree before views of odd sizes, and opaque stacks.
pub(super) fn scenes<const C: usize>() -> Vec<(Scene<f64, C>, View)> {
    let loose = (0..4).map(|seed| {
        let view = random_view(seed);
        let scene = random_scene_before(&view, seed, 150, seed as usize);
        (scene, view)
    });
    loose
        .chain((8..10).map(|seed| opaque_stack(seed, 60, 1)))
        .collect()
}

pub(super) fn pictures<const C: usize>(
    raster: &Arc<Raster>,
    scenes: Vec<(Scene<f64, C>, View)>,
) -> Result<Vec<Sample>, GpuError> {
    let pictures = scenes.into_iter().map(|(scene, view)| {
        let actual = Stage::new(raster, &splats(&scene), &view)?.forward()?;
        let pixels = render_pixels(&scene, &view, Shading::of_channels(C));
        Ok(Sample {
            actual: widen(&actual),
            expected: pixels.iter().flat_map(|p| p.color).collect(),
            may_flip: (pixels.iter())
                .flat_map(|p| [p.margin < MARGIN; C])
                .collect(),
        })
    });
    pictures.collect()
}

/// Median depths, zero where there is none.
fn depths(raster: &Arc<Raster>) -> Result<Vec<Sample>, GpuError> {
    let samples = scenes::<1>().into_iter().map(|(scene, view)| {
        let stage = Stage::new(raster, &splats(&scene), &view)?;
        stage.forward()?;
        let pixels = vec![UNREACHED; view.width * view.height];
        let tiles = stage.view.tile_count();
        let mut recorder = Recorder::new(&raster.gpu);
        let image = blend_depth(raster, &stage.lists, &pixels, tiles, &mut recorder)?;
        recorder.submit();
        let (expected, margins): (Vec<_>, Vec<_>) =
            median_depths(&scene, &view).into_iter().unzip();
        Ok(Sample {
            actual: (image.read(&raster.gpu)?)
                .iter()
                .map(|z| f64::from(*z).max(0.0))
                .collect(),
            expected: expected
                .into_iter()
                .map(Option::unwrap_or_default)
                .collect(),
            may_flip: margins.into_iter().map(|margin| margin < MARGIN).collect(),
        })
    });
    samples.collect()
}

/// `worst` is the largest error seen per unit of color, `brightest` the largest color.
pub(super) fn bounds(allowed: Allowance, worst: f64, brightest: f64) -> FlipBounds {
    FlipBounds {
        rest: allowed.relative(worst, brightest),
        // What a contribution at the floor of alpha shows, or of transmittance.
        jump: allowed.relative(ALPHA_MIN, brightest),
        cap: 0.01,
    }
}

pub(super) fn rows(raster: &Arc<Raster>) -> Result<Vec<Row>, GpuError> {
    let allowed = Allowance::of(&raster.gpu);
    let row = |what, worst, brightest, samples: &[Sample]| {
        Row::picture("blend", what, bounds(allowed, worst, brightest), samples)
    };
    Ok(vec![
        row(
            "luma, 0 to 1",
            1.27e-6,
            1.0,
            &pictures::<1>(raster, scenes())?,
        ),
        row(
            "chroma, Lab units",
            1.09e-6,
            80.0,
            &pictures::<2>(raster, scenes())?,
        ),
        row(
            "RGB, 0 to 1",
            1.34e-6,
            1.0,
            &pictures::<3>(raster, scenes())?,
        ),
        Row::picture(
            "blend",
            "median depth, world units",
            FlipBounds {
                rest: allowed.relative(1e-7, 6.0),
                // To any other Gaussian's.
                jump: allowed.relative(1.0, 6.0),
                cap: 0.01,
            },
            &depths(raster)?,
        ),
    ])
}
