//! How good a gray scene is.

use std::sync::Arc;

use super::super::{
    RunError,
    scene::{Scene, counted, counts, gray_pixels},
};
use crate::{
    capture::{Exposure, Photo},
    measure,
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
        // A photo of which nothing counts says nothing.
        .filter(|&&i| (0..scene.photos[i].0.gray.len()).any(|p| counts(&scene.photos[i].0, p)))
        .map(|&i| {
            let (photo, camera) = &scene.photos[i];
            let picture = renderer.render(camera)?.remove(0);
            let shown: Vec<f32> = (picture.pixels.iter())
                .map(|&luma| exposures[i].shown(f64::from(luma)) as f32)
                .collect();
            let truth = gray_pixels(photo);
            Ok(LumaView {
                name: scene.capture.views[i].name.clone(),
                quality: luma_quality(photo, &shown, &truth),
            })
        })
        .collect()
}

/// Quality of the pixels that count.
pub(super) fn luma_quality(photo: &Photo, shown: &[f32], truth: &[f32]) -> LumaQuality {
    let (width, height) = (photo.width as usize, photo.height as usize);
    let psnr = measure::reported_psnr(&counted(photo, shown), &counted(photo, truth));
    // Where a pixel does not count the picture is taken to be right, and the others
    // answer for all that is wrong.
    let pixels = 0..truth.len();
    let patched: Vec<f32> = pixels
        .map(|p| if counts(photo, p) { shown[p] } else { truth[p] })
        .collect();
    let share = counted(photo, truth).len() as f64 / truth.len() as f64;
    LumaQuality {
        psnr,
        ssim: 1.0 - (1.0 - measure::ssim(width, height, &patched, truth)) / share,
    }
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
