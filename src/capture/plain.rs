//! Photos and models on the way to a capture: before all photos have a pose.

use std::path::Path;

use super::error::CaptureError;
use super::options::{LoadOptions, MaskUse, Normalize};
use super::photo::Photo;
use super::{colmap, decode, tone};

/// Decodes a photo as it is, without a mask.
///
/// # Errors
/// If it cannot be read or decoded.
pub(crate) fn plain_photo(path: &Path, normalize: Normalize) -> Result<Photo, CaptureError> {
    let picture = decode::decode(path, |_| Ok(()))?;
    let options = LoadOptions {
        normalize,
        ..LoadOptions::default()
    };
    Ok(tone::develop(picture, &options).into_photo(MaskUse::Ignore))
}

/// At most so many values of a photo, as shares of white, evenly spread over it.
///
/// # Errors
/// If it cannot be read or decoded.
pub(crate) fn plain_values(path: &Path, most: usize) -> Result<Vec<f32>, CaptureError> {
    let picture = decode::decode(path, |_| Ok(()))?;
    let white = picture.header.depth.white() as f32;
    let channel = LoadOptions::default().channel;
    let values = tone::sample(&picture, None, channel, most);
    Ok(values.into_iter().map(|value| value / white).collect())
}

/// Photos and points of a folder with one COLMAP model.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Piece {
    /// Names of the photos with a pose, sorted.
    pub photos: Vec<String>,
    /// Number of points.
    pub points: usize,
}

impl Piece {
    /// Reads the model in this very folder; none where there is no whole one.
    ///
    /// # Errors
    /// If a file of it is damaged.
    pub fn read(dir: &Path) -> Result<Option<Self>, CaptureError> {
        let Some(model) = colmap::read_in(dir)? else {
            return Ok(None);
        };
        let mut photos: Vec<_> = model.images.into_iter().map(|image| image.name).collect();
        photos.sort();
        Ok(Some(Self {
            photos,
            points: model.points.len(),
        }))
    }
}
