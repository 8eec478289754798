//! What nerfstudio does to COLMAP's world.

use glam::{DMat3, DVec3};
use serde::Deserialize;

use crate::capture::Camera;

/// Largest cosine between two axes of a pose, ideally 0: files have few digits, and larger ones are
/// no pose.
pub(super) const SKEW: f64 = 1e-2;

/// Nerfstudio's transform of COLMAP's world: x becomes `scale` · (`transform` · x).
#[derive(Deserialize)]
pub(super) struct WorldTransform {
    pub transform: Vec<[f64; 4]>,
    pub scale: f64,
}

impl WorldTransform {
    pub fn is_sound(&self) -> bool {
        if self.transform.len() < 3 || !(self.scale.is_finite() && self.scale > 0.0) {
            return false;
        }
        let (turn, way) = self.parts();
        let orthogonal = (turn * turn.transpose()).abs_diff_eq(DMat3::IDENTITY, SKEW);
        orthogonal && turn.determinant() > 0.0 && way.is_finite()
    }

    fn parts(&self) -> (DMat3, DVec3) {
        let rows = [0, 1, 2].map(|r| self.transform[r]);
        let column = |c: usize| DVec3::new(rows[0][c], rows[1][c], rows[2][c]);
        (DMat3::from_cols(column(0), column(1), column(2)), column(3))
    }

    /// From nerfstudio's world to COLMAP's.
    pub fn back(&self, camera: &Camera) -> Camera {
        let (turn, way) = self.parts();
        let rotation = camera.rotation * turn;
        let center = turn.transpose() * (camera.center() / self.scale - way);
        Camera {
            rotation,
            translation: -(rotation * center),
            ..camera.clone()
        }
    }

    /// From COLMAP's world to nerfstudio's.
    pub fn forth(&self, camera: &Camera) -> Camera {
        let (turn, way) = self.parts();
        let rotation = camera.rotation * turn.transpose();
        let center = self.scale * (turn * camera.center() + way);
        Camera {
            rotation,
            translation: -(rotation * center),
            ..camera.clone()
        }
    }
}
