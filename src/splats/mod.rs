//! The Gaussians: arrays on the host, spherical harmonics, initialization and
//! splat files.

mod axes;
pub mod dome;
mod error;
mod file;
mod format;
mod glb;
pub mod init;
pub(crate) mod morton;
mod neighbors;
pub mod npy;
pub mod ply;
mod quantize;
pub mod sh;
mod shared;
mod sog;
mod splat;
mod spz;
mod usda;

pub use error::SplatError;
pub use file::{is_splat_file, read_splats, write_splats};
pub use format::Format;
pub use init::{InitialPoint, initial_splats};
pub use neighbors::{nearest_neighbor_distances, nearest_neighbors};
pub use ply::{read_ply, write_ply};
pub use sh::ShField;
pub use shared::{ReadSplats, WriteOptions};

/// A set of `N` Gaussians with one field of spherical harmonics.
///
/// Arrays are parallel; index `i` is the same Gaussian in all of them.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Splats {
    /// Centers in world units, `[N, 3]`.
    pub means: Vec<[f32; 3]>,
    /// Rotations as quaternions `w x y z`, `[N, 4]`; not necessarily of unit length.
    pub quats: Vec<[f32; 4]>,
    /// Natural logarithms of the standard deviations along the rotated axes, `[N, 3]`.
    pub log_scales: Vec<[f32; 3]>,
    /// Logits of the opacities, `[N]`.
    pub opacity_logits: Vec<f32>,
    /// SH coefficients of the color: luma (1 channel), chroma (2) or RGB (3).
    pub sh: ShField,
}

impl Splats {
    /// None yet, with room for so many with harmonics of a degree.
    pub(crate) fn with_capacity(count: usize, degree: u32, channels: usize) -> Self {
        let coefficients = count * channels * sh::coefficient_count(degree);
        Self {
            means: Vec::with_capacity(count),
            quats: Vec::with_capacity(count),
            log_scales: Vec::with_capacity(count),
            opacity_logits: Vec::with_capacity(count),
            sh: ShField {
                degree,
                channels,
                coefficients: Vec::with_capacity(coefficients),
            },
        }
    }

    /// Opacities, 0 to 1, `[N]`.
    pub fn opacities(&self) -> impl Iterator<Item = f64> + '_ {
        self.opacity_logits.iter().map(|&logit| opacity(logit))
    }

    /// The number of Gaussians.
    pub fn len(&self) -> usize {
        self.means.len()
    }

    /// Some of the Gaussians, in the order of `indices`.
    pub fn chosen(&self, indices: &[usize]) -> Self {
        Self {
            means: indices.iter().map(|&i| self.means[i]).collect(),
            quats: indices.iter().map(|&i| self.quats[i]).collect(),
            log_scales: indices.iter().map(|&i| self.log_scales[i]).collect(),
            opacity_logits: indices.iter().map(|&i| self.opacity_logits[i]).collect(),
            sh: self.sh.chosen(indices),
        }
    }

    /// Puts others, with a field of the same degree and channels, behind these.
    pub fn append(&mut self, mut others: Self) {
        debug_assert_eq!(
            [self.sh.degree, self.sh.channels as u32],
            [others.sh.degree, others.sh.channels as u32]
        );
        self.means.append(&mut others.means);
        self.quats.append(&mut others.quats);
        self.log_scales.append(&mut others.log_scales);
        self.opacity_logits.append(&mut others.opacity_logits);
        self.sh.coefficients.append(&mut others.sh.coefficients);
    }

    /// Returns true if there is no Gaussian.
    pub fn is_empty(&self) -> bool {
        self.means.is_empty()
    }

    /// The same Gaussians showing the mean of their channels: a gray scene with
    /// one channel. A field without channels becomes zeros.
    pub fn to_luma(&self) -> Self {
        let channels = self.sh.channels;
        let coefficients = if channels == 0 {
            ShField::zeros(self.len(), self.sh.degree, 1).coefficients
        } else {
            let mean = |values: &[f32]| values.iter().sum::<f32>() / channels as f32;
            let coefficients = self.sh.coefficients.chunks_exact(channels);
            coefficients.map(mean).collect()
        };
        Self {
            sh: ShField {
                degree: self.sh.degree,
                channels: 1,
                coefficients,
            },
            ..self.clone()
        }
    }

    /// Returns true if the channels of every coefficient differ by at most `tolerance`, in units of
    /// the coefficients. NaN is not gray.
    pub fn is_gray(&self, tolerance: f32) -> bool {
        let channels = self.sh.channels.max(1);
        let mut coefficients = self.sh.coefficients.chunks_exact(channels);
        coefficients.all(|values| {
            let near = |value: &f32| (value - values[0]).abs() <= tolerance;
            values.iter().all(near)
        })
    }
}

#[cfg(test)]
pub(crate) mod fixtures;
#[cfg(test)]
#[path = "format_tests.rs"]
mod format_tests;

/// The opacity, 0 to 1, that a logit stands for.
pub fn opacity(logit: f32) -> f64 {
    1.0 / (1.0 + (-f64::from(logit)).exp())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_splats(coefficients: Vec<f32>) -> Splats {
        Splats {
            means: vec![[0.0; 3], [1.0; 3]],
            quats: vec![[1.0, 0.0, 0.0, 0.0]; 2],
            log_scales: vec![[-1.0; 3]; 2],
            opacity_logits: vec![0.5; 2],
            sh: ShField {
                degree: 0,
                channels: 3,
                coefficients,
            },
        }
    }

    #[test]
    fn luma_is_the_mean_of_the_channels() {
        let splats = two_splats(vec![1.0, 2.0, 6.0, -1.0, 0.0, 1.0]);
        let luma = splats.to_luma();
        assert_eq!(luma.sh.channels, 1);
        assert_eq!(luma.sh.coefficients, [3.0, 0.0]);
        assert_eq!(luma.means, splats.means);
    }

    #[test]
    fn gray_within_the_tolerance() {
        assert!(two_splats(vec![0.5, 0.5, 0.5, 1.0, 1.0, 1.0]).is_gray(0.0));
        let nearly = two_splats(vec![0.5, 0.5, 0.5, 1.0, 1.01, 1.0]);
        assert!(nearly.is_gray(0.02));
        assert!(!nearly.is_gray(0.005));
        assert!(!two_splats(vec![0.5, f32::NAN, 0.5, 1.0, 1.0, 1.0]).is_gray(1.0));
        assert!(nearly.to_luma().is_gray(0.0));
    }
}
