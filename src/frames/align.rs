//! Alignment of a drawing with a photo whose pose is a guess.

use super::Canvas;

/// Reach of the search in pixels of the canvas, to each side: gate weave.
const REACH: isize = 8;

/// Steps in pixels of the search, from the coarsest. The pixels compared are as many apart, or
/// two: more tell nothing new.
const STEPS: [isize; 3] = [4, 2, 1];

/// Difference in 8-bit levels beyond which a pixel is of something else.
const UNLIKE: f32 = 32.0;

/// A photo against a drawing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Alignment {
    /// Displacement in pixels of the canvas, right and down.
    shift: [isize; 2],
    /// Lightness of the photo above the drawing, in 8-bit levels.
    pub lighter: f32,
}

impl Alignment {
    /// The displacement, within some pixels, with the least mean difference, each cut off, once
    /// the median is taken out. `drawn` is gray in 8-bit levels, `None` where nothing is drawn.
    pub fn of(drawn: &[Option<f32>], canvas: &Canvas) -> Self {
        let mut best = Self::default();
        for step in STEPS {
            let around = |k: usize| {
                let middle = best.shift[k];
                // All of the range once, then what lies between its steps.
                let reach = if step == STEPS[0] { REACH } else { step };
                (-reach..=reach)
                    .step_by(step as usize)
                    .map(move |by| middle + by)
            };
            let shifts = around(0).flat_map(|x| around(1).map(move |y| [x, y]));
            let tried = shifts.filter_map(|shift| {
                let found = Self {
                    shift,
                    lighter: 0.0,
                };
                found.compared(drawn, canvas, step.max(2) as usize)
            });
            let least = tried.min_by(|(_, a), (_, b)| a.total_cmp(b));
            best = least.map_or(best, |(found, _)| found);
        }
        best
    }

    /// The pixel of the drawing that a pixel of the photo shows, at the border the nearest.
    pub fn source(self, pixel: usize, canvas: &Canvas) -> usize {
        if self.shift == [0; 2] {
            return pixel;
        }
        let [width, height] = canvas.size();
        let moved =
            |at: usize, by: isize, length: usize| at.saturating_add_signed(-by).min(length - 1);
        let x = moved(pixel % width, self.shift[0], width);
        moved(pixel / width, self.shift[1], height) * width + x
    }

    /// The same with the photo's lightness, and the mean difference of pixels `every` apart.
    fn compared(self, drawn: &[Option<f32>], canvas: &Canvas, every: usize) -> Option<(Self, f32)> {
        let [width, height] = canvas.size();
        let rows = (0..height).step_by(every);
        let pixels = rows.flat_map(|y| (0..width).step_by(every).map(move |x| y * width + x));
        let of = |i: usize| Some(f32::from(canvas.gray[i]) - drawn[self.source(i, canvas)]?);
        let mut differences: Vec<f32> = pixels.filter_map(of).collect();
        let middle = differences.len() / 2;
        if differences.is_empty() {
            return None;
        }
        let lighter = *differences.select_nth_unstable_by(middle, f32::total_cmp).1;
        let cut_off = |by: &f32| (by - lighter).abs().min(UNLIKE);
        let mean = differences.iter().map(cut_off).sum::<f32>() / differences.len() as f32;
        Some((Self { lighter, ..self }, mean))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weave_and_flicker_are_found_beside_a_passer_by() {
        let (width, height) = (64, 48);
        let texture =
            |x: f32, y: f32| 120.0 + 40.0 * (0.3 * x + 0.2 * y).sin() + 30.0 * (0.25 * y).cos();
        let drawn: Vec<Option<f32>> = (0..width * height)
            .map(|i| (i % width > 2).then(|| texture((i % width) as f32, (i / width) as f32)))
            .collect();
        for [u, v] in [[0, 0], [5, -3], [-7, 6]] {
            let gray = |i: usize| {
                let (x, y) = ((i % width) as f32, (i / width) as f32);
                match (20.0..34.0).contains(&x) && y > 20.0 {
                    true => 10,
                    false => (texture(x - u as f32, y - v as f32) + 12.0) as u8,
                }
            };
            let canvas = Canvas {
                width: width as u32,
                height: height as u32,
                gray: (0..width * height).map(gray).collect(),
                mask: None,
                stance: Default::default(),
            };
            let found = Alignment::of(&drawn, &canvas);
            assert_eq!(found.shift, [u, v]);
            assert!((found.lighter - 12.0).abs() < 1.5, "{}", found.lighter);
            assert_eq!(
                Alignment::of(&vec![None; drawn.len()], &canvas),
                Alignment::default()
            );
        }
    }
}
