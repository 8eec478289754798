//! Bounds of a network's answers.

use super::profile::{OutputKind, Profile};

/// Beyond this no CIELAB a or b is: those of monochromatic light stay below 200.
pub(super) const AB_MOST: f32 = 256.0;

impl Profile {
    /// True if an output value is plausible: a or b of some color, or RGB at most one range width
    /// outside of its range.
    pub fn can_be(&self, value: f32) -> bool {
        let [black, white] = self.output_range;
        match self.output {
            OutputKind::Ab => self.ab(value).abs() <= AB_MOST,
            OutputKind::Rgb => (-1.0..=2.0).contains(&((value - black) / (white - black))),
        }
    }
}
