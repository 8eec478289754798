//! Quality of a gray scene.

use std::sync::Arc;

use super::{EvalError, Observer, Progress, Reference, Task};
use crate::{
    capture::{Dataset, Exposure},
    raster::{Raster, RasterOptions, SceneRenderer, plain},
    report::{LumaQuality, LumaView, Row, to_image},
    splats::Splats,
};

/// Gray pictures of each held-out view of `dataset`, as viewers show them, against its photo.
pub fn measure_luma(
    raster: &Arc<Raster>,
    dataset: &Dataset,
    splats: &Splats,
    observe: &mut Observer<'_>,
) -> Result<Vec<LumaView>, EvalError> {
    let extent = dataset.extent;
    let mut renderer = SceneRenderer::of(raster, splats, &[&splats.sh], extent)?;
    let viewer = raster.drawing(RasterOptions::default());
    let exported = raster.options().antialiased.then(|| {
        let cameras = dataset
            .split
            .train
            .iter()
            .map(|&view| &dataset.cameras[view]);
        plain(splats, cameras, extent)
    });
    let plainly = exported.as_ref();
    let plainly = plainly.map(|splats| SceneRenderer::of(&viewer, splats, &[&splats.sh], extent));
    let mut plainly = plainly.transpose()?;
    let (mut views, mut done) = (Vec::new(), 0);
    dataset.visit(&dataset.split.test, |view, photo| {
        observe(Progress {
            task: Task::Measure,
            done,
            total: dataset.split.test.len(),
            name: &dataset.capture.views[view].name,
        });
        done += 1;
        let reference = Reference {
            photo,
            exposure: Exposure::NONE,
        };
        if reference.measures() {
            let camera = &dataset.cameras[view];
            let mut quality_of = |renderer: &mut SceneRenderer| {
                let picture = renderer.render(camera)?.remove(0);
                Ok::<_, EvalError>(reference.luma_quality(&picture.pixels))
            };
            let plainly = plainly.as_mut().map(&mut quality_of).transpose()?;
            views.push(LumaView {
                name: dataset.capture.views[view].name.clone(),
                quality: LumaQuality {
                    plain_psnr: plainly.map(|quality| quality.psnr),
                    ..quality_of(&mut renderer)?
                },
            });
        }
        Ok::<_, EvalError>(())
    })?;
    Ok(views)
}

/// Columns of the contact sheet of a gray scene, left to right.
pub const GRAY_COLUMNS: [&str; 2] = ["photo", "gray scene"];

/// Views on it.
const SHEET_ROWS: usize = 4;

/// The rows of a contact sheet: some of the held-out views, or of all where none is held out, as
/// far apart as they are in the photos' order.
pub fn gray_rows(
    raster: &Arc<Raster>,
    dataset: &Dataset,
    splats: &Splats,
    exposures: &[Exposure],
) -> Result<Vec<Row>, EvalError> {
    let mut renderer = SceneRenderer::of(raster, splats, &[&splats.sh], dataset.extent)?;
    let (_, measured) = dataset.measured();
    let step = measured.len().div_ceil(SHEET_ROWS).max(1);
    let views: Vec<usize> = measured.iter().step_by(step).copied().collect();
    let mut rows = Vec::new();
    dataset.visit(&views, |view, photo| {
        let reference = Reference {
            photo,
            exposure: exposures[view],
        };
        let picture = renderer.render(&dataset.cameras[view])?.remove(0);
        let (width, height) = (photo.width, photo.height);
        let gray = |values: Vec<f32>| {
            let rgb: Vec<[f32; 3]> = values.into_iter().map(|value| [value; 3]).collect();
            Some(to_image(width, height, &rgb))
        };
        let name = &dataset.capture.views[view].name;
        let held_out = dataset.split.test.contains(&view);
        let row = Row {
            width,
            height,
            caption: format!("{name}{}", if held_out { " (held out)" } else { "" }),
            pictures: vec![
                gray(reference.gray()),
                gray(reference.luma_shown(&picture.pixels)),
            ],
        };
        rows.push(row.turned(dataset.capture.views[view].stance.upright));
        Ok::<_, EvalError>(())
    })?;
    Ok(rows)
}

/// Their mean, if there are any.
pub fn mean_quality(views: &[LumaView]) -> Option<LumaQuality> {
    let mean = |value: fn(&LumaQuality) -> f64| {
        views.iter().map(|view| value(&view.quality)).sum::<f64>() / views.len() as f64
    };
    let mean_of_known = |value: fn(&LumaQuality) -> Option<f64>| {
        let sum = (views.iter())
            .map(|view| value(&view.quality))
            .sum::<Option<f64>>();
        sum.map(|sum| sum / views.len() as f64)
    };
    (!views.is_empty()).then(|| LumaQuality {
        psnr: mean(|quality| quality.psnr),
        corrected_psnr: mean_of_known(|quality| quality.corrected_psnr),
        plain_psnr: mean_of_known(|quality| quality.plain_psnr),
        lost_detail: mean_of_known(|quality| quality.lost_detail),
        ssim: mean(|quality| quality.ssim),
    })
}
