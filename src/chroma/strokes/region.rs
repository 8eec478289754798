//! From strokes on a photo to what they lie on: a front that runs from the paint over what is
//! as light and as rough as what lies beneath it, and stops at edges.

use std::{cmp::Ordering, collections::BinaryHeap};

use super::shade::at_middle;
use crate::chroma::teacher::HintImage;

/// A photo, and how far away is what it shows.
pub(super) struct Surface<'a> {
    /// Width and height in pixels.
    pub size: [usize; 2],
    /// `L*` of each pixel, `[height, width]`.
    pub lightness: &'a [f32],
    /// Depth in world units, `[height, width]`; NaN where nobody knows.
    pub depth: &'a [f32],
}

/// α from which paint is a stroke that grows; less is a brush's soft rim.
const STROKE: f32 = 0.25;

/// Neighboring painted pixels that differ by less, in CIELAB units, are of one stroke.
const ONE_COLOR: f32 = 8.0;

/// Share of a stroke's pixels that a pixel must be like: fewer tell nothing, as a stroke that
/// leaves its thing by a little does not take what lies beside it.
const ALIKE: f32 = 0.05;

/// Pixels of a stroke that others are compared with at most, an even choice.
const SAMPLES: usize = 128;

/// Differences of two pixels that do not slow a front: in lightness, in the mean lightness around
/// them (both in units of `L*`), and in the logarithm of the deviation around them.
const TOLERANCES: [f32; 3] = [8.0, 5.0, 0.35];

/// Deviation of `L*` that noise has anyway.
const NOISE: f32 = 2.0;

/// A stroke is as opaque as this share of its pixels: the others are the brush's rim.
const FULL: f32 = 0.8;

/// Pixels to each side that are around one.
const AROUND: usize = 2;

/// Cost of a pixel that is unlike the stroke by one tolerance more: it grows with the square.
const UNLIKE: f32 = 0.3;

/// Share of the picture's diagonal that a front can run where nothing slows it.
const REACH: f32 = 0.5;

/// Relative step in depth between two pixels that is no edge, and one that ends any front.
const STEP: [f32; 2] = [0.02, 0.12];

/// Up to here a front claims all, and from 1 on nothing.
const SURE: f32 = 0.5;

/// Figures of all pixels of one stroke.
struct Stroke {
    /// a, b at the middle lightness.
    color: [f32; 2],
    /// Its α, but for its rim.
    strength: f32,
    /// Features of pixels beneath it, in tolerances.
    samples: Vec<Features>,
}

/// By which pixels are alike, in [`TOLERANCES`].
type Features = [f32; 3];

/// Claim of paint on a photo: α a, α b, α of each pixel, `[height, width]`; a and b are
/// those at the [middle lightness](super::shade), α from 0 to 1. `paint` has the photo's size.
///
/// Every pixel goes to the stroke whose front reaches it first; painted ones keep their paint.
pub(super) fn grow(surface: &Surface<'_>, paint: &HintImage) -> Vec<[f32; 3]> {
    let features = features(surface);
    let (strokes, mut owner) = strokes(surface, &features, paint);
    let costs = fronts(surface, &features, &strokes, &mut owner);
    let mut claims: Vec<[f32; 3]> = (costs.iter().zip(&owner))
        .map(|(&cost, &owner)| match strokes.get(owner) {
            Some(stroke) => {
                let alpha = stroke.strength * claimed(cost);
                [alpha * stroke.color[0], alpha * stroke.color[1], alpha]
            }
            None => [0.0; 3],
        })
        .collect();
    // A soft rim claims no less than it covers.
    for (i, (color, alpha)) in paint.colors().enumerate() {
        if alpha > claims[i][2] {
            let [a, b] = at_middle(color, surface.lightness[i]);
            claims[i] = [alpha * a, alpha * b, alpha];
        }
    }
    claims
}

