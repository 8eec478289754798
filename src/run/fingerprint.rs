//! What a training was given, in a few digits.

use sha2::{Digest, Sha256};

use crate::{
    capture::{Capture, Dataset, Photo},
    sections::hexadecimal,
};

/// A SHA-256 over photos at working size, their cameras and COLMAP's points.
#[derive(Default)]
pub(super) struct Fingerprint(Sha256);

impl Fingerprint {
    /// Takes a view; all are taken in their order.
    pub fn look(&mut self, dataset: &Dataset, view: usize, photo: &Photo) {
        let camera = &dataset.cameras[view];
        self.0.update(dataset.capture.views[view].name.as_bytes());
        for side in [photo.width, photo.height] {
            self.0.update(side.to_le_bytes());
        }
        let rotation = camera.rotation.to_cols_array();
        let pose = rotation.into_iter().chain(camera.translation.to_array());
        let lens = [camera.fx, camera.fy, camera.cx, camera.cy];
        pose.chain(lens)
            .for_each(|value| self.0.update(value.to_le_bytes()));
        self.0.update(&photo.gray);
        self.0.update(photo.mask.as_deref().unwrap_or_default());
    }

    /// Takes the points; in hexadecimal.
    pub fn finish(mut self, capture: &Capture) -> String {
        for point in &capture.points {
            for value in point.position.to_array() {
                self.0.update(value.to_le_bytes());
            }
            self.0.update(point.color);
        }
        hexadecimal(&self.0.finalize())
    }
}
