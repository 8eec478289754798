//! Objects that a detector of the user's sees in pictures.

use std::{collections::BTreeMap, path::Path};

use image::{Rgb, RgbImage, imageops};

use super::{
    Drawing, EvalError,
    detections::{BoxLayout, Detection, kept},
    network::Network,
};
use crate::report::{DetectionScore, Method, to_image};

/// Gray beside a picture that has another aspect than the detector's input.
const MARGIN: Rgb<u8> = Rgb([114; 3]);

/// A detector of the YOLO family.
pub struct Detector {
    network: Network,
    /// Width and height of its input.
    size: [u32; 2],
    /// Shape and layout of its output.
    shape: Vec<i64>,
    layout: BoxLayout,
}

impl Detector {
    /// Opens a model: a picture `[1, 3, H, W]` in, boxes as [`BoxLayout`] has them out. YOLOX takes
    /// BGR from 0 to 255, the others RGB from 0 to 1; all with [`MARGIN`].
    ///
    /// # Errors
    /// [`EvalError::Network`]; [`EvalError::Teacher`] without ONNX Runtime.
    pub fn open(path: &Path) -> Result<Self, EvalError> {
        let network = Network::open(path)?;
        let size = match network.inputs().as_deref() {
            Some([input]) => match input[..] {
                [1 | -1, 3, height, width] => match [width, height].map(u32::try_from) {
                    [Ok(width @ 1..), Ok(height @ 1..)] => Some([width, height]),
                    _ => None,
                },
                _ => None,
            },
            _ => None,
        };
        let shape = network.outputs().and_then(|all| all.into_iter().next());
        let layout = size.zip(shape).and_then(|(size, mut shape)| {
            if let Some(batch @ -1) = shape.first_mut() {
                *batch = 1;
            }
            Some((size, BoxLayout::of(&shape, size)?, shape))
        });
        match layout {
            Some((size, layout, shape)) => Ok(Self {
                network,
                size,
                shape,
                layout,
            }),
            None => Err(network.failure(
                "a detector has one input [1,3,H,W] and boxes [1,N,5+classes] or [1,4+classes,N], 32-bit floats of fixed sizes: export it so".to_owned(),
            )),
        }
    }

    /// Objects in a picture.
    fn detect(&mut self, picture: &RgbImage) -> Result<Vec<Detection>, EvalError> {
        let [width, height] = self.size;
        let input = boxed(picture, self.size);
        let value = |(channel, pixel): (usize, &Rgb<u8>)| match self.layout {
            BoxLayout::Grids => f32::from(pixel[2 - channel]),
            BoxLayout::Rows | BoxLayout::Columns => f32::from(pixel[channel]) / 255.0,
        };
        let planes = (0..3).flat_map(|channel| input.pixels().map(move |pixel| (channel, pixel)));
        let planes = planes.map(value).collect();
        let asked = vec![([1, 3, height.into(), width.into()], planes)];
        let values = self.network.run(asked)?;
        if values.len() as i64 != self.shape.iter().product::<i64>() {
            let reason = format!(
                "answers with {} numbers, not {:?}",
                values.len(),
                self.shape
            );
            return Err(self.network.failure(reason));
        }
        Ok(self.layout.decode(&self.shape, &values, self.size))
    }
}

/// A picture as large as fits, in the upper left.
fn boxed(picture: &RgbImage, [width, height]: [u32; 2]) -> RgbImage {
    let [across, down] = [
        f64::from(width) / f64::from(picture.width()),
        f64::from(height) / f64::from(picture.height()),
    ];
    let scaled = |side: u32| ((f64::from(side) * across.min(down)).round() as u32).max(1);
    let size = [scaled(picture.width()), scaled(picture.height())];
    let filter = imageops::FilterType::Triangle;
    let small = imageops::resize(picture, size[0], size[1], filter);
    let mut input = RgbImage::from_pixel(width, height, MARGIN);
    imageops::replace(&mut input, &small, 0, 0);
    input
}

/// Objects in each method's frames so far.
#[derive(Default)]
pub struct Detected(BTreeMap<Method, Tally>);

/// Objects in one method's frames.
#[derive(Default)]
struct Tally {
    frames: usize,
    count: usize,
    scores: f64,
    /// Objects of frames that had a next one, and those of them that it has, too.
    followed: usize,
    kept: usize,
    last: Vec<Detection>,
}

impl Detected {
    /// Adds the next frame.
    pub fn add(&mut self, detector: &mut Detector, drawing: &Drawing) -> Result<(), EvalError> {
        let (width, height) = (drawing.gray.width, drawing.gray.height);
        for (method, pixels) in drawing.pictures() {
            let found = detector.detect(&to_image(width, height, &pixels))?;
            self.0.entry(method).or_default().add(found);
        }
        Ok(())
    }

    pub fn scores(&self) -> Vec<DetectionScore> {
        let all = self.0.iter();
        all.map(|(method, tally)| tally.score(method)).collect()
    }
}

impl Tally {
    fn add(&mut self, found: Vec<Detection>) {
        self.followed += self.last.len();
        self.kept += kept(&self.last, &found);
        self.frames += 1;
        self.count += found.len();
        self.scores += found.iter().map(|one| f64::from(one.score)).sum::<f64>();
        self.last = found;
    }

    fn score(&self, method: &Method) -> DetectionScore {
        let share = |part: f64, whole: usize| (whole > 0).then(|| part / whole as f64);
        DetectionScore {
            method: method.clone(),
            per_frame: self.count as f64 / self.frames.max(1) as f64,
            score: share(self.scores, self.count),
            kept: share(self.kept as f64, self.followed),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_fit_into_the_input() {
        let red = Rgb([255, 0, 0]);
        let wide = boxed(&RgbImage::from_pixel(20, 10, red), [8, 8]);
        for (x, y, pixel) in wide.enumerate_pixels() {
            let want = if y < 4 { red } else { MARGIN };
            assert_eq!(*pixel, want, "{x} {y}");
        }
        let high = boxed(&RgbImage::from_pixel(5, 10, red), [8, 20]);
        assert_eq!(
            (*high.get_pixel(7, 15), *high.get_pixel(7, 16)),
            (red, MARGIN)
        );
    }

    #[test]
    fn frames_are_tallied_by_hand() {
        let at = |x: f32, score| Detection {
            class: 3,
            score,
            corners: [x, 0.0, x + 10.0, 10.0],
        };
        let mut tally = Tally::default();
        tally.add(vec![at(0.0, 0.9), at(40.0, 0.5)]);
        tally.add(vec![at(1.0, 0.7)]);
        tally.add(vec![]);
        let score = tally.score(&Method::Luma);
        assert!((score.per_frame - 1.0).abs() < 1e-12);
        assert!((score.score.unwrap() - 0.7).abs() < 1e-6);
        // One of three: the last frame's objects are not followed.
        assert!((score.kept.unwrap() - 1.0 / 3.0).abs() < 1e-12);
        let nothing = Tally::default().score(&Method::Luma);
        assert_eq!((nothing.score, nothing.kept), (None, None));
    }
}
