//! Strokes on what the scene does not show: the sky, or what has moved.
//!
//! On the photo a stroke claims what it touches and is alike, as strokes on the scene do, and ends
//! where the scene begins. From photo to photo the claim follows what moves, and is drawn anew
//! along the edges there: what comes into the picture beside it belongs to it, and nothing blurs.

use super::{Between, Canvas, ColoredPhoto, WeightedColors};
use crate::{
    chroma::{at_middle_lightness, claimed_by_strokes, shaded_at, teacher::HintImage},
    color::gray_to_lightness,
};

/// Weight of a pixel from which on the photo shows the scene there.
const COVERED: f32 = 0.5;

/// Depths, in any unit, of what the scene shows and of what it does not: an edge to strokes.
const DEPTHS: [f32; 2] = [1.0, 2.0];

/// A claim that is carried belongs to the thing from this share of its strength on.
const SURE: f32 = 0.5;

/// So many pixels from an edge fronts stop: what is around them is half another thing.
const RIM: usize = 2;

/// Neighboring pixels of one thing differ by less, in units of `L*`.
const ALIKE: f32 = 4.0;

/// Claims of strokes on a photo at working size.
#[derive(Clone, Debug, PartialEq)]
pub struct Strokes {
    /// a and b at the middle lightness, rounded, `[height, width]`.
    colors: Vec<[i8; 2]>,
    /// α of each pixel in 255ths.
    alphas: Vec<u8>,
}

impl Strokes {
    /// Claims of paint on a photo of which `seen` is the scene: none where the scene is believed,
    /// and with `grow` what is alike beside a stroke.
    pub fn of(canvas: &Canvas, seen: &WeightedColors, paint: &HintImage, grow: bool) -> Self {
        let paint = paint.resized(canvas.width, canvas.height);
        let lightness = lightness(canvas);
        let mut claims = match grow {
            // What a stroke is on tells what is alike, also where the scene shows it.
            true => grown(canvas, seen, &lightness, &paint),
            false => (paint.colors().zip(&lightness))
                .map(|((color, alpha), &light)| {
                    let [a, b] = at_middle_lightness(color, light);
                    [alpha * a, alpha * b, alpha]
                })
                .collect(),
        };
        for (claim, &covered) in claims.iter_mut().zip(&seen.weight) {
            if covered >= COVERED {
                *claim = [0.0; 3];
            }
        }
        Self::new(&claims)
    }

    /// Strokes from α a, α b, α.
    fn new(claims: &[[f32; 3]]) -> Self {
        let byte = |value: f32| value.round().clamp(-128.0, 127.0) as i8;
        Self {
            colors: (claims.iter())
                .map(|&[a, b, alpha]| match alpha > 0.0 {
                    true => [byte(a / alpha), byte(b / alpha)],
                    false => [0; 2],
                })
                .collect(),
            alphas: (claims.iter())
                .map(|claim| (255.0 * claim[2]).round().clamp(0.0, 255.0) as u8)
                .collect(),
        }
    }

    /// Share of the photo that is claimed.
    pub fn share(&self) -> f64 {
        let sum: f64 = self.alphas.iter().map(|&alpha| f64::from(alpha)).sum();
        sum / (255.0 * self.alphas.len().max(1) as f64)
    }

