//! Comparators of gradients as a whole.

use super::{Elementwise, ElementwiseFigures, unfit};

/// One figure against its tolerance.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Name of the figure.
    pub name: &'static str,
    /// Reason why nothing could be compared, if any.
    pub unfit: Option<String>,
    /// The figure; zero is best.
    pub value: f64,
    /// The largest value that passes.
    pub tolerance: f64,
}

impl Figure {
    /// Passes up to the tolerance.
    ///
    /// # Errors
    /// One line with the figure.
    pub fn check(&self) -> Result<(), String> {
        let Self {
            name,
            value,
            tolerance,
            ..
        } = self;
        match &self.unfit {
            Some(reason) => Err(format!("{name}: {reason}")),
            None if value.abs() <= *tolerance => Ok(()),
            None => Err(format!("{name}: {value:e} exceeds {tolerance:e}")),
        }
    }
}

fn sum(terms: impl Iterator<Item = f64>) -> f64 {
    terms.sum()
}

/// A quotient in which 0/0 is agreement and x/0 is not.
fn quotient(numerator: f64, denominator: f64) -> f64 {
    if numerator == 0.0 {
        0.0
    } else {
        numerator / denominator
    }
}

/// `‖actual - expected‖ / ‖expected‖`.
pub fn relative_l2(actual: &[f64], expected: &[f64], tolerance: f64) -> Figure {
    let error = sum((actual.iter().zip(expected)).map(|(a, e)| (a - e).powi(2)));
    let norm = sum(expected.iter().map(|e| e * e));
    Figure {
        name: "relative L2",
        unfit: unfit(actual, expected),
        value: quotient(error.sqrt(), norm.sqrt()),
        tolerance,
    }
}

/// One minus the cosine of the angle between the two. Blind to length by
/// nature: use it beside [`relative_l2`] or [`signed_bias`].
///
/// Computed as half the squared distance of the unit vectors: `1 - a·e`
/// would lose small angles to rounding.
pub fn cosine(actual: &[f64], expected: &[f64], tolerance: f64) -> Figure {
    let norm = |values: &[f64]| sum(values.iter().map(|v| v * v)).sqrt();
    let (length_a, length_e) = (norm(actual), norm(expected));
    let value = if length_a == 0.0 && length_e == 0.0 {
        0.0
    } else if length_a == 0.0 || length_e == 0.0 {
        1.0
    } else {
        0.5 * sum((actual.iter().zip(expected)).map(|(a, e)| (a / length_a - e / length_e).powi(2)))
    };
    Figure {
        name: "1 - cosine",
        unfit: unfit(actual, expected),
        value,
        tolerance,
    }
}

/// Errors that do not average out.
#[derive(Clone, Debug)]
pub struct BiasFigures {
    /// `Σ(a - e) / Σ|e|`: the mean error in units of the mean magnitude.
    pub offset: Figure,
    /// `Σ(a - e)·e / Σe²`: what the best-fitting factor exceeds one by.
    pub gain: Figure,
}

impl BiasFigures {
    /// Passes if neither figure exceeds its tolerance, on either side.
    ///
    /// # Errors
    /// One line with the first figure that does.
    pub fn check(&self) -> Result<(), String> {
        self.offset.check()?;
        self.gain.check()
    }
}

/// Signed bias of the errors, as an offset and as a factor.
pub fn signed_bias(actual: &[f64], expected: &[f64], tolerance: f64) -> BiasFigures {
    let pairs = || actual.iter().zip(expected);
    let figure = |name, value| Figure {
        name,
        unfit: unfit(actual, expected),
        value,
        tolerance,
    };
    let offset = quotient(
        sum(pairs().map(|(a, e)| a - e)),
        sum(expected.iter().map(|e| e.abs())),
    );
    let gain = quotient(
        sum(pairs().map(|(a, e)| (a - e) * e)),
        sum(expected.iter().map(|e| e * e)),
    );
    BiasFigures {
        offset: figure("signed bias, offset", offset),
        gain: figure("signed bias, gain", gain),
    }
}

/// The bounds a gradient has to meet, all of them.
#[derive(Clone, Copy, Debug)]
pub struct GradientBounds {
    /// On each element.
    pub elementwise: Elementwise,
    /// On [`relative_l2`].
    pub relative_l2: f64,
    /// On [`cosine`], that is on one minus it.
    pub cosine: f64,
    /// On both figures of [`signed_bias`].
    pub signed_bias: f64,
}

/// Results of [`GradientBounds::compare`].
#[derive(Clone, Debug)]
pub struct GradientFigures {
    /// The worst element.
    pub elementwise: ElementwiseFigures,
    /// Relative L2 error.
    pub relative_l2: Figure,
    /// One minus the cosine.
    pub cosine: Figure,
    /// Offset and gain.
    pub signed_bias: BiasFigures,
}

impl GradientBounds {
    /// Compares two gradients in every way.
    pub fn compare(&self, actual: &[f64], expected: &[f64]) -> GradientFigures {
        GradientFigures {
            elementwise: self.elementwise.compare(actual, expected),
            relative_l2: relative_l2(actual, expected, self.relative_l2),
            cosine: cosine(actual, expected, self.cosine),
            signed_bias: signed_bias(actual, expected, self.signed_bias),
        }
    }
}

impl GradientFigures {
    /// Passes if every comparator does.
    ///
    /// # Errors
    /// The lines of all that do not.
    pub fn check(&self) -> Result<(), String> {
        let failures: Vec<_> = [
            self.elementwise.check(),
            self.relative_l2.check(),
            self.cosine.check(),
            self.signed_bias.check(),
        ]
        .into_iter()
        .filter_map(Result::err)
        .collect();
        if failures.is_empty() {
            Ok(())
        } else {
            Err(failures.join("; "))
        }
    }
}
