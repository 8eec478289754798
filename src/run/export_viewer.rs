//! `export --viewer`: the scene fitted to the viewer that will draw it.

use std::{path::Path, sync::Arc};

use glam::DVec3;

use super::RunError;
use crate::{
    capture::{Camera, LoadOptions, Loader, split},
    gpu::Gpu,
    raster::{Raster, RasterOptions},
    splats::Splats,
    subject::Opened,
    tell::{Event, Observer, Stage},
    viewers::{self, FitSettings, Viewer, ViewerChoice},
};

/// Cameras that a scene is fitted before, and those that it is measured before, at most: an
/// even choice.
const MOST_CAMERAS: usize = 64;

/// Longer side of a view in pixels where photos are not shrunk to less: a fit takes as long as
/// it has pixels, and what it finds holds at other sizes.
const MOST_SIDE: u32 = 640;

/// Agreement of a viewer with `gs-chroma render`: mean PSNR in dB over the held-out cameras, or
/// over all if none is held out.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ViewerCameras {
    /// The viewer.
    pub viewer: Viewer,
    /// PSNR of the scene as in the run.
    pub before: f64,
    /// PSNR of the written scene.
    pub after: f64,
}

/// The cameras of a scene.
pub(super) struct Cameras<'a> {
    pub opened: &'a Opened,
    /// COLMAP folder, where it is not the one that `fit` noted.
    pub colmap: Option<&'a Path>,
    /// Offset from the scene's centers to COLMAP's, in world units.
    pub moved: DVec3,
}

/// A scene and how it is drawn here, moved until the viewers draw it alike; and what each
/// shows.
pub(super) fn fitted(
    choice: ViewerChoice,
    (splats, drawn): (&Splats, RasterOptions),
    before: &Cameras<'_>,
    observe: &mut Observer<'_>,
) -> Result<(Splats, Vec<ViewerCameras>), RunError> {
    let (train, test, extent) = before.open(MOST_CAMERAS, MOST_SIDE)?;
    observe(Event::begins(Stage::Device));
    let gpu = Gpu::open()?;
    let raster = Arc::new(Raster::new(&gpu));
    observe(Event::begins(Stage::Viewer));
    let colored = viewers::in_rgb(splats);
    let wanted = viewers::pictures(&raster, &colored, drawn, &train, extent)?;
    let fitted = viewers::fit(
        &raster,
        choice.viewers(),
        &viewers::start(choice.viewers(), &colored),
        (&train, &wanted),
        extent,
        &FitSettings::DEFAULT,
        &mut |done, total| {
            observe(Event::progress(Stage::Viewer, done, total, ""));
        },
    )?;
    let wanted = viewers::pictures(&raster, &colored, drawn, &test, extent)?;
    let shown = Viewer::ALL.map(|viewer| {
        let psnr = |splats| viewers::shown_psnr(&raster, viewer, splats, &wanted, &test, extent);
        Ok(ViewerCameras {
            viewer,
            before: psnr(&colored)?,
            after: psnr(&fitted)?,
        })
    });
    let shown: Result<_, RunError> = shown.into_iter().collect();
    Ok((fitted, shown?))
}

impl Cameras<'_> {
    /// Cameras of training views and those to measure before, at most so many of each and so
    /// large, and the capture's extent in world units.
    pub(super) fn open(
        &self,
        most: usize,
        most_side: u32,
    ) -> Result<(Vec<Camera>, Vec<Camera>, f64), RunError> {
        let capture = self.opened.capture(self.colmap)?;
        let load = self.opened.load();
        let chosen = split(&capture.views, load.holdout);
        let loader = Loader::new(LoadOptions {
            max_side: Some(load.max_side.unwrap_or(most_side).min(most_side)),
            ..load
        });
        let shift = self.moved - capture.offset;
        let cameras = |views: &[usize]| -> Result<Vec<Camera>, RunError> {
            let each = views.iter().step_by(views.len().div_ceil(most).max(1));
            each.map(|&view| {
                let mut camera = loader.camera(&capture.views[view])?;
                camera.translation += camera.rotation * shift;
                Ok(camera)
            })
            .collect()
        };
        let train = cameras(&chosen.train)?;
        let test = match chosen.test.is_empty() {
            true => train.clone(),
            false => cameras(&chosen.test)?,
        };
        Ok((train, test, capture.extent()))
    }
}
