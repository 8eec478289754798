//! How good a gray scene is.

use std::sync::Arc;

use super::{EvalError, Observer, Progress, Reference, Task};
use crate::{
    capture::{Dataset, Exposure},
    raster::{Raster, Renderer},
    report::{LumaQuality, LumaView},
    splats::Splats,
};

/// Gray pictures of each held-out view of `dataset` against its photo, as that was exposed.
///
/// # Errors
/// [`EvalError`] of a photo or the device.
pub fn measure_luma(
    raster: &Arc<Raster>,
    dataset: &Dataset,
    splats: &Splats,
    exposures: &[Exposure],
    observe: &mut Observer<'_>,
) -> Result<Vec<LumaView>, EvalError> {
    let mut renderer = Renderer::of(raster, splats, &[&splats.sh], dataset.extent)?;
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
            exposure: exposures[view],
        };
        if reference.measures() {
            let picture = renderer.render(&dataset.cameras[view])?.remove(0);
            let shown = reference.luma_shown(&picture.pixels);
            views.push(LumaView {
                name: dataset.capture.views[view].name.clone(),
                quality: reference.luma_quality(&shown),
            });
        }
        Ok::<_, EvalError>(())
    })?;
    Ok(views)
}

/// Their mean, if there are any.
pub fn mean_quality(views: &[LumaView]) -> Option<LumaQuality> {
    let mean = |value: fn(&LumaQuality) -> f64| {
        views.iter().map(|view| value(&view.quality)).sum::<f64>() / views.len() as f64
    };
    (!views.is_empty()).then(|| LumaQuality {
        psnr: mean(|quality| quality.psnr),
        ssim: mean(|quality| quality.ssim),
    })
}
