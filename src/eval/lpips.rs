//! Learned perceptual distance by a network of the user's.
//!
//! R. Zhang et al., *The Unreasonable Effectiveness of Deep Features as a Perceptual
//! Metric*, CVPR 2018. Its weights are no part of this project.

use std::path::{Path, PathBuf};

use image::{ImageBuffer, Rgb, imageops};
use ort::{
    session::Session,
    value::{Outlet, Tensor, TensorElementType, ValueType},
};

use super::EvalError;
use crate::chroma::teacher::runtime;

/// A network with two pictures in and one number out.
pub struct Lpips {
    path: PathBuf,
    session: Session,
    /// Width and height of its inputs, where the model fixes them.
    size: Option<[u32; 2]>,
}

impl Lpips {
    /// Opens a model: two inputs `[1, 3, H, W]` of f32 in [-1, 1], one number out.
    ///
    /// # Errors
    /// [`EvalError::Network`]; [`EvalError::Teacher`] without ONNX Runtime.
    pub fn open(path: &Path) -> Result<Self, EvalError> {
        let failure = |reason: String| EvalError::Network {
            path: path.to_owned(),
            reason,
        };
        if !path.is_file() {
            return Err(failure("no such file; an ONNX model is needed".to_owned()));
        }
        let environment = runtime::environment()?;
        let load = || -> ort::Result<Session> {
            Session::builder(&environment)?
                .with_log_level(ort::logging::LogLevel::Fatal)?
                .commit_from_file(path)
        };
        let session = load()
            .map_err(|error| failure(format!("not a usable ONNX model: {}", first_line(error))))?;
        let sides: Option<Vec<[i64; 2]>> = session.inputs().iter().map(sides).collect();
        let size = match (sides.as_deref(), session.outputs().len()) {
            (Some(&[a, b]), 1) if a == b => match a.map(u32::try_from) {
                [Ok(height), Ok(width)] if width > 0 && height > 0 => Some([width, height]),
                _ => None,
            },
            _ => {
                return Err(failure(
                    "a perceptual distance has two inputs [1,3,H,W] of 32-bit floats and one output: export it so".to_owned(),
                ));
            }
        };
        Ok(Self {
            path: path.to_owned(),
            session,
            size,
        })
    }

    /// The distance of two pictures, RGB in [0, 1] of one width and height.
    pub fn distance(
        &mut self,
        a: &[[f32; 3]],
        b: &[[f32; 3]],
        size: [u32; 2],
    ) -> Result<f64, EvalError> {
        let wanted = self.size.unwrap_or(size);
        let run = |session: &mut Session| -> ort::Result<Vec<f32>> {
            let outputs = session.run(ort::inputs![
                tensor(a, size, wanted)?,
                tensor(b, size, wanted)?
            ])?;
            Ok(outputs[0].try_extract_tensor::<f32>()?.1.to_vec())
        };
        let failure = |reason: String| EvalError::Network {
            path: self.path.clone(),
            reason,
        };
        match run(&mut self.session).map_err(|error| failure(first_line(error)))?[..] {
            [distance] if distance.is_finite() => Ok(distance.into()),
            ref other => Err(failure(format!(
                "answers with {} numbers, the first {:?}, instead of a finite one",
                other.len(),
                other.first()
            ))),
        }
    }
}

/// Height and width of an image input, -1 where left open.
fn sides(outlet: &Outlet) -> Option<[i64; 2]> {
    match outlet.dtype() {
        ValueType::Tensor {
            ty: TensorElementType::Float32,
            shape,
            ..
        } => match shape[..] {
            [1 | -1, 3, height, width] => Some([height, width]),
            _ => None,
        },
        _ => None,
    }
}

/// A picture as `[1, 3, H, W]` in [-1, 1] at the wanted width and height.
fn tensor(pixels: &[[f32; 3]], size: [u32; 2], wanted: [u32; 2]) -> ort::Result<Tensor<f32>> {
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
    let shape = [1, 3, i64::from(wanted[1]), i64::from(wanted[0])];
    Tensor::from_array((shape, values))
}

/// First line of an error's message.
fn first_line(error: impl ToString) -> String {
    let text = error.to_string();
    text.lines().next().unwrap_or_default().to_owned()
}
