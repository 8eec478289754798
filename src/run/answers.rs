//! Combined colors of several teachers and hints for one photo.

use crate::chroma::{
    ViewTarget,
    teacher::{AbImage, HintImage},
};

/// Weight of a painted pixel, relative to 1 for a teacher's: more than the views that see the same
/// place from elsewhere and disagree, seldom more than a few dozen.
pub const HINT_WEIGHT: f32 = 50.0;

/// The mean of several answers of one size by their weights.
pub(super) fn mean(answers: Vec<(AbImage, f32)>) -> Option<AbImage> {
    let total: f64 = answers.iter().map(|(_, weight)| f64::from(*weight)).sum();
    let shares = answers.into_iter();
    let shares = shares.map(|(answer, weight)| (answer, (f64::from(weight) / total) as f32));
    shares
        .map(|(answer, share)| scaled(answer, share))
        .reduce(|mut sum, answer| {
            for (sum, ab) in sum.ab.iter_mut().zip(&answer.ab) {
                *sum = [sum[0] + ab[0], sum[1] + ab[1]];
            }
            sum
        })
}

/// Its a and b times `strength`.
pub(super) fn scaled(mut answer: AbImage, strength: f32) -> AbImage {
    answer
        .ab
        .iter_mut()
        .for_each(|ab| *ab = ab.map(|value| value * strength));
    answer
}

/// An answer with strokes of its size that are to grow, or strokes alone.
pub(super) fn with_strokes(answer: Option<AbImage>, strokes: HintImage) -> ViewTarget {
    let unknown = || {
        let count = strokes.paint.len();
        let ab = AbImage {
            width: strokes.width,
            height: strokes.height,
            ab: vec![[0.0; 2]; count],
        };
        (ab, Some(vec![0.0; count]))
    };
    let (ab, weights) = answer.map_or_else(unknown, |ab| (ab, None));
    ViewTarget {
        ab,
        weights,
        strokes: Some(strokes),
        by_hand: true,
    }
}

/// Lays paint of the photo's size over an answer. Each pixel is the mean of the
/// teachers' answer, of weight 1 − α (0 without one), and the paint, of weight
/// α · [`HINT_WEIGHT`]; it counts as much as both.
pub(super) fn with_hints(answer: Option<AbImage>, hints: &HintImage) -> ViewTarget {
    let known = f32::from(answer.is_some());
    let mut answer = answer.unwrap_or_else(|| AbImage {
        width: hints.width,
        height: hints.height,
        ab: vec![[0.0; 2]; hints.paint.len()],
    });
    let mut weights = Vec::with_capacity(hints.paint.len());
    for (ab, &[a, b, alpha]) in answer.ab.iter_mut().zip(&hints.paint) {
        let teachers = known * (1.0 - alpha);
        let weight = teachers + HINT_WEIGHT * alpha;
        if weight > 0.0 {
            let paint = [a, b];
            *ab = [0, 1].map(|c: usize| (teachers * ab[c] + HINT_WEIGHT * paint[c]) / weight);
        }
        weights.push(weight);
    }
    ViewTarget {
        weights: Some(weights),
        by_hand: true,
        ..answer.into()
    }
}

/// Returns true if an image has no color.
pub(super) fn is_gray(answer: &AbImage) -> bool {
    let gray = |ab: &[f32; 2]| ab.iter().all(|value| value.abs() < GRAY);
    answer.ab.iter().all(gray)
}

/// True if a picture has a single color, gray or another.
pub(super) fn is_plain(answer: &AbImage) -> bool {
    let first = answer.ab.first().copied().unwrap_or_default();
    let near = |ab: &[f32; 2]| (0..2).all(|c| (ab[c] - first[c]).abs() < GRAY);
    answer.ab.iter().all(near)
}

/// Sizes of a and b, in CIELAB units, that no picture in color stays below.
const GRAY: f32 = 1.0;

#[cfg(test)]
mod tests {
    use super::*;

    fn image(ab: &[[f32; 2]]) -> AbImage {
        AbImage {
            width: ab.len() as u32,
            height: 1,
            ab: ab.to_vec(),
        }
    }

    /// Paint of a 40, b −10 at each α.
    fn paint(alphas: &[f32]) -> HintImage {
        HintImage {
            width: alphas.len() as u32,
            height: 1,
            paint: alphas
                .iter()
                .map(|&alpha| [40.0 * alpha, -10.0 * alpha, alpha])
                .collect(),
        }
    }

    #[test]
    fn answers_are_averaged_by_weight() {
        assert_eq!(mean(Vec::new()), None);
        let one = image(&[[10.0, -20.0]]);
        assert_eq!(mean(vec![(one.clone(), 3.0)]), Some(one.clone()));
        let both = mean(vec![(one, 3.0), (image(&[[-10.0, 20.0]]), 1.0)]);
        assert_eq!(both, Some(image(&[[5.0, -10.0]])));
        // The sum of these weights is no f32.
        let large = vec![
            (image(&[[4.0, 2.0]]), f32::MAX),
            (image(&[[8.0, 4.0]]), f32::MAX),
        ];
        assert_eq!(mean(large), Some(image(&[[6.0, 3.0]])));
    }

    #[test]
    fn strength_scales_answers() {
        assert_eq!(scaled(image(&[[10.0, -20.0]]), 0.25), image(&[[2.5, -5.0]]));
        assert_eq!(scaled(image(&[[10.0, -20.0]]), 0.0).ab, [[0.0; 2]]);
    }

    #[test]
    fn paint_outweighs_the_teacher_where_it_is_opaque() {
        let answer = image(&[[8.0, 8.0]; 3]);
        let taught = with_hints(Some(answer), &paint(&[0.0, 1.0, 0.5]));
        assert_eq!(taught.ab.ab[..2], [[8.0, 8.0], [40.0, -10.0]]);
        // (0.5 · 8 + 25 · 40) / 25.5
        assert!((taught.ab.ab[2][0] - 39.372_55).abs() < 1e-4);
        assert_eq!(taught.weights, Some(vec![1.0, 50.0, 25.5]));
    }

    #[test]
    fn without_a_teacher_only_paint_counts() {
        let taught = with_hints(None, &paint(&[0.0, 1.0, 0.5]));
        assert_eq!(taught.weights, Some(vec![0.0, 50.0, 25.0]));
        assert_eq!(taught.ab.ab[0], [0.0; 2]);
        assert_eq!(taught.ab.ab[1], [40.0, -10.0]);
        assert!((taught.ab.ab[2][0] - 40.0).abs() < 1e-4);
    }
}
