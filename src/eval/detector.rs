//! Objects that a detector of the user's sees in pictures.

use std::{collections::BTreeMap, path::Path};

use image::{DynamicImage, Rgb, RgbImage, imageops};

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
        let size = match network.image_inputs().as_deref() {
            Some([size]) => *size,
            _ => None,
        };
        let shape = network.outputs().and_then(|all| all.into_iter().next());
        let layout = size.zip(shape).and_then(|(size, mut shape)| {
            if let Some(batch @ -1) = shape.first_mut() {
                *batch = 1;
            }
            Some((size, BoxLayout::of(&shape, size)?, shape))
        });
        let (size, layout, shape) = layout.ok_or_else(|| {
            network.failure(
                "a detector has one input [1,3,H,W] and boxes [1,N,5+classes] or [1,4+classes,N], 32-bit floats of fixed sizes: export it so",
            )
        })?;
        Ok(Self {
            network,
            size,
            shape,
            layout,
        })
    }

    /// Objects in a picture.
    fn detect(&mut self, picture: RgbImage) -> Result<Vec<Detection>, EvalError> {
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
            let reason = format!("answers with other numbers than {:?}", self.shape);
            return Err(self.network.failure(reason));
        }
        Ok(self.layout.decode(&self.shape, &values, self.size))
    }
}

/// A picture as large as fits, in the upper left.
fn boxed(picture: RgbImage, [width, height]: [u32; 2]) -> RgbImage {
    let filter = imageops::FilterType::Triangle;
    let fitting = DynamicImage::from(picture).resize(width, height, filter);
    let mut input = RgbImage::from_pixel(width, height, MARGIN);
    imageops::replace(&mut input, &fitting.into_rgb8(), 0, 0);
    input
}

/// Objects in each method's frames so far.
#[derive(Default)]
pub struct Detected(BTreeMap<Method, Vec<Vec<Detection>>>);

impl Detected {
    /// Adds the next frame.
    pub fn add(&mut self, detector: &mut Detector, drawing: &Drawing) -> Result<(), EvalError> {
        let (width, height) = (drawing.gray.width, drawing.gray.height);
        for (method, pixels) in drawing.pictures() {
            let found = detector.detect(to_image(width, height, &pixels))?;
            self.0.entry(method).or_default().push(found);
        }
        Ok(())
    }

    pub fn scores(&self) -> Vec<DetectionScore> {
        let share = |part: f64, whole: usize| (whole > 0).then(|| part / whole as f64);
        let score = |(method, frames): (&Method, &Vec<Vec<Detection>>)| {
            let count = frames.iter().flatten().count();
            let scores = frames.iter().flatten().map(|one| f64::from(one.score));
            // The last frame's have no next one.
            let followed = count - frames.last().map_or(0, Vec::len);
            let kept: usize = frames.windows(2).map(|pair| kept(&pair[0], &pair[1])).sum();
            DetectionScore {
                method: method.clone(),
                per_frame: count as f64 / frames.len() as f64,
                score: share(scores.sum(), count),
                kept: share(kept as f64, followed),
            }
        };
        self.0.iter().map(score).collect()
    }
}
