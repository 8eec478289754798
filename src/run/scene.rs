//! What several commands need of a capture: its photos at working size, a
//! renderer for its splats.

use std::{path::Path, sync::Arc};

use glam::DVec3;

use super::{Event, Observer, RunError, Stage};
use crate::{
    capture::{CaptureError, Dataset, LoadOptions, Notice, Photo, Rejected},
    effects::{Evidence, Survey},
    gpu::GpuError,
    luma::TrialProgress,
    raster::{Field, Geometry, Raster, RasterOptions, Renderer, constants::NEAR_SHARE},
    splats::{ShField, Splats, ply},
};

/// Opens a COLMAP folder; nothing is decoded but what [`Dataset::open`] has to.
pub(super) fn open(
    colmap_dir: &Path,
    options: &LoadOptions,
    observe: &mut Observer<'_>,
) -> Result<Dataset, RunError> {
    Ok(Dataset::open(colmap_dir, options, &mut |notice| {
        observe(match notice {
            Notice::LeftOut(Rejected { name, reason }) => {
                Event::Note(format!("left out {name}: {reason}"))
            }
            Notice::Sampled { done, total, name } => Event::Progress {
                stage: Stage::Survey,
                done,
                total,
                message: name.to_owned(),
            },
            Notice::Normalized([low, high]) => Event::Note(format!(
                "photos are normalised: {low:.6} becomes black and {high:.6} white (--normalize off leaves them)"
            )),
        });
    })?)
}

/// Examines all photos, each decoded once.
pub(super) fn examine(dataset: &Dataset, observe: &mut Observer<'_>) -> Result<Evidence, RunError> {
    let mut survey = Survey::new(&dataset.capture, &dataset.cameras, &dataset.split);
    let all: Vec<usize> = (0..dataset.cameras.len()).collect();
    dataset.visit(&all, |view, photo| {
        survey.look(view, photo);
        observe(Event::Progress {
            stage: Stage::Photos,
            done: view,
            total: all.len(),
            message: dataset.capture.views[view].name.clone(),
        });
        Ok::<_, CaptureError>(())
    })?;
    tell_not_finite(dataset, observe);
    Ok(survey.finish())
}

/// Tells how far a trial is.
pub(super) fn tell_trial(progress: &TrialProgress, observe: &mut Observer<'_>) {
    let message = if progress.exposed {
        "with exposures"
    } else {
        "without"
    };
    observe(Event::Progress {
        stage: Stage::Trial,
        done: progress.done,
        total: progress.total,
        message: message.to_owned(),
    });
}

pub(super) fn tell_not_finite(dataset: &Dataset, observe: &mut Observer<'_>) {
    let count = dataset.not_finite();
    if count > 0 {
        observe(Event::Note(format!(
            "{count} pixels of the photos are not finite and do not count"
        )));
    }
}

/// A renderer of several fields over the geometry of `splats`.
pub(super) fn renderer(
    dataset: &Dataset,
    raster: &Arc<Raster>,
    splats: &Splats,
    fields: &[&ShField],
) -> Result<Renderer, GpuError> {
    let gpu = &raster.gpu;
    let fields = fields
        .iter()
        .map(|field| Field::upload(gpu, field))
        .collect::<Result<_, _>>()?;
    let geometry = Geometry::upload(gpu, splats)?;
    Renderer::new(
        raster.clone(),
        geometry,
        fields,
        NEAR_SHARE * dataset.extent,
    )
}

/// Reads a splat file that has at least one Gaussian and subtracts `offset`, in
/// world units, from its centres; also gives how the file wants to be drawn.
pub(super) fn read_splats(
    path: &Path,
    offset: DVec3,
    observe: &mut Observer<'_>,
) -> Result<(Splats, RasterOptions), RunError> {
    let read = ply::read_ply(path)?;
    if read.skipped > 0 {
        observe(Event::Note(format!(
            "{}: skipped {} Gaussians with values that are not finite or no rotation",
            path.display(),
            read.skipped
        )));
    }
    let mut splats = read.splats;
    if splats.is_empty() {
        return Err(RunError::NoSplats(path.to_owned()));
    }
    for mean in &mut splats.means {
        *mean = (DVec3::from(mean.map(f64::from)) - offset)
            .as_vec3()
            .to_array();
    }
    let options = RasterOptions {
        antialiased: read.antialiased,
    };
    Ok((splats, options))
}

/// Whether a pixel counts at least half.
pub(super) fn counts(photo: &Photo, pixel: usize) -> bool {
    photo.counts(pixel)
}

/// Gray pixels as floats in [0, 1].
pub(super) fn gray_pixels(photo: &Photo) -> Vec<f32> {
    photo.gray.iter().map(|&v| f32::from(v) / 255.0).collect()
}

/// The photo as RGB in [0, 1], gray where it has no colours.
pub(super) fn rgb_pixels(photo: &Photo) -> Vec<[f32; 3]> {
    match &photo.rgb {
        Some(rgb) => rgb
            .iter()
            .map(|c| c.map(|v| f32::from(v) / 255.0))
            .collect(),
        None => gray_pixels(photo).into_iter().map(|v| [v; 3]).collect(),
    }
}

/// A one-channel picture as RGB.
pub(super) fn gray_to_rgb(pixels: &[f32]) -> Vec<[f32; 3]> {
    pixels.iter().map(|&v| [v.clamp(0.0, 1.0); 3]).collect()
}

/// A three-channel picture as RGB in [0, 1].
pub(super) fn shown_rgb(pixels: &[f32]) -> Vec<[f32; 3]> {
    pixels
        .chunks_exact(3)
        .map(|c| [c[0], c[1], c[2]].map(|v| v.clamp(0.0, 1.0)))
        .collect()
}
