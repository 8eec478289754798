//! Views of a capture, and the points seen in them.

use std::path::PathBuf;

use glam::DVec3;

use super::{
    camera::Camera, error::CaptureError, lens::Undistortion, orientation::SensorOrientation,
    photo::same_shape, sample::Header,
};

/// One photo, or one face of a photo that is too wide for one, with its camera.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    /// The photo's name; of a face `@` and the face's name before the extension:
    /// `left/0001@front.jpg`.
    pub name: String,
    /// The photo's path below `images/`, with `/` between folders.
    pub photo: String,
    /// The photo's file; it exists when the capture is loaded.
    pub image_path: PathBuf,
    /// The pinhole that shows the view, in the size of COLMAP's model; the file may
    /// differ, see [`Loader::load`](super::Loader::load).
    pub camera: Camera,
    /// Mapping from the photo to the view's image; none if the photo is the image.
    pub undistortion: Option<Undistortion>,
    /// Orientation of the photo; known once a [`Dataset`](super::Dataset) has read its header.
    pub stance: SensorOrientation,
}

impl View {
    /// Width and height of the photo in the size of COLMAP's model.
    pub fn photo_size(&self) -> [u32; 2] {
        match &self.undistortion {
            Some(Undistortion { lens, .. }) => [lens.width, lens.height],
            None => [self.camera.width, self.camera.height],
        }
    }
}

/// A point that COLMAP triangulated.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// World position; finite.
    pub position: DVec3,
    /// Encoded sRGB.
    pub color: [u8; 3],
    /// Observations in the order of the file; empty where the model was written without them.
    pub track: Vec<Observation>,
}

/// Observation of a point in a view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Observation {
    /// Index into [`Capture::views`](super::Capture::views).
    pub view: usize,
    /// x and y in pixels of the view's camera, at the size of COLMAP's model; finite.
    pub pixel: [f64; 2],
}

/// Orientation of a photo against the image that COLMAP saw, by the sides of the view's camera;
/// refuses a photo that cannot be that camera's.
pub(super) fn stance(view: &View, header: &Header) -> Result<SensorOrientation, CaptureError> {
    let (camera, photo) = (view.photo_size(), header.size);
    let turned = header.orientation.size(photo);
    // Nearly square photos have about the camera's shape either way.
    let is_turned = match (photo == camera, turned == camera) {
        (true, _) => false,
        (_, true) => true,
        _ => !same_shape(photo, camera),
    };
    if is_turned && !same_shape(turned, camera) {
        return Err(CaptureError::PhotoSize {
            path: view.image_path.clone(),
            photo,
            camera,
        });
    }
    Ok(SensorOrientation::new(header.orientation, is_turned))
}
