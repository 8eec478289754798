//! Frames of the path that another program has made.

use std::path::{Path, PathBuf};

use super::EvalError;
use crate::{
    capture::{Camera, decode_image, names::by_number, photo_header, photos_in},
    input,
};

/// The pictures in a folder in the order of their numbers, one for each of the path's `cameras`.
///
/// # Errors
/// [`EvalError::OtherFrames`], and those of a file that cannot be read.
pub fn frames_in(folder: &Path, cameras: &[Camera]) -> Result<Vec<PathBuf>, EvalError> {
    let mut names = photos_in(folder);
    names.sort_by(|a, b| by_number(a, b));
    if names.len() != cameras.len() {
        let (found, wanted) = (names.len(), cameras.len());
        return Err(EvalError::OtherFrames {
            path: folder.to_owned(),
            reason: format!("holds {found} pictures; the path has {wanted} frames"),
        });
    }
    let files: Vec<PathBuf> = names.iter().map(|name| folder.join(name)).collect();
    for (file, camera) in files.iter().zip(cameras) {
        check_size(file, photo_header(file)?.size, camera)?;
    }
    Ok(files)
}

/// RGB in [0, 1] of a frame, `[height, width]`.
pub(super) fn read_frame(file: &Path, camera: &Camera) -> Result<Vec<[f32; 3]>, EvalError> {
    let bytes = input::read(file).map_err(|error| error.to_string());
    let decoded = bytes.and_then(decode_image);
    let image = decoded.map_err(|reason| EvalError::Frame {
        path: file.to_owned(),
        reason,
    })?;
    let image = image.image.into_rgb32f();
    check_size(file, [image.width(), image.height()], camera)?;
    Ok(image.pixels().map(|pixel| pixel.0).collect())
}

fn check_size(file: &Path, [x, y]: [u32; 2], camera: &Camera) -> Result<(), EvalError> {
    if [x, y] == [camera.width, camera.height] {
        return Ok(());
    }
    Err(EvalError::OtherFrames {
        path: file.to_owned(),
        reason: format!(
            "has {x}×{y} pixels; frames of the path have {}×{}",
            camera.width, camera.height
        ),
    })
}
