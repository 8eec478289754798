//! The program, run in Python's process.

use std::{
    ffi::OsString,
    io::{self, Write},
    path::PathBuf,
};

use gs_chroma::low_level::{self, Cli, Invocation};
use pyo3::prelude::*;

/// Names of the environment variables that are to be 1.
#[pyfunction]
pub fn variables() -> Vec<&'static str> {
    low_level::variables()
}

/// Says how the program is started anew, what its arguments are, and in which folders ONNX
/// Runtime may lie.
#[pyfunction]
pub fn declare(command: Vec<OsString>, arguments: Vec<OsString>, libraries: Vec<PathBuf>) {
    let invocation = Invocation {
        command,
        arguments,
        libraries,
    };
    invocation.declare();
}

/// Runs the program with the arguments that were declared, and gives its exit status.
#[pyfunction]
pub fn main(py: Python<'_>) -> PyResult<u8> {
    py.detach(|| {
        let status = Cli::of_arguments().main();
        // Python does not know of this buffer.
        io::stdout().flush()?;
        Ok(status)
    })
}
