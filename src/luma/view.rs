//! What training looks at.

use crate::capture::{Camera, downscale};

/// One photograph to train on.
#[derive(Clone, Debug)]
pub struct TrainingView {
    /// Where it was taken.
    pub camera: Camera,
    /// sRGB-encoded gray, `[height, width]`.
    pub gray: Vec<u8>,
}

impl TrainingView {
    /// The same at half the size, each side rounded up.
    pub fn halved(&self) -> Self {
        let sides = [self.camera.width, self.camera.height];
        let half = sides.map(|side| side.div_ceil(2));
        let as_size = |sides: [u32; 2]| sides.map(|side| side as usize);
        let pixels: Vec<[u8; 1]> = self.gray.iter().map(|&v| [v]).collect();
        Self {
            camera: self.camera.resized(half[0], half[1]),
            gray: downscale(&pixels, as_size(sides), as_size(half)).into_flattened(),
        }
    }
}
