//! The device, which all jobs of a process share.

use std::sync::{Mutex, PoisonError};

use gs_chroma::gpu::Gpu;
use pyo3::prelude::*;

use crate::error::python;

static GPU: Mutex<Option<Gpu>> = Mutex::new(None);

/// The device, opened when it is first needed and again once it was lost.
pub fn gpu() -> PyResult<Gpu> {
    let mut opened = GPU.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(gpu) = opened.as_ref().filter(|gpu| gpu.wait().is_ok()) {
        return Ok(gpu.clone());
    }
    let gpu = python(Gpu::open())?;
    Ok(opened.insert(gpu).clone())
}

/// Name and driver of the device that jobs run on: the fastest one, or the one that the
/// environment variable `WGPU_ADAPTER_NAME` named when the first job began.
#[pyfunction]
pub fn device(py: Python<'_>) -> PyResult<String> {
    Ok(py.detach(gpu)?.describe())
}