    /// Their claims on the photo `to`, of which `seen` is the scene: it comes after `from`, on
    /// which they are, by `way`, in order, or, with `backwards`, before it.
    pub fn carried(
        &self,
        from: &Canvas,
        way: &[&Between],
        backwards: bool,
        (to, seen): (&Canvas, &WeightedColors),
    ) -> Self {
        let along = |ab: &[[f32; 2]]| ColoredPhoto { canvas: from, ab }.along(way, backwards, to);
        let colors: Vec<[f32; 2]> = self.colors.iter().map(|c| c.map(f32::from)).collect();
        let alphas: Vec<[f32; 2]> = (self.alphas.iter())
            .map(|&alpha| [f32::from(alpha) / 255.0, 0.0])
            .collect();
        let (colors, alphas) = (along(&colors), along(&alphas));
        let strength = f32::from(self.alphas.iter().copied().max().unwrap_or(0)) / 255.0;
        let sure: Vec<bool> = (alphas.ab.iter().zip(&alphas.weight))
            .map(|([alpha, _], weight)| strength > 0.0 && alpha * weight >= SURE * strength)
            .collect();
        let lightness = lightness(to);
        let paint = (0..to.len()).map(|i| {
            if !inside(&sure, to.size(), i) || seen.weight[i] >= COVERED {
                return [0.0; 3];
            }
            // As light as the pixel, and no less colorful: it is no color to be shown.
            let [a, b] = colors.ab[i].map(|value| value / middle_over(lightness[i]));
            [strength * a, strength * b, strength]
        });
        let paint = HintImage {
            width: to.width,
            height: to.height,
            paint: paint.collect(),
        };
        Self::new(&grown(to, seen, &lightness, &paint))
    }

    /// The colors of a photo with strokes laid over what the scene, `seen`, leaves open.
    pub fn over(&self, canvas: &Canvas, seen: &WeightedColors, ab: &[[f32; 2]]) -> Vec<[f32; 2]> {
        let lightness = lightness(canvas);
        (0..ab.len())
            .map(|i| {
                let share = f32::from(self.alphas[i]) / 255.0 * (1.0 - seen.weight[i]);
                if share <= 0.0 {
                    return ab[i];
                }
                let color = shaded_at(self.colors[i].map(f32::from), lightness[i]);
                [0, 1].map(|k: usize| ab[i][k] + share * (color[k] - ab[i][k]))
            })
            .collect()
    }

    /// Mean of the strokes of two photos; the later one has weight `nearness`, 0 to 1.
    pub fn between(before: &Self, after: &Self, nearness: f32) -> Self {
        let pairs = (0..before.alphas.len()).map(|i| {
            let mut sum = [0.0; 3];
            for (side, share) in [(before, 1.0 - nearness), (after, nearness)] {
                let weight = share * f32::from(side.alphas[i]) / 255.0;
                let [a, b] = side.colors[i].map(f32::from);
                for (sum, value) in sum.iter_mut().zip([a, b, 1.0]) {
                    *sum += weight * value;
                }
            }
            sum
        });
        Self::new(&pairs.collect::<Vec<_>>())
    }
}

/// Claims of paint on pixels that the scene leaves open.
fn grown(
    canvas: &Canvas,
    seen: &WeightedColors,
    lightness: &[f32],
    paint: &HintImage,
) -> Vec<[f32; 3]> {
    let mut painted = paint.colors().zip(&seen.weight);
    if !painted.any(|((_, alpha), &covered)| alpha > 0.0 && covered < COVERED) {
        return vec![[0.0; 3]; canvas.len()];
    }
    let depth = |&covered: &f32| DEPTHS[usize::from(covered < COVERED)];
    let depth: Vec<f32> = seen.weight.iter().map(depth).collect();
    let mut claims = claimed_by_strokes(canvas.size(), lightness, &depth, paint);
    for _ in 0..RIM {
        claims = widened(&claims, canvas.size(), lightness, seen);
    }
    claims
}

/// Claims with the open pixels beside them that are as light: how rough a thing is tells nothing
/// at its very edge, where fronts therefore stop.
fn widened(
    claims: &[[f32; 3]],
    [width, height]: [usize; 2],
    lightness: &[f32],
    seen: &WeightedColors,
) -> Vec<[f32; 3]> {
    (claims.iter().enumerate())
        .map(|(i, &own)| {
            if seen.weight[i] >= COVERED {
                return own;
            }
            let (x, y) = (i % width, i / width);
            let left = (x > 0).then(|| i - 1);
            let right = (x + 1 < width).then(|| i + 1);
            let above = (y > 0).then(|| i - width);
            let below = (y + 1 < height).then(|| i + width);
            let beside = [left, right, above, below].into_iter().flatten();
            let alike = beside.filter(|&j| (lightness[i] - lightness[j]).abs() < ALIKE);
            alike.map(|j| claims[j]).fold(
                own,
                |most, claim| {
                    if claim[2] > most[2] { claim } else { most }
                },
            )
        })
        .collect()
}

