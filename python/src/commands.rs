//! Commands on run folders.

use std::{
    ops::ControlFlow,
    panic::{AssertUnwindSafe, catch_unwind, resume_unwind},
};

use gs_chroma::low_level::{self, Event};
use pyo3::prelude::*;

use crate::{
    error::python,
    progress::{Progress, Reporter},
};

/// Payload of the unwinding that ends a command between two of its events.
struct Stopped;

/// The result, as JSON, of the command that the arguments name.
#[pyfunction]
#[pyo3(signature = (arguments, progress=None))]
pub fn answer(
    py: Python<'_>,
    arguments: Vec<String>,
    progress: Option<Py<PyAny>>,
) -> PyResult<String> {
    py.detach(|| {
        let mut reporter = Reporter::new(progress);
        let observe = &mut |event: Event| {
            let told = match event {
                Event::Note(_) => ControlFlow::Continue(()),
                Event::Warning(line) => reporter.warn(&line),
                Event::Progress {
                    stage,
                    done,
                    total,
                    message,
                } => reporter.tell(Progress::of(&stage.to_string(), done, total, &message)),
            };
            if told.is_break() {
                // Commands cannot be told to end; whatever they hold is freed on the way.
                resume_unwind(Box::new(Stopped));
            }
        };
        let answered = catch_unwind(AssertUnwindSafe(|| low_level::answer(&arguments, observe)));
        let result = match answered {
            Ok(answered) => python(answered),
            Err(payload) if payload.is::<Stopped>() => Ok(String::new()),
            Err(payload) => resume_unwind(payload),
        };
        reporter.end(result)
    })
}
