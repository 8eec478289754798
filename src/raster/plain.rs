//! Opacities of an antialiased scene for viewers that do not compensate their blur.
//!
//! Mip-Splatting multiplies an opacity by c = √(det Σ / det(Σ + s·I)) of the footprint Σ in each
//! view (Yu et al. 2024, equation 9), s being the blur; a plain viewer blurs as much, but draws
//! the stored opacity. The one opacity that comes nearest to o·c over the training views, each
//! weighed by the pixels that the Gaussian covers there, w = √det(Σ + s·I), is o·Σ w·c / Σ w.

use glam::{DMat3, DQuat, DVec3};

use super::constants::{BLUR, NEAR_SHARE};
use crate::{capture::Camera, splats::Splats};

/// Splats that a plain viewer draws as the antialiased `splats` are drawn in the `cameras`, as
/// far as opacities can do that. `extent` is the capture's, in world units. A Gaussian that no
/// camera looks at keeps its opacity.
pub fn plain<'a>(
    splats: &Splats,
    cameras: impl IntoIterator<Item = &'a Camera, IntoIter: Clone>,
    extent: f64,
) -> Splats {
    let (near, cameras) = (NEAR_SHARE * extent, cameras.into_iter());
    let compensated = |index: usize| {
        let gaussian = Gaussian::of(splats, index);
        let (weights, sum) = (cameras.clone())
            .filter_map(|camera| gaussian.footprint(camera, near))
            .fold((0.0, 0.0), |(weights, sum), (covered, compensation)| {
                (weights + covered, sum + covered * compensation)
            });
        let logit = splats.opacity_logits[index];
        match weights > 0.0 && logit.is_finite() {
            true => scaled(f64::from(logit), sum / weights) as f32,
            false => logit,
        }
    };
    Splats {
        opacity_logits: (0..splats.len()).map(compensated).collect(),
        ..splats.clone()
    }
}

/// Logit of `factor` · sigmoid(`logit`), for a factor in (0, 1]; finite for every finite input:
/// ln(f·o) − ln(1 − f·o), with 1 − f·o = (1 − o) + (1 − f)·o.
fn scaled(logit: f64, factor: f64) -> f64 {
    let [opacity, rest] = [logit, -logit].map(|x| 1.0 / (1.0 + (-x).exp()));
    let left = rest + (1.0 - factor) * opacity;
    let least = f64::from(f32::MIN_POSITIVE);
    (factor * opacity).max(least).ln() - left.max(least).ln()
}

/// One Gaussian in world space.
struct Gaussian {
    mean: DVec3,
    /// Rotation · diag(scale), in columns.
    axes: DMat3,
}

impl Gaussian {
    fn of(splats: &Splats, index: usize) -> Self {
        let [w, x, y, z] = splats.quats[index].map(f64::from);
        let rotation = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w).normalize());
        let scale = splats.log_scales[index].map(|scale| f64::from(scale).exp());
        Self {
            mean: DVec3::from(splats.means[index].map(f64::from)),
            axes: rotation * DMat3::from_diagonal(DVec3::from(scale)),
        }
    }

    /// Pixels that it covers, √det(Σ + s·I), and its compensation; `None` where its center is not
    /// in the picture or nothing is finite.
    fn footprint(&self, camera: &Camera, near: f64) -> Option<(f64, f64)> {
        camera.pixel_of(self.mean)?;
        let at = camera.rotation * self.mean + camera.translation;
        if at.z < near {
            return None;
        }
        let rows = (camera.rotation * self.axes).transpose();
        let row = |axis: DVec3, focal: f64, slope: f64| focal / at.z * (axis - slope * rows.z_axis);
        let x = row(rows.x_axis, camera.fx, at.x / at.z);
        let y = row(rows.y_axis, camera.fy, at.y / at.z);
        let blur = f64::from(BLUR);
        let sharp = x.cross(y).length();
        let covered = (sharp * sharp + blur * (x.dot(x) + y.dot(y) + blur)).sqrt();
        let found = (covered, sharp / covered);
        (found.0.is_finite() && found.1.is_finite()).then_some(found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::splats::ShField;

    /// A ball of a size before the origin's cameras, at these depths along z.
    fn ball(size: f64, logit: f32) -> Splats {
        Splats {
            means: vec![[0.0; 3]],
            quats: vec![[1.0, 0.0, 0.0, 0.0]],
            log_scales: vec![[size.ln() as f32; 3]],
            opacity_logits: vec![logit],
            sh: ShField {
                degree: 0,
                channels: 1,
                coefficients: vec![0.5],
            },
        }
    }

    fn from(depth: f64) -> Camera {
        Camera {
            width: 100,
            height: 80,
            fx: 100.0,
            fy: 100.0,
            cx: 50.0,
            cy: 40.0,
            rotation: DMat3::IDENTITY,
            translation: DVec3::new(0.0, 0.0, depth),
        }
    }

    fn opacity(splats: &Splats) -> f64 {
        1.0 / (1.0 + (-f64::from(splats.opacity_logits[0])).exp())
    }

    /// Of a ball seen head on: variance by variance with blur.
    fn compensation(size: f64, depth: f64) -> f64 {
        let variance = (100.0 * size / depth).powi(2);
        variance / (variance + f64::from(BLUR))
    }

    #[test]
    fn one_view_is_compensated_exactly() {
        for (size, depth) in [(0.01, 1.0), (0.003, 2.0), (1e-5, 3.0), (2.0, 1.0)] {
            let found = opacity(&plain(&ball(size, 1.0), &[from(depth)], 1.0));
            let wanted = opacity(&ball(size, 1.0)) * compensation(size, depth);
            assert!(
                (found - wanted).abs() < 1e-6 * wanted.max(1e-6),
                "{size} {depth}: {found}"
            );
        }
    }

    #[test]
    fn near_views_weigh_more_than_far_ones() {
        let [near, far] = [1.0, 8.0].map(|depth| compensation(0.01, depth));
        let both = opacity(&plain(&ball(0.01, 0.0), &[from(1.0), from(8.0)], 1.0)) / 0.5;
        assert!(
            both < near && both > 0.5 * (near + far),
            "{both} {near} {far}"
        );
    }

    #[test]
    fn what_no_camera_sees_and_what_is_not_finite_stay() {
        let unseen = ball(0.01, 2.0);
        assert_eq!(plain(&unseen, &[from(-1.0)], 1.0), unseen);
        assert_eq!(plain(&unseen, &[], 1.0), unseen);
        let mut broken = ball(0.01, f32::INFINITY);
        broken.log_scales[0][1] = f32::NAN;
        assert_eq!(
            plain(&broken, &[from(1.0)], 1.0).opacity_logits,
            broken.opacity_logits
        );
    }

    #[test]
    fn logits_stay_finite() {
        for logit in [-80.0, 0.0, 80.0] {
            for factor in [1e-300, 1e-3, 0.5, 1.0] {
                assert!(scaled(logit, factor).is_finite(), "{logit} {factor}");
            }
        }
        assert!((scaled(1.5, 1.0) - 1.5).abs() < 1e-12);
    }
}
