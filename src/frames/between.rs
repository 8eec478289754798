//! Colors carried from one photo to others by what moves between neighbors.

use super::{
    Canvas, WeightedColors,
    window::{self, taps},
};
use crate::measure::{Flow, optical_flow, visible};

/// Longer side in pixels at which photos are compared: motion is smooth.
const SIDE: usize = 256;

/// Difference of gray, in 8-bit levels, at which what was followed is believed by half.
const UNLIKE: f32 = 24.0;

/// Reach in pixels of the mean over which gray is compared: grain is no sign of another thing.
const REACH: usize = 2;

/// Optical flow between two neighboring photos.
#[derive(Clone, Debug, PartialEq)]
pub struct Between {
    /// Flow from the first photo to the second, and back.
    flows: [Flow; 2],
    /// True for pixels of the first, and of the second, that are visible in the other.
    seen: [Vec<bool>; 2],
}

/// A photo whose colors are known.
pub struct ColoredPhoto<'a> {
    /// The photo.
    pub canvas: &'a Canvas,
    /// CIELAB a and b of each of its pixels.
    pub ab: &'a [[f32; 2]],
}

impl Between {
    /// Compares two photos; none where their sizes differ in shape.
    pub fn of(first: &Canvas, second: &Canvas) -> Option<Self> {
        let [(first, size), (second, other)] = [first, second].map(|photo| photo.small(SIDE));
        if size != other {
            return None;
        }
        let flows = [
            optical_flow(&first, &second, size),
            optical_flow(&second, &first, size),
        ];
        let seen = [visible(&flows[0], &flows[1]), visible(&flows[1], &flows[0])];
        Some(Self { flows, seen })
    }
}

impl ColoredPhoto<'_> {
    /// The colors as `to` shows them, which comes after this photo by `way`, in order, or, with
    /// `backwards`, before it. What is hidden on the way, or looks otherwise there, is not
    /// believed.
    pub fn along(&self, way: &[&Between], backwards: bool, to: &Canvas) -> WeightedColors {
        let pixels = to.len();
        // From the last step back to this photo, by the flow that leads there.
        let side = usize::from(!backwards);
        let steps: Vec<&Between> = match backwards {
            true => way.to_vec(),
            false => way.iter().rev().copied().collect(),
        };
        let Some(first) = steps.first() else {
            return WeightedColors::nothing(pixels);
        };
        let size = [first.flows[side].width, first.flows[side].height];
        if steps.iter().any(|step| {
            let flow = &step.flows[side];
            [flow.width, flow.height] != size
        }) {
            return WeightedColors::nothing(pixels);
        }
        let places = followed(&steps, side, size);
        let offset = median_difference(self.canvas, to, &places, size);
        let mut believed = WeightedColors::nothing(pixels);
        let [width, height] = to.size();
        let scale = [
            size[0] as f32 / width as f32,
            size[1] as f32 / height as f32,
        ];
        let own = self.canvas.size();
        let gray: Vec<[f32; 1]> = (self.canvas.gray.iter())
            .map(|&gray| [f32::from(gray)])
            .collect();
        let mut differences = vec![[0.0; 2]; pixels];
        for (i, difference) in differences.iter_mut().enumerate() {
            let (x, y) = (i % width, i / width);
            let small = [
                (x as f32 + 0.5) * scale[0] - 0.5,
                (y as f32 + 0.5) * scale[1] - 0.5,
            ];
            let Some((moved, share)) = interpolated(&places, size, small) else {
                continue;
            };
            // Displacements are in pixels of the small pictures.
            let place = [
                (x as f32 + 0.5 + moved[0] / scale[0]) * own[0] as f32 / width as f32,
                (y as f32 + 0.5 + moved[1] / scale[1]) * own[1] as f32 / height as f32,
            ];
            if nearest(own, place).is_none() {
                continue;
            }
            let place = place.map(|at| at - 0.5);
            let [before] = window::bilinear(&gray, own, place);
            *difference = [f32::from(to.gray[i]) - before - offset, 1.0];
            believed.ab[i] = window::bilinear(self.ab, own, place);
            believed.weight[i] = share;
        }
        let around = window::sums(&differences, to.size(), REACH);
        for (weight, [sum, count]) in believed.weight.iter_mut().zip(around) {
            // Where nothing is known the weight is zero.
            *weight /= 1.0 + (sum / count.max(1.0) / UNLIKE).powi(4);
        }
        believed
    }
}

/// Total displacement of each small pixel; `None` where it is occluded on the way.
fn followed(steps: &[&Between], side: usize, size: [usize; 2]) -> Vec<Option<[f32; 2]>> {
    let mut places: Vec<Option<[f32; 2]>> = vec![Some([0.0; 2]); size[0] * size[1]];
    for step in steps {
        let (flow, seen) = (&step.flows[side], &step.seen[side]);
        for (i, place) in places.iter_mut().enumerate() {
            *place = place.and_then(|[u, v]| {
                let at = [
                    (i % size[0]) as f32 + 0.5 + u,
                    (i / size[0]) as f32 + 0.5 + v,
                ];
                let at = nearest(size, at).filter(|&at| seen[at])?;
                let [du, dv] = flow.vectors[at];
                Some([u + du, v + dv])
            });
        }
    }
    places
}

/// The pixel in which a place lies; none outside.
fn nearest([width, height]: [usize; 2], [x, y]: [f32; 2]) -> Option<usize> {
    // NaN fails both.
    let inside = (0.0..width as f32).contains(&x) && (0.0..height as f32).contains(&y);
    inside.then(|| (y as usize).min(height - 1) * width + (x as usize).min(width - 1))
}

