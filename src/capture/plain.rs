//! Photos and models on the way to a capture: before all photos have a pose.

use std::path::Path;

use super::error::CaptureError;
use super::loader::percentiles;
use super::options::{LoadOptions, MaskUse, Normalize};
use super::orientation::Stance;
use super::photo::Photo;
use super::sample::Depth;
use super::{colmap, decode, mask, tone};

/// What a photo's header says.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct PlainHeader {
    /// Width and height in pixels.
    pub size: [u32; 2],
    /// Whether it has more than 8 bits a channel.
    pub deep: bool,
    /// The value of white.
    pub white: f64,
}

/// Reads the header of a photo.
///
/// # Errors
/// If it cannot be read, or is of a format that no capture may have.
pub(crate) fn plain_header(path: &Path) -> Result<PlainHeader, CaptureError> {
    let header = decode::header(path)?;
    Ok(PlainHeader {
        size: header.size,
        deep: header.depth > Depth::Eight,
        white: header.depth.white(),
    })
}

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

/// What black and white would be if these values were all photos', in their unit; none where
/// they are all one.
pub(crate) fn plain_range(mut values: Vec<f32>) -> Option<[f64; 2]> {
    percentiles(&mut values)
}

/// A mask for a photo of this size: what each pixel counts, `[height, width]`.
///
/// # Errors
/// If it cannot be read, or has another shape than the photo.
pub(crate) fn plain_mask(
    path: &Path,
    photo: &Path,
    size: [u32; 2],
) -> Result<Vec<u8>, CaptureError> {
    mask::read(path, photo, size, Stance::default())
}

/// What a folder with one model of COLMAP's places.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Piece {
    /// Names of the photos with a pose, sorted.
    pub photos: Vec<String>,
    /// How many points there are.
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
