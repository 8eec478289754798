//! Exceptions: one tree, whose branches are the library's errors.

use gs_chroma::{capture, chroma, chroma::teacher, gpu, low_level::AnswerError, luma, splats};
use pyo3::{
    PyErr, create_exception,
    exceptions::{PyException, PyTypeError},
};

create_exception!(gs_chroma, Error, PyException, "Error of gs-chroma.");
create_exception!(
    gs_chroma,
    CaptureError,
    Error,
    "Photos or their model cannot be loaded."
);
create_exception!(
    gs_chroma,
    GpuError,
    Error,
    "The device failed or is missing."
);
create_exception!(
    gs_chroma,
    LumaError,
    Error,
    "The training of a gray scene failed."
);
create_exception!(gs_chroma, ChromaError, Error, "A scene cannot be colored.");
create_exception!(
    gs_chroma,
    TeacherError,
    Error,
    "A teacher cannot be opened, or its answer is no picture."
);
create_exception!(
    gs_chroma,
    SplatError,
    Error,
    "A splat file cannot be read or written."
);
create_exception!(
    gs_chroma,
    CommandError,
    Error,
    "A command on a run folder failed."
);

/// Error of the library on its way to Python.
pub trait IntoPython {
    /// The exception.
    fn into_python(self) -> PyErr;
}

/// The result with an exception of Python.
pub fn python<T, E: IntoPython>(result: Result<T, E>) -> Result<T, PyErr> {
    result.map_err(E::into_python)
}

impl IntoPython for capture::CaptureError {
    fn into_python(self) -> PyErr {
        CaptureError::new_err(self.to_string())
    }
}

impl IntoPython for gpu::GpuError {
    fn into_python(self) -> PyErr {
        GpuError::new_err(self.to_string())
    }
}

impl IntoPython for splats::SplatError {
    fn into_python(self) -> PyErr {
        SplatError::new_err(self.to_string())
    }
}

impl IntoPython for teacher::TeacherError {
    fn into_python(self) -> PyErr {
        let text = self.to_string();
        match self {
            Self::NoRuntime { .. } => {
                TeacherError::new_err(format!("{text}, or: pip install onnxruntime"))
            }
            Self::NotFetched { name } => {
                TeacherError::new_err(format!("{text}: gs-chroma teacher fetch {name}"))
            }
            _ => TeacherError::new_err(text),
        }
    }
}

impl IntoPython for luma::LumaError {
    fn into_python(self) -> PyErr {
        match self {
            Self::Gpu(error) => error.into_python(),
            Self::Capture(error) => error.into_python(),
            other => LumaError::new_err(other.to_string()),
        }
    }
}

impl IntoPython for chroma::ChromaError {
    fn into_python(self) -> PyErr {
        match self {
            Self::Gpu(error) => error.into_python(),
            Self::Capture(error) => error.into_python(),
            Self::Colorizer(error) => {
                // A teacher's own exception comes back as it was raised.
                let error = match error.downcast::<PyErr>() {
                    Ok(raised) => return *raised,
                    Err(other) => other,
                };
                match error.downcast::<teacher::TeacherError>() {
                    Ok(error) => error.into_python(),
                    Err(other) => ChromaError::new_err(other.to_string()),
                }
            }
            other => ChromaError::new_err(other.to_string()),
        }
    }
}

impl IntoPython for AnswerError {
    fn into_python(self) -> PyErr {
        match self {
            Self::Usage(reason) => PyTypeError::new_err(reason),
            Self::Failed(error) => CommandError::new_err(error.to_string()),
        }
    }
}