/// Mean of the known displacements around a place in pixel indices, and which share is known.
fn interpolated(
    places: &[Option<[f32; 2]>],
    [width, height]: [usize; 2],
    [x, y]: [f32; 2],
) -> Option<([f32; 2], f32)> {
    let (mut sum, mut share) = ([0.0; 2], 0.0);
    for (row, wy) in taps(y, height) {
        for (column, wx) in taps(x, width) {
            if let Some([u, v]) = places[row * width + column] {
                sum = [sum[0] + wx * wy * u, sum[1] + wx * wy * v];
                share += wx * wy;
            }
        }
    }
    (share > 0.0).then(|| (sum.map(|sum| sum / share), share))
}

/// By how much the second photo is lighter than the first where the same is seen, in 8-bit
/// levels: flicker.
fn median_difference(
    from: &Canvas,
    to: &Canvas,
    places: &[Option<[f32; 2]>],
    size: [usize; 2],
) -> f32 {
    let scaled = |canvas: &Canvas, x: f32, y: f32| {
        let own = canvas.size();
        let place = [
            x * own[0] as f32 / size[0] as f32,
            y * own[1] as f32 / size[1] as f32,
        ];
        nearest(own, place).map(|at| f32::from(canvas.gray[at]))
    };
    let mut differences: Vec<f32> = (places.iter().enumerate())
        .filter_map(|(i, place)| {
            let [u, v] = (*place)?;
            let (x, y) = ((i % size[0]) as f32 + 0.5, (i / size[0]) as f32 + 0.5);
            Some(scaled(to, x, y)? - scaled(from, x + u, y + v)?)
        })
        .collect();
    if differences.is_empty() {
        return 0.0;
    }
    let middle = differences.len() / 2;
    *differences.select_nth_unstable_by(middle, f32::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [u32; 2] = [96, 64];

    /// A textured ground that moves right by `shift`, with a flicker of `light` levels.
    fn canvas(shift: f32, light: f32) -> Canvas {
        let gray = |i: u32| {
            let (x, y) = ((i % SIZE[0]) as f32 - shift, (i / SIZE[0]) as f32);
            let texture =
                110.0 + 40.0 * (0.21 * x + 0.1 * y).sin() + 30.0 * (0.33 * y - 0.08 * x).cos();
            (texture + light) as u8
        };
        Canvas {
            width: SIZE[0],
            height: SIZE[1],
            gray: (0..SIZE[0] * SIZE[1]).map(gray).collect(),
            mask: None,
            stance: Default::default(),
        }
    }

    /// Colors that move with it.
    fn colors(shift: f32) -> Vec<[f32; 2]> {
        (0..SIZE[0] * SIZE[1])
            .map(|i| [(i % SIZE[0]) as f32 - shift, (i / SIZE[0]) as f32])
            .collect()
    }

    #[test]
    fn colors_follow_what_moves_over_several_photos_forwards_and_back() {
        let photos: Vec<Canvas> = (0..4)
            .map(|t| canvas(3.0 * t as f32, if t % 2 == 1 { 18.0 } else { 0.0 }))
            .collect();
        let steps: Vec<Between> = (photos.windows(2))
            .map(|pair| Between::of(&pair[0], &pair[1]).expect("one size"))
            .collect();
        let way: Vec<&Between> = steps.iter().collect();
        for backwards in [false, true] {
            let (from, to) = if backwards { (3, 0) } else { (0, 3) };
            let known = ColoredPhoto {
                canvas: &photos[from],
                ab: &colors(3.0 * from as f32),
            };
            let found = known.along(&way, backwards, &photos[to]);
            let truth = colors(3.0 * to as f32);
            let (mut sum, mut weight) = (0.0, 0.0);
            for ((ab, truth), w) in found.ab.iter().zip(&truth).zip(&found.weight) {
                sum += w * (ab[0] - truth[0]).hypot(ab[1] - truth[1]);
                weight += w;
            }
            let share = weight / found.weight.len() as f32;
            assert!(share > 0.6, "{share}");
            assert!(sum / weight < 1.2, "{}", sum / weight);
            // What comes into the picture is not known.
            let border = if backwards { SIZE[0] as usize - 1 } else { 0 };
            let column = found.weight.iter().skip(border).step_by(SIZE[0] as usize);
            assert!(column.sum::<f32>() < 6.0);
        }
    }

    #[test]
    fn another_thing_is_not_believed_and_another_shape_not_compared() {
        let (first, mut second) = (canvas(0.0, 0.0), canvas(2.0, 0.0));
        for y in 20..44 {
            let start = y * SIZE[0] as usize;
            second.gray[start + 30..start + 60].fill(250);
        }
        let step = Between::of(&first, &second).expect("one size");
        let known = ColoredPhoto {
            canvas: &first,
            ab: &colors(0.0),
        };
        let found = known.along(&[&step], false, &second);
        let inside = found.weight[32 * SIZE[0] as usize + 45];
        assert!(inside < 0.2, "{inside}");
        let other = Canvas {
            width: 32,
            height: 64,
            gray: vec![0; 32 * 64],
            mask: None,
            stance: Default::default(),
        };
        assert_eq!(Between::of(&first, &other), None);
        assert_eq!(known.along(&[], false, &second).share(), 0.0);
    }
}
