//! Measured errors: each row is one quantity of one kernel over several inputs.

use std::fmt::Write;

use serde::Serialize;

use crate::{
    compare::{Elementwise, FlipBounds, GradientBounds},
    gpu::Gpu,
};

/// Pixels whose decisions are closer than this to falling the other way may do so in `f32`.
pub const MARGIN: f64 = 1e-4;

/// What a bound leaves above the worst that was seen. The figures in the tables
/// were seen on Mesa 22.3's llvmpipe; WGSL allows `exp`, `sqrt` and quotients
/// several units in the last place, of which other drivers make other use.
pub fn headroom(gpu: &Gpu) -> f64 {
    let measured = gpu.is_software() && gpu.info().driver_info.contains("Mesa 22.3");
    if measured { 1.05 } else { 16.0 }
}

/// What a kernel gave and what the oracle says, of one input.
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

/// Bounds as the worst errors seen on the reference device, with the headroom
/// that the present one is given.
#[derive(Clone, Copy, Debug)]
pub struct Allowance(f64);

impl Allowance {
    /// What this device is allowed.
    pub fn of(gpu: &Gpu) -> Self {
        Self(headroom(gpu))
    }

    /// Errors up to `worst · (scale + |x|)` were seen: relative ones, floored at a
    /// typical size of the quantity.
    pub fn relative(self, worst: f64, scale: f64) -> Elementwise {
        let unit = worst * self.0;
        Elementwise {
            absolute: unit * scale,
            relative: unit,
        }
    }

    /// Bounds on a gradient of which this relative L2 error was seen; angle and
    /// bias have to be as small as it makes them.
    pub fn gradient(self, worst_l2: f64, elements: Elementwise) -> GradientBounds {
        let relative_l2 = worst_l2 * self.0;
        GradientBounds {
            elementwise: elements,
            relative_l2,
            // 1 - cos φ is about φ²/2, and φ is at most the relative error.
            cosine: 0.51 * relative_l2 * relative_l2,
            // In L1 norms, in which small elements weigh more.
            signed_bias: 2.0 * relative_l2,
        }
    }
}

/// One line of the table: the worst of its inputs, and whether all passed.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Name of the kernel, as in `shaders/`.
    pub kernel: &'static str,
    /// The quantity, with its unit.
    pub what: &'static str,
    /// Inputs it was measured on.
    pub inputs: usize,
    /// Largest absolute error.
    pub largest_error: f64,
    /// Largest relative L2 error.
    pub relative_l2: f64,
    /// How much of the bound was used, at most 1.
    pub used: f64,
    /// The bound in words.
    pub bound: String,
    /// What is wrong, if anything is.
    pub failures: Vec<String>,
}

impl Row {
    fn new(kernel: &'static str, what: &'static str, samples: &[Sample]) -> Self {
        let mut row = Self {
            kernel,
            what,
            inputs: samples.len(),
            largest_error: 0.0,
            relative_l2: 0.0,
            used: 0.0,
            bound: String::new(),
            failures: Vec::new(),
        };
        if samples.is_empty() {
            row.failures.push("nothing to compare".to_owned());
        }
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

    /// Integers, which are right or wrong.
    pub fn exact(kernel: &'static str, what: &'static str, samples: &[Sample]) -> Self {
        let bound = Elementwise {
            absolute: 0.0,
            relative: 0.0,
        };
        let mut row = Self::elementwise(kernel, what, bound, samples);
        "exact".clone_into(&mut row.bound);
        row
    }
}

/// The rows as a Markdown table.
pub fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "| kernel | what | inputs | largest error | relative L2 | bound | used | verdict |\n\
         |---|---|--:|--:|--:|---|--:|---|\n",
    );
    for row in rows {
        let verdict = match row.failures.as_slice() {
            [] => "holds".to_owned(),
            failures => failures.join("; "),
        };
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {} | {} | {} | {:.2e} | {:.2e} | {} | {:.3} | {verdict} |",
            row.kernel,
            row.what,
            row.inputs,
            row.largest_error,
            row.relative_l2,
            row.bound,
            row.used,
        );
    }
    text
}
