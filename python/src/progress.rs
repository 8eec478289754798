//! Progress for a callable, and its end by an exception or Ctrl-C.

use std::{ffi::CString, ops::ControlFlow};

use pyo3::{exceptions::PyUserWarning, prelude::*};

/// Progress of a job; `str()` of it is a line.
#[pyclass(frozen, module = "gs_chroma", get_all)]
#[derive(Default)]
pub struct Progress {
    /// Stage of the job.
    pub stage: String,
    /// Steps of the stage that are done.
    pub done: usize,
    /// Steps of the stage in all; 0 where they are not counted.
    pub total: usize,
    /// The photo at hand, or figures of the moment.
    pub message: String,
    /// Loss, where something is trained or solved.
    pub loss: Option<f64>,
    /// Number of Gaussians, while they are trained.
    pub gaussians: Option<usize>,
}

#[pymethods]
impl Progress {
    fn __str__(&self) -> String {
        let mut text = self.stage.clone();
        if self.total > 0 {
            text += &format!(" {}/{}", self.done, self.total);
        }
        if let Some(loss) = self.loss {
            text += &format!(", loss {loss:.4}");
        }
        if let Some(gaussians) = self.gaussians {
            text += &format!(", {gaussians} Gaussians");
        }
        match self.message.is_empty() {
            true => text,
            false => text + ": " + &self.message,
        }
    }

    fn __repr__(&self) -> String {
        format!("Progress({})", self.__str__())
    }
}

impl Progress {
    /// Steps of a stage.
    pub fn of(stage: &str, done: usize, total: usize, message: &str) -> Self {
        Self {
            stage: stage.to_owned(),
            done,
            total,
            message: message.to_owned(),
            ..Self::default()
        }
    }
}

/// The caller's callable, and the exception that ends the job.
pub struct Reporter {
    call: Option<Py<PyAny>>,
    raised: Option<PyErr>,
}

impl Reporter {
    /// For a callable or none.
    pub fn new(call: Option<Py<PyAny>>) -> Self {
        Self { call, raised: None }
    }

    /// Calls, and looks for signals; breaks once either has raised an exception.
    pub fn tell(&mut self, progress: Progress) -> ControlFlow<()> {
        self.attached(|py, call| {
            if let Some(call) = call {
                call.call1(py, (progress,))?;
            }
            Ok(())
        })
    }

    /// Warns by Python's ways, which may raise an exception.
    pub fn warn(&mut self, line: &str) -> ControlFlow<()> {
        self.attached(|py, _| warn(py, line))
    }

    fn attached(
        &mut self,
        act: impl FnOnce(Python<'_>, Option<&Py<PyAny>>) -> PyResult<()>,
    ) -> ControlFlow<()> {
        if self.raised.is_some() {
            return ControlFlow::Break(());
        }
        let acted = Python::attach(|py| {
            py.check_signals()?;
            act(py, self.call.as_ref())
        });
        match acted {
            Ok(()) => ControlFlow::Continue(()),
            Err(raised) => {
                self.raised = Some(raised);
                ControlFlow::Break(())
            }
        }
    }

    /// The result of the job, or the exception that has ended it.
    pub fn end<T>(self, result: PyResult<T>) -> PyResult<T> {
        match self.raised {
            Some(raised) => Err(raised),
            None => result,
        }
    }
}

/// A warning of Python's about something doubtful.
pub fn warn(py: Python<'_>, line: &str) -> PyResult<()> {
    let line = CString::new(line.replace('\0', " "))?;
    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &line, 1)
}
