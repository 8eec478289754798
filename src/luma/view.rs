//! Training views.

use super::LumaError;
use crate::capture::{Camera, CaptureError, Exposure, downscale};

/// One photograph to train on.
#[derive(Clone, Debug)]
pub struct TrainingView {
    /// Camera of the photo.
    pub camera: Camera,
    /// sRGB-encoded gray, `[height, width]`.
    pub gray: Vec<u8>,
    /// Weight of each pixel, `[height, width]`: 255 fully, 0 not at all. `None` if all count fully.
    pub mask: Option<Vec<u8>>,
    /// Exposure of the photo.
    pub exposure: Exposure,
}

impl TrainingView {
    /// A photo of which every pixel counts, exposed as the scene is.
    pub fn new(camera: Camera, gray: Vec<u8>) -> Self {
        Self {
            camera,
            gray,
            mask: None,
            exposure: Exposure::NONE,
        }
    }

    /// The same at half the size, each side rounded up.
    pub fn halved(&self) -> Self {
        let half = [self.camera.width, self.camera.height].map(|side| side.div_ceil(2));
        let camera = self.camera.resized(half[0], half[1]);
        let as_size = |camera: &Camera| [camera.width, camera.height].map(|side| side as usize);
        let halve = |values: &[u8]| {
            let pixels: Vec<[u8; 1]> = values.iter().map(|&v| [v]).collect();
            downscale(&pixels, as_size(&self.camera), as_size(&camera)).into_flattened()
        };
        Self {
            gray: halve(&self.gray),
            mask: self.mask.as_deref().map(halve),
            exposure: self.exposure,
            camera,
        }
    }

    /// Returns true if a pixel is not masked.
    pub(super) fn counts(&self, pixel: usize) -> bool {
        self.mask.as_ref().is_none_or(|mask| mask[pixel] >= 128)
    }

    /// `shown` of a render and the gray of the photo, 0 to 1, at the pixels that count.
    pub(super) fn compared(
        &self,
        picture: &[f32],
        shown: impl Fn(f32) -> f32,
    ) -> (Vec<f32>, Vec<f32>) {
        (0..self.gray.len())
            .filter(|&pixel| self.counts(pixel))
            .map(|pixel| (shown(picture[pixel]), f32::from(self.gray[pixel]) / 255.0))
            .unzip()
    }

    /// Mask with 255 everywhere if the view has none.
    pub(super) fn whole_mask(&mut self) -> Vec<u8> {
        let pixels = self.gray.len();
        self.mask.take().unwrap_or_else(|| vec![255; pixels])
    }
}

/// The views of a training. Photos are loaded when they are needed, by several threads; a
/// `Vec` of views has them all.
pub trait TrainingViews: Send + Sync {
    /// Number of views.
    fn count(&self) -> usize;

    /// Camera of a view.
    fn camera(&self, view: usize) -> &Camera;

    /// Exposure of a view.
    fn exposure(&self, view: usize) -> Exposure;

    /// Returns true if any view has masked pixels.
    fn masked(&self) -> bool;

    /// A view with its photo, the same whenever it is loaded.
    ///
    /// # Errors
    /// [`CaptureError`] of its photo.
    fn load(&self, view: usize) -> Result<TrainingView, CaptureError>;
}

impl TrainingViews for Vec<TrainingView> {
    fn count(&self) -> usize {
        self.len()
    }

    fn camera(&self, view: usize) -> &Camera {
        &self[view].camera
    }

    fn exposure(&self, view: usize) -> Exposure {
        self[view].exposure
    }

    fn masked(&self) -> bool {
        self.iter().any(|view| view.mask.is_some())
    }

    fn load(&self, view: usize) -> Result<TrainingView, CaptureError> {
        Ok(self[view].clone())
    }
}

/// A view with its photo.
pub(super) fn load(views: &dyn TrainingViews, view: usize) -> Result<TrainingView, LumaError> {
    let loaded = views.load(view)?;
    let expected = loaded.camera.width as usize * loaded.camera.height as usize;
    let masked = loaded.mask.as_ref().map_or(expected, Vec::len);
    for pixels in [loaded.gray.len(), masked] {
        if pixels != expected {
            return Err(LumaError::Size {
                view,
                pixels,
                expected,
            });
        }
    }
    Ok(loaded)
}
