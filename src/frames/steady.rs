//! Steadying along time: a film's frames differ in grain and light, and a network that sees them
//! one by one answers each otherwise.
//!
//! A recursive mean along the optical flow: each frame keeps [`KEPT`] of what the frame before
//! shows at the same point of the same thing, as far as the flow is trusted there. Where it is
//! not, as in what was hidden before, the frame's own value stands.

use super::{Between, Canvas, ColoredPhoto, WeightedColors};

/// Share of the frame before: about ten frames count.
const KEPT: f32 = 0.9;

/// Moves the colors of a frame, `own`, towards those that the frame before has there: a share of
/// `kept` where these are trusted.
pub fn steady(own: &mut [[f32; 2]], before: &WeightedColors, kept: f32) {
    for ((own, old), weight) in own.iter_mut().zip(&before.ab).zip(&before.weight) {
        *own = [0, 1].map(|k: usize| own[k] + kept * weight * (old[k] - own[k]));
    }
}

/// Colors of frame after frame of a shot without a scene.
#[derive(Default)]
pub struct Steadied {
    last: Option<(Canvas, Vec<[f32; 2]>)>,
}

impl Steadied {
    /// The next frame's a and b, `[height, width]`, by its own and the frame before.
    pub fn next(&mut self, canvas: Canvas, mut own: Vec<[f32; 2]>) -> &(Canvas, Vec<[f32; 2]>) {
        let between = self.last.as_ref().and_then(|(from, ab)| {
            let step = Between::of(from, &canvas)?;
            Some(ColoredPhoto { canvas: from, ab }.along(&[&step], false, &canvas))
        });
        if let Some(before) = between {
            steady(&mut own, &before, KEPT);
        }
        self.last.insert((canvas, own))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [96, 64];

    /// A textured ground that has moved right by `shift`; behind a cut it is another.
    fn canvas(shift: f32, is_other: bool) -> Canvas {
        let gray = |i: u32| {
            let (x, y) = ((i % SIZE[0]) as f32 - shift, (i / SIZE[0]) as f32);
            match is_other {
                false => 110.0 + 40.0 * (0.21 * x + 0.1 * y).sin() + 30.0 * (0.33 * y).cos(),
                true => 40.0 + 30.0 * (0.5 * x - 0.4 * y).sin(),
            }
        };
        Canvas {
            width: SIZE[0],
            height: SIZE[1],
            gray: (0..SIZE[0] * SIZE[1]).map(|i| gray(i) as u8).collect(),
            mask: None,
            stance: Default::default(),
        }
    }

    #[test]
    fn answers_that_flicker_are_steadied_along_the_motion_and_not_across_a_cut() {
        let mut steadied = Steadied::default();
        let mut changes = Vec::new();
        let mut last = None;
        for n in 0..12 {
            let answer = if n % 2 == 0 { 20.0 } else { 30.0 };
            let canvas = canvas(2.0 * n as f32, false);
            let own = vec![[answer, -answer]; canvas.len()];
            let (_, ab) = steadied.next(canvas, own);
            let middle = ab[32 * 96 + 60][0];
            changes.extend(last.map(|last: f32| (middle - last).abs()));
            last = Some(middle);
        }
        let late = changes[6..].iter().copied().fold(0.0, f32::max);
        assert!(late < 2.5, "{changes:?}");
        let other = canvas(0.0, true);
        let own = vec![[-50.0, 0.0]; other.len()];
        let (_, ab) = steadied.next(other, own);
        let mean = ab.iter().map(|ab| ab[0]).sum::<f32>() / ab.len() as f32;
        assert!(mean < -40.0, "{mean}");
    }
}
