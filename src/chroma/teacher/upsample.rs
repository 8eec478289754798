//! From a teacher's resolution to the photo's, along the photo's edges.

use super::images::{Filter, resample};
use super::{AbImage, GrayImage};

/// Enlargement of an answer smaller than its photo.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum Upsample {
    /// Along the photo's edges: joint bilateral upsampling.
    #[default]
    Guided,
    /// Bilinear interpolation: colors bleed over edges.
    Bilinear,
}

/// Standard deviation of the weight by distance, in pixels of the answer, as in
/// Kopf et al. 2007.
const SPATIAL_DEVIATION: f32 = 0.5;

/// Standard deviation of the weight by difference of gray, in 8-bit levels.
/// docs/experiments.md compares values on photos.
const GRAY_DEVIATION: f32 = 20.0;

/// Reach of the weights in pixels of the answer: three deviations.
const RADIUS: usize = 1;

/// A share of the weight that does not ask for gray, so that a pixel unlike all
/// around it takes their mean.
const BLIND_SHARE: f32 = 1e-6;

impl AbImage {
    /// The answer at the photo's size.
    ///
    /// An axis along which the photo is smaller is averaged either way.
    pub fn upsampled(self, photo: GrayImage<'_>, upsample: Upsample) -> Self {
        let size = [photo.width, photo.height];
        if upsample == Upsample::Bilinear || (self.width >= size[0] && self.height >= size[1]) {
            return self.resized(size[0], size[1]);
        }
        let answer = self.resized(self.width.min(size[0]), self.height.min(size[1]));
        let enlarged = joint_bilateral(&answer, photo);
        // What averaging the result to the answer's size would change is put
        // back, for the weights also smooth where there is no edge.
        let again = enlarged.resized(answer.width, answer.height);
        let lost = AbImage {
            ab: difference(&answer.ab, &again.ab),
            ..again
        };
        let lost = lost.resized(size[0], size[1]);
        let mut ab = enlarged.ab;
        for (ab, lost) in ab.iter_mut().zip(&lost.ab) {
            *ab = [ab[0] + lost[0], ab[1] + lost[1]];
        }
        Self { ab, ..lost }
    }
}

fn difference(whole: &[[f32; 2]], part: &[[f32; 2]]) -> Vec<[f32; 2]> {
    let pairs = whole.iter().zip(part);
    pairs.map(|(w, p)| [w[0] - p[0], w[1] - p[1]]).collect()
}

/// Each pixel is the mean of the answer's pixels around it, weighted by their
/// distance and by how much their gray differs from its own (Kopf et al.,
/// Joint Bilateral Upsampling, SIGGRAPH 2007, equation 3).
fn joint_bilateral(answer: &AbImage, photo: GrayImage<'_>) -> AbImage {
    let (small, size) = ([answer.width, answer.height], [photo.width, photo.height]);
    let gray: Vec<[f32; 1]> = photo.pixels.iter().map(|&g| [f32::from(g)]).collect();
    let guide = resample(&gray, size, small, Filter::Average);
    let guide: Vec<u8> = guide.iter().map(|gray| gray[0].round() as u8).collect();
    let likeness: [f32; 256] =
        std::array::from_fn(|d| gaussian(d as f32, GRAY_DEVIATION) + BLIND_SHARE);
    let (columns, rows) = (around(small[0], size[0]), around(small[1], size[1]));

    let width = small[0] as usize;
    let mut ab = Vec::with_capacity(photo.pixels.len());
    let lines = photo.pixels.chunks_exact(columns.len());
    for ((top, weights_y), line) in rows.iter().zip(lines) {
        for ((left, weights_x), &gray) in columns.iter().zip(line) {
            let (mut sum, mut total) = ([0.0; 2], 0.0);
            for (j, weight_y) in weights_y.iter().enumerate() {
                let start = (top + j) * width + left;
                let around = start..start + weights_x.len();
                let values = guide[around.clone()].iter().zip(&answer.ab[around]);
                for ((other, value), weight_x) in values.zip(weights_x) {
                    let weight = weight_x * weight_y * likeness[usize::from(other.abs_diff(gray))];
                    total += weight;
                    sum = [sum[0] + weight * value[0], sum[1] + weight * value[1]];
                }
            }
            ab.push(sum.map(|sum| sum / total));
        }
    }
    AbImage {
        width: size[0],
        height: size[1],
        ab,
    }
}