/// Returns true if a pixel and all its neighbors are set.
fn inside(all: &[bool], [width, height]: [usize; 2], i: usize) -> bool {
    let (x, y) = (i % width, i / width);
    let mut rows = y.saturating_sub(1)..(y + 2).min(height);
    rows.all(|y| (x.saturating_sub(1)..(x + 2).min(width)).all(|x| all[y * width + x]))
}

/// Factor that brings a color of this lightness to the middle one.
fn middle_over(lightness: f32) -> f32 {
    at_middle_lightness([1.0, 0.0], lightness)[0]
}

/// `L*` of each pixel.
fn lightness(canvas: &Canvas) -> Vec<f32> {
    let of_gray: [f32; 256] =
        std::array::from_fn(|gray| gray_to_lightness(gray as f64 / 255.0) as f32);
    let gray = canvas.gray.iter();
    gray.map(|&gray| of_gray[usize::from(gray)]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::color::ciede2000;

    const SIZE: [u32; 2] = [96, 64];

    /// Rows of sky above, of which the scene shows those left of `covered` and all of the ground.
    const SKY: u32 = 30;

    /// A bright sky with soft clouds over a rough ground, seen `shift` pixels farther right.
    fn canvas(shift: f32) -> Canvas {
        let gray = |i: u32| {
            let (x, y) = ((i % SIZE[0]) as f32 + shift, (i / SIZE[0]) as f32);
            match i / SIZE[0] < SKY {
                true => 200.0 + 6.0 * (0.12 * x + 0.2 * y).sin(),
                false => 90.0 + 40.0 * (0.5 * x + 0.31 * y).sin() * (0.37 * y - 0.2 * x).cos(),
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

    /// The scene shows the ground and the left half of the sky, in a dull brown.
    fn seen(shift: f32) -> WeightedColors {
        let mut seen = WeightedColors::nothing((SIZE[0] * SIZE[1]) as usize);
        for (i, weight) in seen.weight.iter_mut().enumerate() {
            let (x, y) = (i as u32 % SIZE[0], i as u32 / SIZE[0]);
            *weight = f32::from(y >= SKY || (x as f32) + shift < 48.0);
        }
        seen.ab.fill([6.0, 20.0]);
        seen
    }

    const BLUE: [f32; 2] = [-4.0, -28.0];

    /// A stroke across all of the sky: its left half lies on what the scene shows.
    fn stroke() -> HintImage {
        let mut paint = vec![[0.0; 3]; (SIZE[0] * SIZE[1]) as usize];
        for x in 10..80 {
            for y in 12..15 {
                paint[y * SIZE[0] as usize + x] = [BLUE[0], BLUE[1], 1.0];
            }
        }
        HintImage {
            width: SIZE[0],
            height: SIZE[1],
            paint,
        }
    }

    /// Mean distance in a and b to `color` over the open sky, and the largest ΔE00 by which all
    /// that is not near it has changed.
    fn judged(strokes: &Strokes, shift: f32) -> (f32, f64) {
        let (canvas, seen) = (canvas(shift), seen(shift));
        let before = vec![[6.0, 20.0]; canvas.len()];
        let after = strokes.over(&canvas, &seen, &before);
        let light = lightness(&canvas);
        let (mut sum, mut count, mut most) = (0.0, 0.0, 0.0_f64);
        for (i, &[a, b]) in after.iter().enumerate() {
            if seen.weight[i] == 0.0 {
                let wanted = shaded_at(at_middle_lightness(BLUE, 79.0), light[i]);
                sum += (a - wanted[0]).hypot(b - wanted[1]);
                count += 1.0;
            } else {
                let lab = |[a, b]: [f32; 2]| [light[i], a, b].map(f64::from);
                most = most.max(ciede2000(lab([a, b]), lab(before[i])));
            }
        }
        (sum / count, most)
    }

    #[test]
    fn a_stroke_on_the_open_sky_colors_it_and_nothing_else() {
        let strokes = Strokes::of(&canvas(0.0), &seen(0.0), &stroke(), true);
        let (far, changed) = judged(&strokes, 0.0);
        assert!(far < 1.5 && changed == 0.0, "{far} {changed}");
        // Where it is painted and nowhere else.
        let plain = Strokes::of(&canvas(0.0), &seen(0.0), &stroke(), false);
        let painted = plain.alphas.iter().filter(|&&alpha| alpha > 0).count();
        assert_eq!(painted, 3 * (80 - 48));
        // On what the scene shows it colors the scene, and not the photo.
        let mut covered = seen(0.0);
        covered.weight.fill(1.0);
        let none = Strokes::of(&canvas(0.0), &covered, &stroke(), true);
        assert_eq!(none.share(), 0.0);
    }

    #[test]
    fn a_stroke_whose_end_leaves_the_scene_does_not_take_what_lies_there() {
        // A bright thing on dark ground; the scene ends just beside it.
        let mut photo = canvas(0.0);
        let mut seen = WeightedColors::nothing(photo.len());
        let pixels = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
        photo.gray = pixels
            .clone()
            .map(|(x, _)| if x < 66 { 200 } else { 70 })
            .collect();
        seen.weight = pixels.clone().map(|(x, _)| f32::from(x < 68)).collect();
        let painted = pixels.map(|(x, y)| f32::from((8..70).contains(&x) && (30..33).contains(&y)));
        let paint = painted
            .map(|alpha| [BLUE[0], BLUE[1], 1.0].map(|value| alpha * value))
            .collect();
        let [width, height] = SIZE;
        let stroke = HintImage {
            width,
            height,
            paint,
        };
        let strokes = Strokes::of(&photo, &seen, &stroke, true);
        for (i, &alpha) in strokes.alphas.iter().enumerate() {
            let x = i as u32 % SIZE[0];
            assert!(alpha == 0 || (68..74).contains(&x), "{x}: {alpha}");
        }
    }

    #[test]
    fn it_goes_on_to_the_photos_before_and_after_and_does_not_fade() {
        let shifts: Vec<f32> = (0..13).map(|k| 2.0 * (k as f32 - 6.0)).collect();
        let photos: Vec<Canvas> = shifts.iter().map(|&shift| canvas(shift)).collect();
        let steps: Vec<Between> = (photos.windows(2))
            .map(|pair| Between::of(&pair[0], &pair[1]).expect("one size"))
            .collect();
        for backwards in [false, true] {
            let mut strokes = Strokes::of(&photos[6], &seen(0.0), &stroke(), true);
            for step in 0..6 {
                let (from, to) = match backwards {
                    false => (6 + step, 7 + step),
                    true => (6 - step, 5 - step),
                };
                let way = &steps[from.min(to)];
                let seen = seen(shifts[to]);
                strokes = strokes.carried(&photos[from], &[way], backwards, (&photos[to], &seen));
                let (far, changed) = judged(&strokes, shifts[to]);
                assert!(
                    far < 2.0 && changed < 1.0,
                    "{backwards} {to}: {far} {changed}"
                );
            }
        }
    }

    #[test]
    fn between_two_strokes_each_counts_by_its_nearness() {
        let of = |color: i8, alpha: u8| Strokes {
            colors: vec![[color, 0]],
            alphas: vec![alpha],
        };
        let both = Strokes::between(&of(40, 255), &of(-40, 255), 0.25);
        assert_eq!(both, of(20, 255));
        assert_eq!(Strokes::between(&of(40, 255), &of(0, 0), 0.5).alphas, [128]);
    }
}
