//! ONNX models that measure pictures.

use std::path::{Path, PathBuf};

use ort::{
    session::{Session, SessionInputValue},
    value::{Outlet, Tensor, TensorElementType, ValueType},
};

use super::EvalError;
use crate::chroma::teacher::{TeacherError, load_model};

/// A model of the user's.
pub(super) struct Network {
    path: PathBuf,
    session: Session,
}

impl Network {
    /// Loads a model as those of teachers are.
    ///
    /// # Errors
    /// [`EvalError::Network`]; [`EvalError::Teacher`] without ONNX Runtime.
    pub fn open(path: &Path) -> Result<Self, EvalError> {
        let path = path.to_owned();
        let session = match path.is_file().then(|| load_model(&path)) {
            Some(Ok(session)) => session,
            Some(Err(TeacherError::BadModel { reason, .. })) => {
                let reason = format!("not a usable ONNX model: {reason}");
                return Err(EvalError::Network { path, reason });
            }
            Some(Err(other)) => return Err(other.into()),
            None => {
                let reason = "no such file; an ONNX model is needed".to_owned();
                return Err(EvalError::Network { path, reason });
            }
        };
        Ok(Self { path, session })
    }

    /// Width and height of each input, where fixed; `None` if one is no `[1, 3, H, W]`.
    pub fn image_inputs(&self) -> Option<Vec<Option<[u32; 2]>>> {
        let size = |outlet| match shape(outlet)?[..] {
            [1 | -1, 3, height, width] => match [width, height].map(u32::try_from) {
                [Ok(width @ 1..), Ok(height @ 1..)] => Some(Some([width, height])),
                _ => Some(None),
            },
            _ => None,
        };
        self.session.inputs().iter().map(size).collect()
    }

    /// Shapes of the outputs, -1 where left open.
    pub fn outputs(&self) -> Option<Vec<Vec<i64>>> {
        self.session.outputs().iter().map(shape).collect()
    }

    /// The first output for inputs of these shapes.
    pub fn run(&mut self, inputs: Vec<([i64; 4], Vec<f32>)>) -> Result<Vec<f32>, EvalError> {
        let ask = || {
            let inputs = inputs.into_iter().map(Tensor::from_array);
            let inputs = inputs.map(|tensor| tensor.map(SessionInputValue::from));
            let inputs: Vec<SessionInputValue<'_>> = inputs.collect::<ort::Result<_>>()?;
            let outputs = self.session.run(&*inputs)?;
            let (_, values) = outputs[0].try_extract_tensor::<f32>()?;
            Ok::<_, ort::Error>(values.to_vec())
        };
        let asked = ask();
        asked.map_err(|error| {
            let text = error.to_string();
            self.failure(text.lines().next().unwrap_or_default())
        })
    }

    pub fn failure(&self, reason: impl Into<String>) -> EvalError {
        EvalError::Network {
            path: self.path.clone(),
            reason: reason.into(),
        }
    }
}

/// The shape of a tensor of 32-bit floats.
fn shape(outlet: &Outlet) -> Option<Vec<i64>> {
    match outlet.dtype() {
        ValueType::Tensor {
            ty: TensorElementType::Float32,
            shape,
            ..
        } => Some(shape.to_vec()),
        _ => None,
    }
}