fn gaussian(distance: f32, deviation: f32) -> f32 {
    (-0.5 * (distance / deviation).powi(2)).exp()
}

/// For each of `new_length` pixels of an axis the first of the `length` pixels
/// around it, and their weights by distance.
fn around(length: u32, new_length: u32) -> Vec<(usize, Vec<f32>)> {
    let step = length as f32 / new_length as f32;
    let taps = |i: u32| {
        let center = (i as f32 + 0.5) * step - 0.5;
        let nearest = (center.round().max(0.0) as usize).min(length as usize - 1);
        let first = nearest.saturating_sub(RADIUS);
        let last = (nearest + RADIUS).min(length as usize - 1);
        let weight = |x: usize| gaussian(x as f32 - center, SPATIAL_DEVIATION);
        (first, (first..=last).map(weight).collect())
    };
    (0..new_length).map(taps).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gray(width: u32, height: u32, pixels: &[u8]) -> GrayImage<'_> {
        GrayImage {
            width,
            height,
            pixels,
        }
    }

    /// Root of the mean squared distance in the a, b plane.
    fn rms(image: &AbImage, truth: &AbImage) -> f64 {
        let differences = difference(&image.ab, &truth.ab);
        let squares = differences
            .iter()
            .map(|d| f64::from(d[0].hypot(d[1])).powi(2));
        (squares.sum::<f64>() / differences.len() as f64).sqrt()
    }

    #[test]
    fn colors_keep_to_their_side_of_an_edge() {
        // Red on dark, green on bright; the edge is not on the answer's grid.
        let (width, height) = (64, 40);
        let dark = |i: u32| i % width < 27;
        let pixels: Vec<u8> = (0..width * height)
            .map(|i| if dark(i) { 50 } else { 180 })
            .collect();
        let truth = AbImage {
            width,
            height,
            ab: (0..width * height)
                .map(|i| if dark(i) { [50.0, 20.0] } else { [-40.0, 20.0] })
                .collect(),
        };
        let small = truth.resized(8, 5);
        let photo = gray(width, height, &pixels);
        let blind = rms(&small.clone().upsampled(photo, Upsample::Bilinear), &truth);
        let guided = rms(&small.upsampled(photo, Upsample::Guided), &truth);
        assert!(blind > 8.0 && guided < 0.6 * blind, "{guided} {blind}");
    }

    #[test]
    fn a_constant_stays_constant_whatever_the_sizes() {
        for (small, size) in [([3, 2], [19, 11]), ([20, 2], [7, 9]), ([9, 9], [9, 9])] {
            let pixels: Vec<u8> = (0..size[0] * size[1])
                .map(|i| (i * 37 % 256) as u8)
                .collect();
            let answer = AbImage {
                width: small[0],
                height: small[1],
                ab: vec![[12.0, -7.0]; (small[0] * small[1]) as usize],
            };
            let large = answer.upsampled(gray(size[0], size[1], &pixels), Upsample::Guided);
            assert_eq!([large.width, large.height], size);
            assert_eq!(large.ab.len(), pixels.len());
            let near = |ab: &[f32; 2]| (ab[0] - 12.0).abs() < 1e-3 && (ab[1] + 7.0).abs() < 1e-3;
            assert!(large.ab.iter().all(near));
        }
    }

    #[test]
    fn without_edges_it_is_hardly_more_than_interpolation() {
        let answer = AbImage {
            width: 8,
            height: 1,
            ab: (0..8).map(|i| [10.0 * i as f32, 0.0]).collect(),
        };
        let pixels = [99; 64];
        let guided = answer
            .clone()
            .upsampled(gray(64, 1, &pixels), Upsample::Guided);
        let plain = answer.upsampled(gray(64, 1, &pixels), Upsample::Bilinear);
        assert!(rms(&guided, &plain) < 2.0, "{}", rms(&guided, &plain));
    }
}
