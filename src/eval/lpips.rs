//! Learned perceptual distance by a network of the user's.
//!
//! R. Zhang et al., *The Unreasonable Effectiveness of Deep Features as a Perceptual
//! Metric*, CVPR 2018. Its weights are no part of this project.

use std::path::Path;

use image::{ImageBuffer, Rgb, imageops};

use super::{EvalError, network::Network};

/// A network with two pictures in and one number out.
pub struct Lpips {
    network: Network,
    /// Width and height of its inputs, where the model fixes them.
    size: Option<[u32; 2]>,
}

impl Lpips {
    /// Opens a model: two inputs `[1, 3, H, W]` of f32 in [-1, 1], one number out.
    ///
    /// # Errors
    /// [`EvalError::Network`]; [`EvalError::Teacher`] without ONNX Runtime.
    pub fn open(path: &Path) -> Result<Self, EvalError> {
        let network = Network::open(path)?;
        let outputs = network.outputs().map(|outputs| outputs.len());
        match (network.image_inputs().as_deref(), outputs) {
            (Some(&[a, b]), Some(1)) if a == b => Ok(Self { network, size: a }),
            _ => Err(network.failure(
                "a perceptual distance has two inputs [1,3,H,W] of 32-bit floats and one output: export it so",
            )),
        }
    }

    /// The distance of two pictures, RGB in [0, 1] of one width and height.
    pub fn distance(
        &mut self,
        a: &[[f32; 3]],
        b: &[[f32; 3]],
        size: [u32; 2],
    ) -> Result<f64, EvalError> {
        let wanted = self.size.unwrap_or(size);
        let inputs = vec![input(a, size, wanted), input(b, size, wanted)];
        match self.network.run(inputs)?[..] {
            [distance] if distance.is_finite() => Ok(distance.into()),
            ref other => Err(self.network.failure(format!(
                "answers with {} numbers, the first {:?}, instead of a finite one",
                other.len(),
                other.first()
            ))),
        }
    }
}

/// A picture as `[1, 3, H, W]` in [-1, 1] at the wanted width and height.
fn input(pixels: &[[f32; 3]], size: [u32; 2], wanted: [u32; 2]) -> ([i64; 4], Vec<f32>) {
    let planes = |values: &[f32]| -> Vec<f32> {
        let channel = |c: usize| values.iter().skip(c).step_by(3).map(|v| 2.0 * v - 1.0);
        (0..3).flat_map(channel).collect()
    };
    let values = if size == wanted {
        planes(pixels.as_flattened())
    } else {
        let [width, height] = size;
        let image = ImageBuffer::from_fn(width, height, |x, y| {
            Rgb(pixels[y as usize * width as usize + x as usize])
        });
        let filter = imageops::FilterType::Triangle;
        planes(&imageops::resize(&image, wanted[0], wanted[1], filter))
    };
    ([1, 3, wanted[1].into(), wanted[0].into()], values)
}
