//! A bound on every element.

use super::unfit;

/// `|actual - expected| <= absolute + relative · |expected|`.
#[derive(Clone, Copy, Debug)]
pub struct Elementwise {
    /// Allowed at an expected zero.
    pub absolute: f64,
    /// Allowed in addition, per unit of the expected value.
    pub relative: f64,
}

/// The worst element of a comparison.
#[derive(Clone, Debug)]
pub struct ElementwiseFigures {
    /// Reason why nothing could be compared, if any.
    pub unfit: Option<String>,
    /// Bound on each element.
    pub bound: Elementwise,
    /// Index of the element that uses most of its bound.
    pub worst: usize,
    /// Computed value there.
    pub actual: f64,
    /// Expected value there.
    pub expected: f64,
    /// Error over allowance there; the comparison passes up to 1.
    pub used: f64,
    /// The largest absolute error anywhere.
    pub largest_error: f64,
}

impl Elementwise {
    /// Error over allowance of one pair; infinite where nothing is allowed,
    /// or where a value is not finite.
    pub fn used(&self, actual: f64, expected: f64) -> f64 {
        let error = (actual - expected).abs();
        if error == 0.0 {
            return 0.0;
        }
        let used = error / (self.absolute + self.relative * expected.abs());
        if used.is_nan() { f64::INFINITY } else { used }
    }

    /// Compares two arrays.
    pub fn compare(&self, actual: &[f64], expected: &[f64]) -> ElementwiseFigures {
        let mut figures = ElementwiseFigures {
            unfit: unfit(actual, expected),
            bound: *self,
            worst: 0,
            actual: 0.0,
            expected: 0.0,
            used: -1.0,
            largest_error: 0.0,
        };
        for (index, (&a, &e)) in actual.iter().zip(expected).enumerate() {
            let used = self.used(a, e);
            figures.largest_error = figures.largest_error.max((a - e).abs());
            if used > figures.used {
                figures.worst = index;
                (figures.actual, figures.expected, figures.used) = (a, e, used);
            }
        }
        figures
    }
}

impl ElementwiseFigures {
    /// Passes if every element is within its bound.
    ///
    /// # Errors
    /// One line with the worst element.
    pub fn check(&self) -> Result<(), String> {
        if let Some(reason) = &self.unfit {
            return Err(format!("elementwise: {reason}"));
        }
        if self.used <= 1.0 {
            return Ok(());
        }
        Err(format!(
            "elementwise: [{}] = {:e} instead of {:e}, {:.3} times the bound of {:e} + {:e}·|x|",
            self.worst,
            self.actual,
            self.expected,
            self.used,
            self.bound.absolute,
            self.bound.relative
        ))
    }
}