/// Claim of a front at a cost, 0 to 1.
pub(super) fn claimed(cost: f32) -> f32 {
    let t = ((1.0 - cost) / (1.0 - SURE)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Lightness, mean lightness and deviation around each pixel.
fn features(surface: &Surface<'_>) -> Vec<Features> {
    let [width, height] = surface.size;
    let light = median(surface);
    // Sums of L and L² over rectangles from the top left.
    let mut sums = vec![[0.0_f64; 2]; (width + 1) * (height + 1)];
    for y in 0..height {
        let mut row = [0.0; 2];
        for x in 0..width {
            let value = f64::from(surface.lightness[y * width + x]);
            row = [row[0] + value, row[1] + value * value];
            let above = sums[y * (width + 1) + x + 1];
            sums[(y + 1) * (width + 1) + x + 1] = [above[0] + row[0], above[1] + row[1]];
        }
    }
    (0..width * height)
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let [left, top] = [x, y].map(|v| v.saturating_sub(AROUND));
            let right = (x + AROUND + 1).min(width);
            let bottom = (y + AROUND + 1).min(height);
            let at = |x: usize, y: usize, k: usize| sums[y * (width + 1) + x][k];
            let sum = |k| {
                at(right, bottom, k) - at(left, bottom, k) - at(right, top, k) + at(left, top, k)
            };
            let count = ((right - left) * (bottom - top)) as f64;
            let mean = sum(0) / count;
            let deviation = (sum(1) / count - mean * mean).max(0.0).sqrt() as f32;
            let features = [light[i], mean as f32, (deviation + NOISE).ln()];
            std::array::from_fn(|k| features[k] / TOLERANCES[k])
        })
        .collect()
}

/// The middle of the nine pixels around each: grain goes, edges stay.
fn median(surface: &Surface<'_>) -> Vec<f32> {
    let [width, height] = surface.size;
    (0..width * height)
        .map(|i| {
            let (x, y) = (i % width, i / width);
            let mut nine = [0.0; 9];
            for (k, value) in nine.iter_mut().enumerate() {
                let x = (x + k % 3).saturating_sub(1).min(width - 1);
                let y = (y + k / 3).saturating_sub(1).min(height - 1);
                *value = surface.lightness[y * width + x];
            }
            *nine.select_nth_unstable_by(4, f32::total_cmp).1
        })
        .collect()
}

/// The strokes, and of each pixel which one is painted there; `usize::MAX` where none is.
fn strokes(
    surface: &Surface<'_>,
    features: &[Features],
    paint: &HintImage,
) -> (Vec<Stroke>, Vec<usize>) {
    let size = surface.size;
    let colors: Vec<([f32; 2], f32)> = paint.colors().collect();
    let mut owner = vec![usize::MAX; colors.len()];
    let mut found = Vec::new();
    for start in 0..colors.len() {
        if owner[start] != usize::MAX || colors[start].1 < STROKE {
            continue;
        }
        let mut pixels = vec![start];
        owner[start] = found.len();
        let mut next = 0;
        while let Some(&pixel) = pixels.get(next) {
            next += 1;
            let [a, b] = colors[pixel].0;
            for (other, _) in around(size, pixel) {
                let ([c, d], alpha) = colors[other];
                let alike = (a - c).hypot(b - d) < ONE_COLOR;
                if owner[other] == usize::MAX && alpha >= STROKE && alike {
                    owner[other] = found.len();
                    pixels.push(other);
                }
            }
        }
        found.push(Stroke::of(surface, features, &colors, &pixels));
    }
    (found, owner)
}

impl Stroke {
    fn of(
        surface: &Surface<'_>,
        features: &[Features],
        colors: &[([f32; 2], f32)],
        pixels: &[usize],
    ) -> Self {
        let mean = |of: &dyn Fn(usize) -> f32| {
            let sum: f64 = pixels.iter().map(|&i| f64::from(of(i))).sum();
            (sum / pixels.len() as f64) as f32
        };
        let light = mean(&|i| surface.lightness[i]);
        let color = [0, 1].map(|c| mean(&|i| colors[i].0[c]));
        let count = pixels.len().min(SAMPLES);
        let sample = |k: usize| features[pixels[k * pixels.len() / count]];
        Self {
            color: at_middle(color, light),
            strength: quantile(pixels.iter().map(|&i| colors[i].1), FULL),
            samples: (0..count).map(sample).collect(),
        }
    }

    /// By how many tolerances a pixel is less like what lies beneath the stroke than it may be.
    fn unlike(&self, features: &Features) -> f32 {
        let apart = |sample: &Features| {
            let each = features.iter().zip(sample).map(|(a, b)| (a - b).abs());
            each.fold(0.0, f32::max)
        };
        // Most pixels that a front comes to are found alike after a few samples.
        let enough = place_of(ALIKE, self.samples.len()) + 1;
        let alike = self.samples.iter().filter(|sample| apart(sample) <= 1.0);
        if alike.take(enough).count() == enough {
            return 0.0;
        }
        (quantile(self.samples.iter().map(apart), ALIKE) - 1.0).max(0.0)
    }
}

