//! `export --viewer`: the scene fitted to the viewer that will draw it.

use std::{path::Path, sync::Arc};

use super::{Event, Observer, RunError, Stage};
use crate::{
    capture::{Camera, Capture, Loader, split},
    gpu::Gpu,
    raster::{Raster, RasterOptions},
    report::Report,
    splats::Splats,
    viewers::{self, FitSettings, Viewer},
};

/// Cameras that a scene is fitted before, at most: an even choice.
const MOST_CAMERAS: usize = 64;

/// What a viewer shows of the scene, compared with `gs-chroma render`: mean PSNR in dB before
/// the cameras that were held out, or without any before all.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Shown {
    /// Which viewer.
    pub viewer: Viewer,
    /// Of the scene as it is in the run.
    pub before: f64,
    /// Of what was written.
    pub after: f64,
}

/// The scene of a run, moved until `viewers` draw it as it is drawn here, and what each shows.
///
/// # Errors
/// [`RunError`] of the capture or the device.
pub(super) fn fitted(
    viewers: &[Viewer],
    splats: &Splats,
    report: &Report,
    colmap: Option<&Path>,
    observe: &mut Observer<'_>,
) -> Result<(Splats, Vec<Shown>), RunError> {
    observe(Event::begins(Stage::Model));
    let colmap = colmap.unwrap_or(Path::new(&report.capture.path));
    let load = report.capture.load.clone();
    let capture = Capture::load_with(colmap, &load.capture())?;
    let chosen = split(&capture.views, load.holdout);
    let loader = Loader::new(load);
    let cameras = |views: &[usize]| -> Result<Vec<Camera>, RunError> {
        let each = views.iter().step_by(views.len().div_ceil(MOST_CAMERAS));
        each.map(|&view| Ok(loader.camera(&capture.views[view])?))
            .collect()
    };
    let train = cameras(&chosen.train)?;
    let test = match chosen.test.is_empty() {
        true => train.clone(),
        false => cameras(&chosen.test)?,
    };
    observe(Event::begins(Stage::Device));
    let gpu = Gpu::open()?;
    let raster = Arc::new(Raster::new(&gpu));
    let drawn = report.luma.settings.raster_options();
    let scene = Scene {
        raster: &raster,
        extent: capture.extent(),
        drawn,
    };
    observe(Event::begins(Stage::Viewer));
    let colored = viewers::in_rgb(splats);
    let wanted = scene.pictures(&colored, &train)?;
    let fitted = viewers::fit(
        &raster,
        viewers,
        &viewers::start(viewers, &colored),
        (&train, &wanted),
        scene.extent,
        &FitSettings::DEFAULT,
        &mut |done, total| {
            observe(Event::Progress {
                stage: Stage::Viewer,
                done,
                total,
                message: String::new(),
            });
        },
    )?;
    observe(Event::begins(Stage::Measuring));
    let wanted = scene.pictures(&colored, &test)?;
    let mut shown = Vec::new();
    for viewer in Viewer::ALL {
        let [before, after] = [&colored, &fitted].map(|splats| {
            viewers::shown_psnr(&raster, viewer, splats, &wanted, &test, scene.extent)
        });
        shown.push(Shown {
            viewer,
            before: before?,
            after: after?,
        });
    }
    Ok((fitted, shown))
}

/// How a run draws.
struct Scene<'a> {
    raster: &'a Arc<Raster>,
    extent: f64,
    drawn: RasterOptions,
}

impl Scene<'_> {
    fn pictures(&self, splats: &Splats, cameras: &[Camera]) -> Result<viewers::Pictures, RunError> {
        let extent = self.extent;
        Ok(viewers::pictures(
            self.raster,
            splats,
            self.drawn,
            cameras,
            extent,
        )?)
    }
}
