//! Measured errors: each row is one quantity over several scenes.

use std::sync::LazyLock;

use gs_chroma::doctor::headroom;

use crate::{
    compare::{Elementwise, FlipBounds, GradientBounds},
    harness::gpu,
};

/// What a kernel gave and what the oracle says, of one scene.
pub struct Sample {
    /// The kernel's values.
    pub actual: Vec<f64>,
    /// The oracle's.
    pub expected: Vec<f64>,
    /// Which of them stand close to a discontinuity; empty where none can.
    pub may_flip: Vec<bool>,
}

impl Sample {
    /// Values none of which stands close to a discontinuity.
    pub fn new(actual: Vec<f64>, expected: Vec<f64>) -> Self {
        Self {
            actual,
            expected,
            may_flip: Vec::new(),
        }
    }
}

/// One line of the table: the worst of its scenes, and whether all passed.
pub struct Row {
    kernel: &'static str,
    what: &'static str,
    scenes: usize,
    largest_error: f64,
    relative_l2: f64,
    /// How much of the bound was used, at most 1.
    used: f64,
    bound: String,
    failures: Vec<String>,
}

static HEADROOM: LazyLock<f64> = LazyLock::new(|| headroom(gpu()));

/// Errors up to `worst · (scale + |x|)` were seen: relative ones, floored at a
/// typical size of the quantity.
pub fn relative(worst: f64, scale: f64) -> Elementwise {
    let unit = worst * *HEADROOM;
    Elementwise {
        absolute: unit * scale,
        relative: unit,
    }
}

/// Bounds on a gradient of which this relative L2 error was seen; angle and bias have to
/// be as small as it makes them.
pub fn gradient_bounds(worst_l2: f64, elements: Elementwise) -> GradientBounds {
    let relative_l2 = worst_l2 * *HEADROOM;
    GradientBounds {
        elementwise: elements,
        relative_l2,
        // 1 - cos φ is about φ²/2, and φ is at most the relative error.
        cosine: 0.51 * relative_l2 * relative_l2,
        // In L1 norms, in which small elements weigh more.
        signed_bias: 2.0 * relative_l2,
    }
}

impl Row {
    fn new(kernel: &'static str, what: &'static str, samples: &[Sample]) -> Self {
        assert!(!samples.is_empty(), "{kernel}, {what}: nothing to compare");
        let mut row = Self {
            kernel,
            what,
            scenes: samples.len(),
            largest_error: 0.0,
            relative_l2: 0.0,
            used: 0.0,
            bound: String::new(),
            failures: Vec::new(),
        };
        for sample in samples {
            let pairs = || sample.actual.iter().zip(&sample.expected);
            let largest = pairs().map(|(a, e)| (a - e).abs()).fold(0.0, f64::max);
            let error: f64 = pairs().map(|(a, e)| (a - e).powi(2)).sum();
            let norm: f64 = sample.expected.iter().map(|e| e * e).sum();
            row.largest_error = row.largest_error.max(largest);
            // Where nothing but zero is expected, an error has no relative size.
            if error > 0.0 && norm > 0.0 {
                row.relative_l2 = row.relative_l2.max((error / norm).sqrt());
            }
        }
        row
    }

    /// Every element within its bound.
    pub fn elementwise(
        kernel: &'static str,
        what: &'static str,
        bound: Elementwise,
        samples: &[Sample],
    ) -> Self {
        let mut row = Self::new(kernel, what, samples);
        row.bound = format!("{:.1e} + {:.1e}·abs(x)", bound.absolute, bound.relative);
        for sample in samples {
            let figures = bound.compare(&sample.actual, &sample.expected);
            row.used = row.used.max(figures.used);
            row.failures.extend(figures.check().err());
        }
        row
    }

    /// A gradient as a whole and element by element.
    pub fn gradient(
        kernel: &'static str,
        what: &'static str,
        bounds: GradientBounds,
        samples: &[Sample],
    ) -> Self {
        let mut row = Self::new(kernel, what, samples);
        row.bound = format!(
            "L2 {:.1e}; {:.1e} + {:.1e}·abs(x)",
            bounds.relative_l2, bounds.elementwise.absolute, bounds.elementwise.relative
        );
        for sample in samples {
            let figures = bounds.compare(&sample.actual, &sample.expected);
            row.used = row.used.max(figures.elementwise.used);
            row.failures.extend(figures.check().err());
        }
        row
    }

    /// A picture, whose pixels may flip where the oracle marks them.
    pub fn picture(
        kernel: &'static str,
        what: &'static str,
        bounds: FlipBounds,
        samples: &[Sample],
    ) -> Self {
        let mut row = Self::new(kernel, what, samples);
        row.bound = format!(
            "{:.1e} + {:.1e}·abs(x), flips ≤ {:.1e}",
            bounds.rest.absolute, bounds.rest.relative, bounds.cap
        );
        for sample in samples {
            let figures = bounds.compare(&sample.actual, &sample.expected, &sample.may_flip);
            row.used = row.used.max(figures.rest_used);
            row.failures.extend(figures.check().err());
        }
        row
    }
}

/// # Panics
/// When any row failed, with all that did.
pub fn assert_all(rows: &[Row]) {
    let failed: Vec<_> = (rows.iter())
        .filter(|row| !row.failures.is_empty())
        .map(|row| {
            let Row { kernel, what, .. } = row;
            format!("{kernel}, {what}: {}", row.failures.join("; "))
        })
        .collect();
    assert!(failed.is_empty(), "{}", failed.join("\n"));
}

/// The table in Markdown.
pub fn table<'a>(device: &str, rows: impl Iterator<Item = &'a Row>) -> String {
    let mut text = format!(
        "Kernels in f32 on {device} against the f64 oracle; the worst scene of each row.\n\n\
         | kernel | what | scenes | max abs error | relative L2 | bound | used |\n\
         |---|---|--:|--:|--:|---|--:|\n"
    );
    for row in rows {
        text += &format!(
            "| {} | {} | {} | {:.2e} | {:.2e} | {} | {:.3} |\n",
            row.kernel,
            row.what,
            row.scenes,
            row.largest_error,
            row.relative_l2,
            row.bound,
            row.used
        );
    }
    text
}