/// Place of the value in `count` sorted ones below which this share of them lies.
fn place_of(share: f32, count: usize) -> usize {
    (share * (count - 1) as f32).round() as usize
}

/// The value below which this share of some lies; there is one at least.
fn quantile(values: impl Iterator<Item = f32>, share: f32) -> f32 {
    let mut values: Vec<f32> = values.collect();
    let at = place_of(share, values.len());
    *values.select_nth_unstable_by(at, f32::total_cmp).1
}

/// The eight neighbors of a pixel, and how far they are.
fn around([width, height]: [usize; 2], pixel: usize) -> impl Iterator<Item = (usize, f32)> {
    let (x, y) = ((pixel % width) as isize, (pixel / width) as isize);
    (0..9).filter(|&k| k != 4).filter_map(move |k| {
        let (dx, dy) = (k % 3 - 1, k / 3 - 1);
        let (x, y) = (x + dx, y + dy);
        let inside = x >= 0 && y >= 0 && x < width as isize && y < height as isize;
        let far = if dx * dy == 0 {
            1.0
        } else {
            std::f32::consts::SQRT_2
        };
        inside.then(|| (y as usize * width + x as usize, far))
    })
}

/// A place that a front has come to, the cheapest first.
#[derive(PartialEq)]
pub(super) struct Front {
    pub cost: f32,
    pub place: usize,
}

impl Eq for Front {}

impl Ord for Front {
    fn cmp(&self, other: &Self) -> Ordering {
        let cost = other.cost.total_cmp(&self.cost);
        cost.then(other.place.cmp(&self.place))
    }
}

