//! Colors as strong as the teacher's.
//!
//! A scene that is a little blurred, and whose views want different colors of one place, shows
//! the middle of what is wanted: paler than any of it. One factor for all colors makes up for
//! that, as far as the teacher's strength is no contradiction: by how much its pictures are
//! more colorful than the scene's from the same views, times the share of their strength that
//! views agree on.

use std::ops::ControlFlow;

use super::{ChromaError, Targets, Task, field::FrozenField};
use crate::splats::{ShField, sh};

/// Views that are looked at, at most: the factor is one number.
const VIEWS: usize = 16;

/// The largest factor. What lacks more lacks it in places that one factor does not mend, and
/// the others pay for it.
const MOST: f64 = 1.25;

/// Views that agree on this share agree on all: even photos, which contradict each other in
/// nothing, show a point's neighbors in part, and agree on 0.95 to 0.99; a real network on 0.91
/// to 0.97, one with casts and patches on half.
const STEADY: f64 = 0.9;

/// Multiplies the colors by what they lack of the teachers' strength, 1 to 1.25, and says by how
/// much. `agreed` is the share of the mean square of the teachers' a and b that views agree
/// on, 0 to 1; `observe` hears how many of how many views are compared.
///
/// # Errors
/// [`ChromaError::Gpu`], [`ChromaError::Spill`], [`ChromaError::Cancelled`].
pub fn match_saturation(
    frozen: &dyn FrozenField,
    targets: &Targets,
    tasks: &[Task],
    agreed: f64,
    chroma: &mut ShField,
    observe: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<f64, ChromaError> {
    let colors = frozen.colors(chroma)?;
    let mut whole = ShField::zeros(frozen.primitives().count(), 0, 2);
    whole.coefficients.fill((1.0 / sh::C0) as f32);
    let opacity = frozen.colors(&whole)?;
    let (mut wanted, mut shown) = (0.0, 0.0);
    let step = tasks.len().div_ceil(VIEWS).max(1);
    let total = tasks.len().div_ceil(step);
    for (view, task) in tasks.iter().step_by(step).enumerate() {
        if observe(view, total).is_break() {
            return Err(ChromaError::Cancelled);
        }
        let pictures = frozen.draw(task.view, &[&colors, &opacity])?;
        let target = targets.read(task.target, 0)?;
        let ab = target.ab().ab;
        let pixels = |picture: usize| pictures[picture].pixels.as_chunks::<2>().0;
        let drawn = pixels(0).iter().zip(pixels(1));
        let (mut teachers, mut scenes) = (Moments::default(), Moments::default());
        for (i, ((own, opacity), ab)) in drawn.zip(&ab).enumerate() {
            let weight = target.weights.as_ref().map_or(1.0, |weights| weights[i]);
            let weight = f64::from(weight.min(1.0) * opacity[0]);
            teachers.add(weight, *ab);
            scenes.add(weight, *own);
        }
        wanted += teachers.colorfulness();
        shown += scenes.colorfulness();
    }
    let factor = factor(wanted, shown, agreed);
    for coefficient in &mut chroma.coefficients {
        *coefficient = (f64::from(*coefficient) * factor) as f32;
    }
    Ok(factor)
}

/// Weighted sums of a picture's a and b, in CIELAB units.
#[derive(Default)]
struct Moments {
    weight: f64,
    sums: [f64; 2],
    squares: [f64; 2],
}

impl Moments {
    fn add(&mut self, weight: f64, ab: [f32; 2]) {
        self.weight += weight;
        for (channel, value) in ab.map(f64::from).into_iter().enumerate() {
            self.sums[channel] += weight * value;
            self.squares[channel] += weight * value * value;
        }
    }

    /// The standard deviation over the picture and 0.37 of the mean's distance from gray: the
    /// first measure of Hasler and Süsstrunk, "Measuring colourfulness in natural images"
    /// (2003). A root mean square would count what all of a picture has in common alike, and
    /// compromises keep that.
    fn colorfulness(&self) -> f64 {
        if self.weight <= 0.0 {
            return 0.0;
        }
        let mean = self.sums.map(|sum| sum / self.weight);
        let variance = |c: usize| (self.squares[c] / self.weight - mean[c] * mean[c]).max(0.0);
        (variance(0) + variance(1)).sqrt() + 0.37 * mean[0].hypot(mean[1])
    }
}

/// From the colorfulness of what is wanted and of what is shown.
fn factor(wanted: f64, shown: f64, agreed: f64) -> f64 {
    let agreed = (agreed / STEADY).min(1.0);
    let factor = wanted * agreed.sqrt() / shown;
    // Nothing is made of a gray scene, whatever is wanted of it.
    if shown > 0.0 && factor.is_finite() {
        factor.clamp(1.0, MOST)
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_lacking_and_agreed_on() {
        for (wanted, shown, agreed, expected) in [
            (1.1, 1.0, 1.0, 1.1),
            (1.1, 1.0, 0.9, 1.1),
            (1.1, 1.0, 0.9 / 1.21, 1.0),
            (1.0, 1.2, 1.0, 1.0),
            (3.0, 1.0, 1.0, MOST),
            (1.0, 0.0, 1.0, 1.0),
            (0.0, 0.0, 1.0, 1.0),
            (f64::NAN, 1.0, 1.0, 1.0),
            (1.0, 1.0, 0.0, 1.0),
        ] {
            let found = factor(wanted, shown, agreed);
            assert!((found - expected).abs() < 1e-12, "{found}, not {expected}");
        }
    }

    #[test]
    fn what_varies_counts_for_more_than_the_mean() {
        let of = |values: [(f64, [f32; 2]); 3]| {
            let mut moments = Moments::default();
            for (weight, ab) in values {
                moments.add(weight, ab);
            }
            moments.colorfulness()
        };
        let nothing = (0.0, [90.0, -90.0]);
        assert_eq!(of([nothing; 3]), 0.0);
        assert!((of([(1.0, [3.0, 4.0]), (2.0, [3.0, 4.0]), nothing]) - 0.37 * 5.0).abs() < 1e-9);
        assert!((of([(1.0, [3.0, 4.0]), (1.0, [-3.0, -4.0]), nothing]) - 5.0).abs() < 1e-9);
    }
}
