//! From the numbers of a vertex to a Gaussian.

use super::header::VertexLayout;
use super::{CHANNELS, FILTER, ReadSplats, SHAPE, sh_position};
use crate::splats::quantize::{FLAT, OPAQUE, logit};
use crate::splats::sh::{C0, coefficient_count};
use crate::splats::shared::MIN_QUATERNION_NORM;
use crate::splats::{Splats, opacity};

/// Sorts the numbers of each Gaussian into the arrays.
pub(super) struct Collector {
    read: ReadSplats,
    /// For each coefficient of the field its place among the SH properties.
    sh_positions: Vec<usize>,
    byte_colors: bool,
    /// Scales of a Gaussian that a filter widens.
    axes: usize,
}

impl Collector {
    pub fn new(count: usize, layout: &VertexLayout) -> Self {
        let degree = layout.degree;
        let sh_positions: Vec<usize> = (0..coefficient_count(degree))
            .flat_map(|k| (0..CHANNELS).map(move |channel| sh_position(degree, k, channel)))
            .collect();
        Self {
            read: ReadSplats {
                splats: Splats::with_capacity(count, degree, CHANNELS),
                notes: (layout.filtered())
                    .then(|| format!("{FILTER} is put into scales and opacities"))
                    .into_iter()
                    .collect(),
                ..ReadSplats::default()
            },
            sh_positions,
            byte_colors: layout.byte_colors,
            axes: if layout.columns.contains(&None) { 2 } else { 3 },
        }
    }

    /// `values` hold center, SH, shape and the filter, if any, in this order; those that mean a
    /// limit become finite.
    pub fn push(&mut self, values: &mut [f32]) {
        let (center, rest) = values.split_at_mut(3);
        let (sh, rest) = rest.split_at_mut(self.sh_positions.len());
        let (shape, filter) = rest.split_at_mut(SHAPE.len());
        if shape[0].is_infinite() {
            shape[0] = OPAQUE.copysign(shape[0]);
        }
        for scale in &mut shape[1..4] {
            if *scale == f32::NEG_INFINITY {
                *scale = FLAT;
            }
        }
        if let [filter] = filter {
            widen(&mut shape[..=self.axes], *filter);
        }
        if self.byte_colors {
            for color in &mut sh[..CHANNELS] {
                *color = ((f64::from(*color) / 255.0 - 0.5) / C0) as f32;
            }
        }
        let quaternion = [shape[4], shape[5], shape[6], shape[7]];
        let norm = quaternion
            .iter()
            .map(|&q| f64::from(q).powi(2))
            .sum::<f64>()
            .sqrt();
        let finite = |values: &[f32]| values.iter().all(|value| value.is_finite());
        if !(finite(center) && finite(sh) && finite(shape)) || norm < MIN_QUATERNION_NORM {
            self.read.skipped += 1;
            return;
        }
        let splats = &mut self.read.splats;
        splats.means.push([center[0], center[1], center[2]]);
        splats.opacity_logits.push(shape[0]);
        splats.log_scales.push([shape[1], shape[2], shape[3]]);
        splats.quats.push(quaternion);
        let coefficients = self.sh_positions.iter().map(|&position| sh[position]);
        splats.sh.coefficients.extend(coefficients);
    }

    pub fn finish(self) -> ReadSplats {
        self.read
    }
}

/// Adds a filter's variance to a Gaussian's, as Mip-Splatting does on drawing: `shape` holds the
/// logit of its opacity, which falls as the Gaussian grows, and its log-scales.
fn widen(shape: &mut [f32], filter: f32) {
    if filter == 0.0 {
        return;
    }
    let mut share = 1.0;
    for scale in &mut shape[1..] {
        let before = (2.0 * f64::from(*scale)).exp();
        // Not finite where the filter is not.
        let after = before + f64::from(filter).powi(2);
        share *= before / after;
        *scale = (0.5 * after.ln()) as f32;
    }
    shape[0] = logit(opacity(shape[0]) * share.sqrt());
}