impl PartialOrd for Front {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

/// Cost at which the nearest stroke comes to each pixel, and whose it becomes.
fn fronts(
    surface: &Surface<'_>,
    features: &[Features],
    strokes: &[Stroke],
    owner: &mut [usize],
) -> Vec<f32> {
    let [width, height] = surface.size;
    let each = 1.0 / (REACH * (width as f32).hypot(height as f32));
    let mut costs = vec![f32::INFINITY; owner.len()];
    // How unlike each pixel is the stroke that came to it last: all its neighbors ask.
    let mut known = vec![(usize::MAX, 0.0); owner.len()];
    let mut queue = BinaryHeap::new();
    for (place, &owner) in owner.iter().enumerate() {
        if owner != usize::MAX {
            costs[place] = 0.0;
            queue.push(Front { cost: 0.0, place });
        }
    }
    while let Some(Front { cost, place }) = queue.pop() {
        if cost > costs[place] {
            continue;
        }
        let stroke = owner[place];
        for (other, far) in around(surface.size, place) {
            if known[other].0 != stroke {
                known[other] = (stroke, strokes[stroke].unlike(&features[other]));
            }
            let unlike = known[other].1;
            let edge = edge(surface.depth[place], surface.depth[other]);
            let cost = cost + far * (each + UNLIKE * unlike * unlike) + edge;
            if cost < costs[other] && cost < 1.0 {
                costs[other] = cost;
                owner[other] = stroke;
                queue.push(Front { cost, place: other });
            }
        }
    }
    costs
}

/// Cost of a step in depth: nothing, or up to all that a front has.
fn edge(from: f32, to: f32) -> f32 {
    let step = (from / to).ln().abs();
    let cost = (step - STEP[0]) / (STEP[1] - STEP[0]);
    // Nobody knows.
    if cost.is_nan() {
        0.0
    } else {
        cost.clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [40, 20];

    /// A photo of this lightness by column, and a vertical stroke of `color` at `column`.
    fn grown(
        lightness: impl Fn(usize) -> f32,
        depth: impl Fn(usize) -> f32,
        strokes: &[(usize, [f32; 2], f32)],
    ) -> Vec<[f32; 3]> {
        let [width, height] = SIZE;
        let by_column = |of: &dyn Fn(usize) -> f32| -> Vec<f32> {
            (0..width * height).map(|i| of(i % width)).collect()
        };
        let (lightness, depth) = (by_column(&lightness), by_column(&depth));
        let surface = Surface {
            size: SIZE,
            lightness: &lightness,
            depth: &depth,
        };
        let mut paint = vec![[0.0; 3]; width * height];
        for &(column, [a, b], alpha) in strokes {
            for y in 4..16 {
                paint[y * width + column] = [alpha * a, alpha * b, alpha];
            }
        }
        let paint = HintImage {
            width: width as u32,
            height: height as u32,
            paint,
        };
        grow(&surface, &paint)[10 * width..11 * width].to_vec()
    }

    const RED: [f32; 2] = [60.0, 40.0];

    #[test]
    fn a_stroke_claims_what_is_as_light_and_stops_at_the_edge() {
        let light = |x: usize| if x < 20 { 40.0 } else { 70.0 };
        let row = grown(light, |_| f32::NAN, &[(5, RED, 1.0)]);
        assert!(row[..17].iter().all(|claim| claim[2] > 0.9), "{row:?}");
        assert!(row[23..].iter().all(|claim| claim[2] == 0.0), "{row:?}");
        // At its own lightness the thing is as painted.
        let [a, b, alpha] = row[10];
        let shown = super::super::shade::shaded([a / alpha, b / alpha], 40.0);
        assert!(
            (shown[0] - 60.0).abs() < 0.1 && (shown[1] - 40.0).abs() < 0.1,
            "{shown:?}"
        );
    }

    #[test]
    fn nothing_painted_claims_nothing() {
        let row = grown(|_| 50.0, |_| 1.0, &[]);
        assert!(row.iter().all(|claim| *claim == [0.0; 3]));
    }

    #[test]
    fn a_step_in_depth_is_an_edge() {
        let row = grown(
            |_| 50.0,
            |x| if x < 20 { 1.0 } else { 1.5 },
            &[(5, RED, 1.0)],
        );
        assert!(row[19][2] > 0.8 && row[20][2] == 0.0, "{row:?}");
    }

    #[test]
    fn strokes_compete() {
        let row = grown(|_| 50.0, |_| 1.0, &[(5, RED, 1.0), (25, [-50.0, 0.0], 1.0)]);
        for (x, claim) in row.iter().enumerate().take(31) {
            let red = claim[0] > 0.0;
            assert!(claim[2] > 0.5 && red == (x <= 15), "{x}: {claim:?}");
        }
    }

    fn unlike(beneath: &[(Features, usize)], pixel: Features) -> f32 {
        let in_tolerances = |of: Features| std::array::from_fn(|k| of[k] / TOLERANCES[k]);
        let samples = beneath
            .iter()
            .flat_map(|&(of, n)| vec![in_tolerances(of); n]);
        let stroke = Stroke {
            color: RED,
            strength: 1.0,
            samples: samples.collect(),
        };
        stroke.unlike(&in_tolerances(pixel))
    }

    const DARK_AND_SMOOTH: Features = [20.0, 20.0, 0.7];
    const LIGHT_AND_ROUGH: Features = [70.0, 70.0, 2.5];

    #[test]
    fn what_lies_beneath_is_not_mixed() {
        let both = [(DARK_AND_SMOOTH, 60), (LIGHT_AND_ROUGH, 60)];
        assert_eq!(unlike(&both, DARK_AND_SMOOTH), 0.0);
        assert_eq!(unlike(&both, LIGHT_AND_ROUGH), 0.0);
        assert!(unlike(&both, [70.0, 70.0, 0.7]) > 2.0);
        assert!(unlike(&both, [45.0, 45.0, 1.6]) > 1.0);
    }

    #[test]
    fn a_stroke_that_leaves_its_thing_by_a_little_does_not_take_what_lies_beside() {
        let astray = |n| {
            unlike(
                &[(DARK_AND_SMOOTH, 100), (LIGHT_AND_ROUGH, n)],
                LIGHT_AND_ROUGH,
            )
        };
        assert!(astray(3) > 2.0);
        assert_eq!(astray(20), 0.0);
    }

    #[test]
    fn half_transparent_paint_claims_half() {
        let row = grown(|_| 50.0, |_| 1.0, &[(5, RED, 0.5)]);
        for claim in &row[..12] {
            assert!((claim[2] - 0.5).abs() < 0.01, "{claim:?}");
        }
    }
}
