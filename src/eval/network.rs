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
        let failure = |reason: String| EvalError::Network {
            path: path.to_owned(),
            reason,
        };
        if !path.is_file() {
            return Err(failure("no such file; an ONNX model is needed".to_owned()));
        }
        let session = load_model(path).map_err(|error| match error {
            TeacherError::BadModel { reason, .. } => {
                failure(format!("not a usable ONNX model: {reason}"))
            }
            other => other.into(),
        })?;
        Ok(Self {
            path: path.to_owned(),
            session,
        })
    }

    /// Shapes of the inputs, -1 where left open; `None` where one is no tensor of 32-bit floats.
    pub fn inputs(&self) -> Option<Vec<Vec<i64>>> {
        self.session.inputs().iter().map(shape).collect()
    }

    /// The same of the outputs.
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
            self.failure(text.lines().next().unwrap_or_default().to_owned())
        })
    }

    pub fn failure(&self, reason: String) -> EvalError {
        EvalError::Network {
            path: self.path.clone(),
            reason,
        }
    }
}

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
