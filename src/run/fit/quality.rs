//! How good a gray scene is.

use std::sync::Arc;

use super::super::{RunError, scene::renderer, yardstick::Yardstick};
use crate::{
    capture::{Dataset, Exposure},
    raster::Raster,
    report::{LumaQuality, LumaView},
    splats::Splats,
};

/// Each held-out view of `dataset`.
pub(super) fn measure_luma(
    raster: &Arc<Raster>,
    dataset: &Dataset,
    splats: &Splats,
    exposures: &[Exposure],
) -> Result<Vec<LumaView>, RunError> {
    let mut renderer = renderer(dataset, raster, splats, &[&splats.sh])?;
    let mut views = Vec::new();
    dataset.visit(&dataset.split.test, |view, photo| {
        let yardstick = Yardstick {
            photo,
            exposure: exposures[view],
        };
        if yardstick.measures() {
            let picture = renderer.render(&dataset.cameras[view])?.remove(0);
            let shown = yardstick.luma_shown(&picture.pixels);
            views.push(LumaView {
                name: dataset.capture.views[view].name.clone(),
                quality: yardstick.luma_quality(&shown),
            });
        }
        Ok::<_, RunError>(())
    })?;
    Ok(views)
}

/// Their mean, if there are any.
pub(super) fn mean_quality(views: &[LumaView]) -> Option<LumaQuality> {
    let mean = |value: fn(&LumaQuality) -> f64| {
        views.iter().map(|view| value(&view.quality)).sum::<f64>() / views.len() as f64
    };
    (!views.is_empty()).then(|| LumaQuality {
        psnr: mean(|quality| quality.psnr),
        ssim: mean(|quality| quality.ssim),
    })
}
