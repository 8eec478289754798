//! Measured errors: each row is one quantity of one kernel over several inputs.

use std::fmt::Write;

use serde::Serialize;

use crate::{
    compare::{Elementwise, FlipBounds, GradientBounds},
    gpu::{Gpu, GpuError},
};

/// Pixels whose decisions are closer than this to falling the other way may do so in `f32`.
pub const MARGIN: f64 = 1e-4;

/// Factor of a bound over the worst error seen. The figures in the tables were seen on Mesa 22.3's
/// llvmpipe; WGSL allows `exp`, `sqrt` and quotients several units in the last place, of which
/// other drivers make other use.
pub fn headroom(gpu: &Gpu) -> f64 {
    let measured = gpu.is_software() && gpu.info().driver_info.contains("Mesa 22.3");
    if measured { 1.05 } else { 16.0 }
}

/// Values of a kernel and of the oracle for one input.
pub struct Sample {
    /// The kernel's values.
    pub actual: Vec<f64>,
    /// The oracle's values.
    pub expected: Vec<f64>,
    /// True for values close to a discontinuity; empty where none can be.
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
    /// Bounds for this device.
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

    /// A row of values whose worst error was `worst · (scale + |x|)`.
    pub fn values(
        self,
        kernel: &'static str,
        what: impl Into<String>,
        [worst, scale]: [f64; 2],
        samples: &[Sample],
    ) -> Row {
        Row::elementwise(kernel, what, self.relative(worst, scale), samples)
    }

    /// A row of gradients of which the relative L2 error `l2` was seen, and of an element
    /// `worst · (scale + |x|)`; angle and bias have to be as small as `l2` makes them.
    pub fn gradients(
        self,
        kernel: &'static str,
        what: impl Into<String>,
        [l2, worst, scale]: [f64; 3],
        samples: &[Sample],
    ) -> Row {
        let relative_l2 = l2 * self.0;
        let bounds = GradientBounds {
            elementwise: self.relative(worst, scale),
            relative_l2,
            // 1 - cos φ is about φ²/2, and φ is at most the relative error.
            cosine: 0.51 * relative_l2 * relative_l2,
            // In L1 norms, in which small elements weigh more.
            signed_bias: 2.0 * relative_l2,
        };
        let elementwise = bounds.elementwise;
        let bound = format!(
            "L2 {:.1e}; {:.1e} + {:.1e}·abs(x)",
            bounds.relative_l2, elementwise.absolute, elementwise.relative
        );
        Row::judged(kernel, what, bound, samples, |sample| {
            let figures = bounds.compare(&sample.actual, &sample.expected);
            (figures.elementwise.used, figures.check())
        })
    }

    /// Rows of gradients by group, of which these errors were seen: of the whole, and of an
    /// element of size 1.
    pub fn groups(
        self,
        kernel: &'static str,
        seen: &[[f64; 2]],
        groups: impl IntoIterator<Item = (&'static str, Vec<Sample>)>,
    ) -> Vec<Row> {
        (groups.into_iter().zip(seen))
            .map(|((name, samples), &[l2, worst])| {
                self.gradients(kernel, name, [l2, worst, 1.0], &samples)
            })
            .collect()
    }
}

/// Samples by quantity, of inputs that each give one of every quantity.
///
/// # Errors
/// The first input's that has one.
pub fn by_quantity<const N: usize>(
    inputs: impl IntoIterator<Item = Result<[Sample; N], GpuError>>,
) -> Result<[Vec<Sample>; N], GpuError> {
    let mut quantities = [const { Vec::new() }; N];
    for input in inputs {
        for (samples, sample) in quantities.iter_mut().zip(input?) {
            samples.push(sample);
        }
    }
    Ok(quantities)
}

/// Samples by name, in the order in which names came first.
pub type Groups = Vec<(&'static str, Vec<Sample>)>;

/// Adds samples to those of the same name.
pub fn add(groups: &mut Groups, name: &'static str, samples: impl IntoIterator<Item = Sample>) {
    match groups.iter_mut().find(|(known, _)| *known == name) {
        Some((_, known)) => known.extend(samples),
        None => groups.push((name, samples.into_iter().collect())),
    }
}

/// One line of the table: the worst of its inputs, and whether all passed.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Name of the kernel, as in `shaders/`.
    pub kernel: &'static str,
    /// The quantity, with its unit.
    pub what: String,
    /// Inputs it was measured on.
    pub inputs: usize,
    /// Largest absolute error.
    pub largest_error: f64,
    /// Largest relative L2 error.
    pub relative_l2: f64,
    /// Share of the bound that was used, at most 1.
    pub used: f64,
    /// The bound in words.
    pub bound: String,
    /// Failures, if any.
    pub failures: Vec<String>,
}

impl Row {
    /// `judge` says how much of the bound a sample used, and what is wrong with it.
    fn judged(
        kernel: &'static str,
        what: impl Into<String>,
        bound: String,
        samples: &[Sample],
        judge: impl Fn(&Sample) -> (f64, Result<(), String>),
    ) -> Self {
        let mut row = Self {
            kernel,
            what: what.into(),
            inputs: samples.len(),
            largest_error: 0.0,
            relative_l2: 0.0,
            used: 0.0,
            bound,
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
            let (used, checked) = judge(sample);
            row.used = row.used.max(used);
            row.failures.extend(checked.err());
        }
        row
    }

    /// Every element within its bound.
    fn elementwise(
        kernel: &'static str,
        what: impl Into<String>,
        bound: Elementwise,
        samples: &[Sample],
    ) -> Self {
        let words = format!("{:.1e} + {:.1e}·abs(x)", bound.absolute, bound.relative);
        Self::judged(kernel, what, words, samples, |sample| {
            let figures = bound.compare(&sample.actual, &sample.expected);
            (figures.used, figures.check())
        })
    }

    /// A picture, whose pixels may flip where the oracle marks them.
    pub fn picture(
        kernel: &'static str,
        what: impl Into<String>,
        bounds: FlipBounds,
        samples: &[Sample],
    ) -> Self {
        let words = format!(
            "{:.1e} + {:.1e}·abs(x), flips ≤ {:.1e}",
            bounds.rest.absolute, bounds.rest.relative, bounds.cap
        );
        Self::judged(kernel, what, words, samples, |sample| {
            let figures = bounds.compare(&sample.actual, &sample.expected, &sample.may_flip);
            (figures.rest_used, figures.check())
        })
    }

    /// Integers, which are right or wrong.
    pub fn exact(kernel: &'static str, what: &'static str, samples: &[Sample]) -> Self {
        let bound = Elementwise {
            absolute: 0.0,
            relative: 0.0,
        };
        Self {
            bound: "exact".to_owned(),
            ..Self::elementwise(kernel, what, bound, samples)
        }
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
