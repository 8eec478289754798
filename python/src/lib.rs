//! gs-chroma for Python: `gs_chroma._native`, which `gs_chroma/__init__.py` shows to users.
//!
//! ```text
//! lib → commands, program → colorize → fit, render, teacher → dataset, splats → arrays, camera, device, progress, settings → error
//! ```

mod arrays;
mod camera;
mod colorize;
mod commands;
mod dataset;
mod device;
mod error;
mod fit;
mod program;
mod progress;
mod render;
mod settings;
mod splats;
mod teacher;

/// The compiled part of the package `gs_chroma`.
#[pyo3::pymodule(name = "_native")]
mod native {
    #[pymodule_export]
    use crate::{
        camera::Camera,
        colorize::{Colored, colorize},
        commands::answer,
        dataset::Dataset,
        device::device,
        error::{
            CaptureError, ChromaError, CommandError, Error, GpuError, LumaError, SplatError,
            TeacherError,
        },
        fit::{LumaScene, fit},
        program::{declare, main, variables},
        progress::Progress,
        render::render,
        splats::Splats,
    };
    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
