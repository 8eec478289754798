//! Scenes as plain arrays, and random ones to test with.

use super::project::{Cull, Projected, jacobian_limits, project};
use super::shade::{Shading, unclamped};
use super::view::View;
use super::{Number, lift, relative_distance};
use num_dual::Dual64;

/// One Gaussian with all its parameters.
#[derive(Clone, Debug)]
pub struct Gaussian<T, const C: usize> {
    /// Center in world units.
    pub mean: [T; 3],
    /// Rotation `w x y z`, of any length.
    pub quat: [T; 4],
    /// Logarithms of the standard deviations.
    pub log_scale: [T; 3],
    /// Logit of the opacity.
    pub opacity_logit: T,
    /// Harmonics `[K][C]`.
    pub sh: Vec<[T; C]>,
}

impl<T: Number, const C: usize> Gaussian<T, C> {
    /// Parameters in a row: mean, quat, log-scale, logit, then the harmonics.
    pub fn parameters_mut(&mut self) -> impl Iterator<Item = &mut T> {
        (self.mean.iter_mut())
            .chain(&mut self.quat)
            .chain(&mut self.log_scale)
            .chain(std::iter::once(&mut self.opacity_logit))
            .chain(self.sh.iter_mut().flatten())
    }

    /// Projects, after a look at the harmonics as well.
    ///
    /// # Errors
    /// The first reason for which the Gaussian is not drawn.
    pub fn project(&self, view: &View) -> Result<Projected<T>, Cull> {
        if !self.sh.iter().flatten().all(|c| c.re().is_finite()) {
            return Err(Cull::NonFinite);
        }
        project(
            &self.mean,
            &self.quat,
            &self.log_scale,
            self.opacity_logit,
            view,
        )
    }
}

impl<const C: usize> Gaussian<f64, C> {
    /// The same Gaussian as dual constants.
    pub fn to_dual(&self) -> Gaussian<Dual64, C> {
        Gaussian {
            mean: self.mean.map(lift),
            quat: self.quat.map(lift),
            log_scale: self.log_scale.map(lift),
            opacity_logit: lift(self.opacity_logit),
            sh: self.sh.iter().map(|c| c.map(lift)).collect(),
        }
    }

    /// The smallest relative distance of this Gaussian's decisions (near
    /// plane, frustum clamp, opacity floor, image box, color at zero) from
    /// falling the other way.
    pub fn margin(&self, view: &View, shading: Shading) -> f64 {
        let depth = (0..3)
            .map(|i| view.rotation[2][i] * self.mean[i])
            .sum::<f64>()
            + view.translation[2];
        let mut margin = relative_distance(depth, view.near);
        let Ok(p) = self.project(view) else {
            // Grown by 1 %, does it stay culled?
            let mut larger = self.clone();
            larger.log_scale = larger.log_scale.map(|s| s + 0.01);
            larger.opacity_logit += 0.01;
            return if larger.project(view).is_err() {
                margin
            } else {
                0.0
            };
        };
        let focal = [view.fx, view.fy];
        let principal = [view.cx, view.cy];
        let size = [view.width as f64, view.height as f64];
        for (i, limits) in jacobian_limits(view).into_iter().enumerate() {
            let ratio = (p.mean2d[i] - principal[i]) / focal[i];
            let (low, high) = (
                p.mean2d[i] + p.half_extent[i],
                p.mean2d[i] - p.half_extent[i],
            );
            margin = limits
                .map(|limit| relative_distance(ratio, limit))
                .into_iter()
                .chain([low / size[i], high / size[i] - 1.0].map(f64::abs))
                .fold(margin, f64::min);
        }
        if shading == Shading::Offset {
            for value in unclamped(&self.mean, &self.sh, view, shading) {
                margin = margin.min(value.abs());
            }
        }
        margin.min(relative_distance(p.opacity, view.numerics.alpha_min))
    }
}

/// `N` Gaussians as parallel arrays. Also the shape of a gradient.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene<T, const C: usize> {
    /// `[N][3]`.
    pub means: Vec<[T; 3]>,
    /// `[N][4]`, `w x y z`.
    pub quats: Vec<[T; 4]>,
    /// `[N][3]`.
    pub log_scales: Vec<[T; 3]>,
    /// `[N]`.
    pub opacity_logits: Vec<T>,
    /// `[N · K][C]`, K = (degree + 1)².
    pub sh: Vec<[T; C]>,
    /// Degree of the harmonics, 0 to 3.
    pub degree: usize,
}

impl<T: Number, const C: usize> Scene<T, C> {
    /// A scene without Gaussians.
    pub fn empty(degree: usize) -> Self {
        Self {
            means: Vec::new(),
            quats: Vec::new(),
            log_scales: Vec::new(),
            opacity_logits: Vec::new(),
            sh: Vec::new(),
            degree,
        }
    }

    /// Number of Gaussians.
    pub fn len(&self) -> usize {
        self.means.len()
    }

    /// Returns true if the scene has no Gaussians.
    pub fn is_empty(&self) -> bool {
        self.means.is_empty()
    }

    /// Harmonics per Gaussian and channel.
    pub fn coefficient_count(&self) -> usize {
        (self.degree + 1).pow(2)
    }

    /// Gaussian `index`.
    pub fn gaussian(&self, index: usize) -> Gaussian<T, C> {
        let count = self.coefficient_count();
        Gaussian {
            mean: self.means[index],
            quat: self.quats[index],
            log_scale: self.log_scales[index],
            opacity_logit: self.opacity_logits[index],
            sh: self.sh[index * count..(index + 1) * count].to_vec(),
        }
    }

    /// Appends a Gaussian, whose harmonics must be of the scene's degree.
    pub fn push(&mut self, gaussian: Gaussian<T, C>) {
        assert_eq!(gaussian.sh.len(), self.coefficient_count());
        self.means.push(gaussian.mean);
        self.quats.push(gaussian.quat);
        self.log_scales.push(gaussian.log_scale);
        self.opacity_logits.push(gaussian.opacity_logit);
        self.sh.extend(gaussian.sh);
    }

    /// A scene of Gaussians.
    pub fn of(degree: usize, gaussians: impl IntoIterator<Item = Gaussian<T, C>>) -> Self {
        let mut scene = Self::empty(degree);
        gaussians.into_iter().for_each(|g| scene.push(g));
        scene
    }
}

impl<const C: usize> Scene<f64, C> {
    /// Means, quaternions, log-scales, logits and harmonics in a row each.
    pub fn groups(&self) -> [&[f64]; 5] {
        [
            self.means.as_flattened(),
            self.quats.as_flattened(),
            self.log_scales.as_flattened(),
            &self.opacity_logits,
            self.sh.as_flattened(),
        ]
    }

    /// The same scene as dual constants.
    pub fn to_dual(&self) -> Scene<Dual64, C> {
        Scene::of(
            self.degree,
            (0..self.len()).map(|i| self.gaussian(i).to_dual()),
        )
    }
}
