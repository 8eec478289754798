//! What a solver is given: a camera and the a/b wanted in its picture.

use super::teacher::{AbImage, Filter, resample};
use crate::capture::Camera;

/// A view and what its teacher says.
#[derive(Clone, Debug)]
pub struct ChromaView {
    /// Where the photo was taken.
    pub camera: Camera,
    /// Wanted a/b at the camera's size.
    pub wanted: AbImage,
    /// How much each pixel counts, `[height, width]`: 0 where nothing is known, 1 as
    /// an ordinary pixel, more where it was painted by hand. `None`: 1 everywhere.
    pub weights: Option<Vec<f32>>,
}

impl ChromaView {
    /// The same view, 2^`scale` times smaller. A smaller pixel's colour is the mean of
    /// what is known in it.
    pub(super) fn at_scale(&self, scale: u32) -> Self {
        let size = [self.camera.width, self.camera.height];
        let [width, height] = size.map(|side| (side >> scale).max(1));
        let camera = self.camera.resized(width, height);
        let Some(weights) = &self.weights else {
            return Self {
                camera,
                wanted: self.wanted.resized(width, height),
                weights: None,
            };
        };
        let known: Vec<[f32; 3]> = (self.wanted.ab.iter().zip(weights))
            .map(|(ab, &w)| [w * ab[0], w * ab[1], w])
            .collect();
        let known = resample(&known, size, [width, height], Filter::Average);
        Self {
            camera,
            wanted: AbImage {
                width,
                height,
                ab: (known.iter())
                    .map(|&[a, b, w]| if w > 0.0 { [a / w, b / w] } else { [0.0; 2] })
                    .collect(),
            },
            weights: Some(known.iter().map(|&[_, _, w]| w).collect()),
        }
    }
}
