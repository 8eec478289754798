//! What training looks at.

use crate::capture::{Camera, Exposure, downscale};

/// One photograph to train on.
#[derive(Clone, Debug)]
pub struct TrainingView {
    /// Where it was taken.
    pub camera: Camera,
    /// sRGB-encoded gray, `[height, width]`.
    pub gray: Vec<u8>,
    /// What each pixel counts, `[height, width]`: 255 fully, 0 not at all. `None` where
    /// all do.
    pub mask: Option<Vec<u8>>,
    /// How bright it shows the scene.
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
        let sides = [self.camera.width, self.camera.height];
        let half = sides.map(|side| side.div_ceil(2));
        let as_size = |sides: [u32; 2]| sides.map(|side| side as usize);
        let halve = |values: &[u8]| {
            let pixels: Vec<[u8; 1]> = values.iter().map(|&v| [v]).collect();
            downscale(&pixels, as_size(sides), as_size(half)).into_flattened()
        };
        Self {
            camera: self.camera.resized(half[0], half[1]),
            gray: halve(&self.gray),
            mask: self.mask.as_deref().map(halve),
            exposure: self.exposure,
        }
    }
}
