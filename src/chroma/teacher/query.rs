//! Query of a teacher for a photo.

use super::images::{Filter, resample};
use crate::capture::{Camera, SensorOrientation, View, lens::Undistortion};

/// The photo that a teacher is asked about.
///
/// A network only sees pixels. A folder holds images of photos as the camera took
/// them; `original` says how the one asked about was made of such a photo.
#[derive(Clone, Copy)]
pub struct Query<'a> {
    /// The view's name: a path below the photo folder.
    pub name: &'a str,
    pub(super) original: Option<Original<'a>>,
    /// Orientation of the photo.
    pub(super) stance: SensorOrientation,
}

/// A photo of which a view is a resampled part.
#[derive(Clone, Copy)]
pub(super) struct Original<'a> {
    /// Its path below the photo folder.
    pub name: &'a str,
    undistortion: &'a Undistortion,
    /// The view's camera at the size of the picture asked about.
    camera: &'a Camera,
}

impl<'a> From<&'a str> for Query<'a> {
    fn from(name: &'a str) -> Self {
        Self::of(name, SensorOrientation::default())
    }
}

impl<'a> Query<'a> {
    /// A photo as its file has it, or as it was turned for COLMAP.
    pub fn of(name: &'a str, stance: SensorOrientation) -> Self {
        Self {
            name,
            original: None,
            stance,
        }
    }

    /// A view as `camera` shows it, which is the view's at working size.
    pub fn view(view: &'a View, camera: &'a Camera) -> Self {
        let original = view.undistortion.as_ref().map(|undistortion| Original {
            name: &view.photo,
            undistortion,
            camera,
        });
        Self {
            name: &view.name,
            original,
            stance: view.stance,
        }
    }
}

impl Original<'_> {
    /// Width and height of the photo at the size of COLMAP's model.
    pub fn size(&self) -> [u32; 2] {
        [self.undistortion.lens.width, self.undistortion.lens.height]
    }

    /// An image of the photo, `[height, width]` of any size, as the view shows it.
    /// Channels must be such that their means mean something.
    pub fn shown<const N: usize>(&self, pixels: Vec<[f32; N]>, size: [u32; 2]) -> Vec<[f32; N]> {
        let enough = self.undistortion.photo_size(self.camera);
        let smaller = [size[0].min(enough[0]), size[1].min(enough[1])];
        if smaller == size {
            return self.undistortion.resample(&pixels, size, self.camera);
        }
        let pixels = resample(&pixels, size, smaller, Filter::Average);
        self.undistortion.resample(&pixels, smaller, self.camera)
    }
}
