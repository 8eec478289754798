//! Color difference between two pictures of one scene.

use super::flow::{Flow, sample};

/// Steps of CIELAB a, b that make the measure's unit: (x + 128) / 255 lies in [0, 1].
const LAB_STEPS: f64 = 255.0;

/// The scale in words, for reports.
pub const SCALE_RULE: &str = "a, b as (x+128)/255";

/// The denominator in words, for reports.
pub const DENOMINATOR_RULE: &str = "visible pixels × 2 channels, over all pairs";

/// Squared differences of a, b over the pixels that two pictures share.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Consistency {
    /// Sum of the squared differences in CIELAB units.
    squares: f64,
    /// Pixels compared.
    visible: u64,
    /// Pixels of the first pictures.
    pixels: u64,
    /// Pairs of pictures.
    pairs: u64,
}

impl Consistency {
    /// Adds a pair: a, b of both pictures, `[height, width]`, and which pixels of the
    /// first one are seen in the second. The second is warped back bilinearly.
    ///
    /// # Panics
    /// When sizes differ.
    pub fn add(
        &mut self,
        first: &[[f32; 2]],
        second: &[[f32; 2]],
        size: [usize; 2],
        flow: &Flow,
        visible: &[bool],
    ) {
        assert!(
            first.len() == flow.vectors.len() && visible.len() == first.len(),
            "a flow and a mask for every pixel"
        );
        assert_eq!(
            second.len(),
            size[0] * size[1],
            "a second picture of its size"
        );
        for (i, (ours, _)) in first
            .iter()
            .zip(visible)
            .enumerate()
            .filter(|(_, (_, seen))| **seen)
        {
            if let Some(theirs) = sample(second, size, flow.target(i)) {
                for (x, y) in ours.iter().zip(theirs) {
                    self.squares += (f64::from(*x) - y).powi(2);
                }
                self.visible += 1;
            }
        }
        self.pixels += first.len() as u64;
        self.pairs += 1;
    }

    /// Mean squared difference over visible pixels and both channels, a and b mapped
    /// to [0, 1] by (x + 128) / 255; none without a visible pixel.
    pub fn error(&self) -> Option<f64> {
        (self.visible > 0).then(|| self.squares / self.values() as f64 / LAB_STEPS.powi(2))
    }

    /// Its root in CIELAB units.
    pub fn rms(&self) -> Option<f64> {
        self.error().map(|error| LAB_STEPS * error.sqrt())
    }

    /// Divisor of the sum: visible pixels × 2 channels.
    pub fn values(&self) -> u64 {
        2 * self.visible
    }

    /// Share of the pixels that were compared, in [0, 1].
    pub fn visible_share(&self) -> f64 {
        self.visible as f64 / self.pixels.max(1) as f64
    }

    /// Pairs of pictures.
    pub fn pairs(&self) -> u64 {
        self.pairs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn still() -> Flow {
        Flow {
            width: 2,
            height: 2,
            vectors: vec![[0.0; 2]; 4],
        }
    }

    #[test]
    fn an_error_known_by_hand() {
        let first = [[0.0, 0.0], [10.0, 0.0], [0.0, 0.0], [50.0, 50.0]];
        let second = [[3.0, 4.0], [10.0, 0.0], [0.0, 0.0], [0.0, 0.0]];
        let mut sum = Consistency::default();
        sum.add(
            &first,
            &second,
            [2, 2],
            &still(),
            &[true, true, true, false],
        );
        // 25 over three pixels and two channels.
        let want = 25.0 / 6.0;
        assert!((sum.rms().unwrap() - f64::sqrt(want)).abs() < 1e-12);
        assert!((sum.error().unwrap() - want / 65025.0).abs() < 1e-15);
        assert_eq!((sum.values(), sum.pairs()), (6, 1));
        assert!((sum.visible_share() - 0.75).abs() < 1e-12);
        // Pairs are pooled by their pixels, not averaged.
        sum.add(&first, &first, [2, 2], &still(), &[true; 4]);
        assert!((sum.rms().unwrap() - f64::sqrt(25.0 / 14.0)).abs() < 1e-12);
        assert_eq!((sum.values(), sum.pairs()), (14, 2));
    }

    #[test]
    fn the_second_picture_is_warped() {
        // A ramp along x, half a pixel off: its value at the target is exact.
        let ramp = |from: f32| {
            [
                [from, 0.0],
                [from + 8.0, 0.0],
                [from, 0.0],
                [from + 8.0, 0.0],
            ]
        };
        let flow = Flow {
            vectors: vec![[0.5, 0.0]; 4],
            ..still()
        };
        let seen = [true, false, true, false];
        let mut right = Consistency::default();
        right.add(&ramp(4.0), &ramp(0.0), [2, 2], &flow, &seen);
        assert_eq!(right.error(), Some(0.0));
        let mut wrong = Consistency::default();
        wrong.add(&ramp(4.0), &ramp(0.0), [2, 2], &still(), &seen);
        assert!((wrong.rms().unwrap() - f64::sqrt(8.0)).abs() < 1e-12);
    }

    #[test]
    fn nothing_seen_is_no_figure() {
        let mut none = Consistency::default();
        none.add(
            &[[1.0; 2]; 4],
            &[[0.0; 2]; 4],
            [2, 2],
            &still(),
            &[false; 4],
        );
        assert_eq!((none.error(), none.rms(), none.values()), (None, None, 0));
        assert_eq!(none.visible_share(), 0.0);
    }
}
