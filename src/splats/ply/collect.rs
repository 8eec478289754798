//! From the numbers of a vertex to a Gaussian.

use super::header::VertexLayout;
use super::{CHANNELS, FILTER, ReadSplats, SHAPE, sh_position};
use crate::splats::opacity;
use crate::splats::quantize::{FLAT, OPAQUE, logit};
use crate::splats::sh::{C0, coefficient_count};
use crate::splats::shared::SplatBuilder;

/// Sorts the numbers of each Gaussian into the arrays.
pub(super) struct Collector {
    gathered: SplatBuilder,
    /// A line about the filter, where there is one.
    notes: Vec<String>,
    /// For each coefficient of the field its place among the SH properties.
    sh_positions: Vec<usize>,
    /// The coefficients of the Gaussian at hand.
    ordered: Vec<f32>,
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
            gathered: SplatBuilder::new(count, degree),
            notes: (layout.filtered())
                .then(|| format!("{FILTER} is put into scales and opacities"))
                .into_iter()
                .collect(),
            sh_positions,
            ordered: Vec::new(),
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
        self.ordered.clear();
        let coefficients = self.sh_positions.iter().map(|&position| sh[position]);
        self.ordered.extend(coefficients);
        self.gathered.push(
            [center[0], center[1], center[2]],
            [shape[4], shape[5], shape[6], shape[7]],
            [shape[1], shape[2], shape[3]],
            shape[0],
            &self.ordered,
        );
    }

    pub fn finish(self) -> ReadSplats {
        ReadSplats {
            notes: self.notes,
            ..self.gathered.finish()
        }
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
