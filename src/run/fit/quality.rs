//! How good a gray scene is.

use std::sync::Arc;

use super::super::{RunError, scene::Scene, yardstick::Yardstick};
use crate::{
    capture::Exposure,
    raster::Raster,
    report::{LumaQuality, LumaView},
    splats::Splats,
};

/// Each held-out view of `scene`.
pub(super) fn measure_luma(
    raster: &Arc<Raster>,
    scene: &Scene,
    splats: &Splats,
    exposures: &[Exposure],
) -> Result<Vec<LumaView>, RunError> {
    let mut renderer = scene.renderer(raster, splats, &[&splats.sh])?;
    scene
        .split
        .test
        .iter()
        .map(|&i| (i, Yardstick::of(scene, exposures, i)))
        .filter(|(_, yardstick)| yardstick.measures())
        .map(|(i, yardstick)| {
            let picture = renderer.render(&scene.photos[i].1)?.remove(0);
            let shown = yardstick.luma_shown(&picture.pixels);
            Ok(LumaView {
                name: scene.capture.views[i].name.clone(),
                quality: yardstick.luma_quality(&shown),
            })
        })
        .collect()
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
