//! COLMAP's sparse models, as binary files and as text.
//!
//! Format: <https://colmap.github.io/format.html>. Where there are rigs and frames, poses are
//! composed of them.

mod binary;
mod model;
mod records;
mod rigs;
mod text;
mod tracks;

use std::path::{Path, PathBuf};

use super::{Chosen, error::CaptureError};
use model::IMAGE;
pub(super) use model::{Camera, Image, Model, lens as checked_lens, relative_name};
use records::RecordSource;

/// Finds the model of a COLMAP folder and reads it: `sparse/0`, then `sparse`, the folder itself
/// and `colmap/sparse/0`; `.bin` before `.txt`. Of images that were not chosen nothing is
/// kept, nor of points that only these show.
pub(super) fn read(root: &Path, chosen: Option<&Chosen>) -> Result<Model, CaptureError> {
    let (paths, extension) = find(root)?;
    read_files(paths, extension, chosen)
}

/// Reads the model in this very folder; none where there is no whole one.
#[cfg(feature = "cli")]
pub(super) fn read_in(dir: &Path) -> Result<Option<Model>, CaptureError> {
    match files_in(dir) {
        Ok((paths, extension)) => read_files(paths, extension, None).map(Some),
        Err(_) => Ok(None),
    }
}

/// The folder of the model that [`read`] reads.
pub(super) fn folder(root: &Path) -> Result<PathBuf, CaptureError> {
    let ([cameras, ..], _) = find(root)?;
    Ok(cameras.parent().unwrap_or(root).into())
}

/// Number of images with a pose in the model of this very folder; `None` if there is no whole model
/// or its file cannot be read.
pub(super) fn images_in(dir: &Path) -> Option<u64> {
    let ([_, images, _], extension) = files_in(dir).ok()?;
    match extension {
        "bin" => binary::count_images(&images),
        _ => text::count_images(&images).ok(),
    }
}

/// The three files of a model, and their extension.
type Files = ([PathBuf; 3], &'static str);

fn find(root: &Path) -> Result<Files, CaptureError> {
    let mut incomplete = None;
    let places = ["sparse/0", "sparse", "", "colmap/sparse/0"];
    for dir in places.map(|place| root.join(place)) {
        match files_in(&dir) {
            Ok(files) => return Ok(files),
            Err(error) => incomplete = incomplete.or(error),
        }
    }
    Err(incomplete.unwrap_or_else(|| CaptureError::NoModel { dir: root.into() }))
}

/// The model's files in this very folder, or what is wrong where only some of them are there.
fn files_in(dir: &Path) -> Result<Files, Option<CaptureError>> {
    let mut incomplete = None;
    for extension in ["bin", "txt"] {
        let paths =
            ["cameras", "images", "points3D"].map(|stem| dir.join(stem).with_extension(extension));
        let (present, missing): (Vec<_>, Vec<_>) = paths.iter().partition(|path| path.is_file());
        match (present.first(), missing.first()) {
            (_, None) => return Ok((paths, extension)),
            (Some(present), Some(missing)) if incomplete.is_none() => {
                incomplete = Some(CaptureError::IncompleteModel {
                    dir: dir.into(),
                    present: file_name(present),
                    missing: file_name(missing),
                });
            }
            _ => {}
        }
    }
    Err(incomplete)
}

fn read_files(
    paths: [PathBuf; 3],
    extension: &str,
    chosen: Option<&Chosen>,
) -> Result<Model, CaptureError> {
    match extension {
        "bin" => read_records(binary::Records::open, paths, chosen),
        _ => read_records(text::Lines::open, paths, chosen),
    }
}

fn read_records<S: RecordSource>(
    open: impl Fn(&Path, &'static str) -> Result<S, CaptureError>,
    [cameras_path, images_path, points_path]: [PathBuf; 3],
    chosen: Option<&Chosen>,
) -> Result<Model, CaptureError> {
    let rigs = rigs_beside(&images_path)?;
    let cameras = records::cameras(open(&cameras_path, "camera")?)?;
    let images = open(&images_path, IMAGE)?;
    let (mut images, sightings) = records::images(images, &cameras, chosen)?;
    let points = records::points(open(&points_path, "point")?, &sightings)?;
    let doubts = match rigs {
        Some([rigs, frames]) => {
            let poses = rigs::read(open(&rigs, "rig")?, open(&frames, "frame")?)?;
            rigs::place(&mut images, &poses)
        }
        None => Vec::new(),
    };
    let folder = images_path.parent().unwrap_or(&images_path).display();
    let doubts = doubts
        .iter()
        .map(|doubt| format!("{folder}: {doubt}"))
        .collect();
    Ok(Model {
        cameras: cameras.cameras,
        images,
        points,
        doubts,
        cameras_path,
        images_path,
        points_path,
    })
}

/// The files of rigs and frames beside the images file; none where there are none.
fn rigs_beside(images: &Path) -> Result<Option<[PathBuf; 2]>, CaptureError> {
    let extension = images.extension().unwrap_or_default();
    let paths =
        ["rigs", "frames"].map(|stem| images.with_file_name(stem).with_extension(extension));
    let incomplete = |there: &Path, not: &Path| {
        Err(CaptureError::IncompleteRigs {
            path: there.into(),
            missing: file_name(not),
        })
    };
    match paths.each_ref().map(|path| path.exists()) {
        [true, true] => Ok(Some(paths)),
        [false, false] => Ok(None),
        [true, false] => incomplete(&paths[0], &paths[1]),
        [false, true] => incomplete(&paths[1], &paths[0]),
    }
}

/// The last part of a path.
pub(super) fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned()
}
