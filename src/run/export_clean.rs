//! `export --clean`: the scene without Gaussians that no training view needs.

use std::sync::Arc;

use super::{RunError, export_viewer::Cameras};
use crate::{
    capture::Camera,
    gpu::Gpu,
    measure::reported_psnr,
    raster::{Contributions, Raster, RasterOptions, SceneRenderer},
    splats::Splats,
    tell::{Event, Observer, Stage},
};

/// A Gaussian that fills less of every training view than this many pixels is removed. The change
/// is below the rounding of a PNG file; half a pixel is visible (docs/decisions/files.md).
const NEEDED: f32 = 0.1;

/// Number of removed Gaussians, and the effect on renders.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Cleaned {
    /// Removed Gaussians.
    pub dropped: usize,
    /// Mean PSNR in dB, at most 100, of the pictures without them against those with them,
    /// before the cameras that were held out, or without any before all.
    pub psnr: f64,
}

/// The Gaussians that a training view needs, in their order; the last `kept` stay in any case.
pub(super) fn cleaned(
    (splats, drawn, kept): (&Splats, RasterOptions, usize),
    before: &Cameras<'_>,
    observe: &mut Observer<'_>,
) -> Result<(Splats, Cleaned), RunError> {
    // As large as photos were trained on: what is small in less is not in them.
    let (train, test, extent) = before.open(usize::MAX, u32::MAX)?;
    observe(Event::begins(Stage::Device));
    let gpu = Gpu::open()?;
    let raster = Arc::new(Raster::with(&gpu, drawn));
    observe(Event::begins(Stage::Cleaning));
    let mut contributions = Contributions::new(&raster, splats, extent)?;
    let mut most = vec![0f32; splats.len()];
    for (done, camera) in train.iter().enumerate() {
        observe(Event::progress(Stage::Cleaning, done, train.len(), ""));
        let filled = contributions.of(camera)?;
        (most.iter_mut().zip(&filled)).for_each(|(most, &filled)| *most = most.max(filled));
    }
    let last = splats.len().saturating_sub(kept);
    let needed: Vec<usize> = (0..splats.len())
        .filter(|&i| i >= last || most[i] >= NEEDED)
        .collect();
    let clean = splats.chosen(&needed);
    let psnr = changed(&raster, [splats, &clean], &test, extent)?;
    let dropped = splats.len() - clean.len();
    Ok((clean, Cleaned { dropped, psnr }))
}

/// Mean PSNR of the second scene's pictures against the first's.
fn changed(
    raster: &Arc<Raster>,
    scenes: [&Splats; 2],
    cameras: &[Camera],
    extent: f64,
) -> Result<f64, RunError> {
    let [before, after] =
        scenes.map(|splats| SceneRenderer::of(raster, splats, &[&splats.sh], extent));
    let (mut before, mut after) = (before?, after?);
    let mut sum = 0.0;
    for camera in cameras {
        let [before, after] = [before.render(camera)?, after.render(camera)?]
            .map(|pictures| pictures.first().map(|p| p.shown()).unwrap_or_default());
        sum += reported_psnr(after.as_flattened(), before.as_flattened());
    }
    Ok(sum / cameras.len().max(1) as f64)
}
