//! Pinhole cameras.

use glam::{DMat3, DVec3};
use gs_chroma::capture;
use numpy::PyArrayDyn;
use pyo3::prelude::*;

use crate::{
    arrays::{exactly, of_shape},
    settings::within,
};

/// The longest side of a picture, in pixels.
const LONGEST: u32 = 1 << 15;

/// How far a rotation's rows may be from those of an orthonormal matrix.
const SLACK: f64 = 1e-3;

/// A pinhole camera with its pose, as COLMAP defines them: axes x right, y down, z forward; a
/// point X of the world is at `rotation @ X + translation`; the center of the top left pixel is
/// at (0.5, 0.5).
#[pyclass(frozen, module = "gs_chroma")]
pub struct Camera(pub capture::Camera);

#[pymethods]
impl Camera {
    #[new]
    #[pyo3(signature = (width, height, fx, fy, cx, cy, rotation, translation))]
    #[allow(
        clippy::too_many_arguments,
        reason = "keywords of Python: they are what a camera is"
    )]
    fn new(
        width: u32,
        height: u32,
        fx: f64,
        fy: f64,
        cx: f64,
        cy: f64,
        rotation: &Bound<'_, PyAny>,
        translation: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        within("width", width, [1, LONGEST])?;
        within("height", height, [1, LONGEST])?;
        for (name, focal) in [("fx", fx), ("fy", fy)] {
            within(name, focal, [f64::MIN_POSITIVE, f64::MAX])?;
        }
        for (name, center) in [("cx", cx), ("cy", cy)] {
            within(name, center, [f64::MIN, f64::MAX])?;
        }
        let rotation: [f64; 9] = exactly("rotation", rotation, &[3, 3])?;
        let translation: [f64; 3] = exactly("translation", translation, &[3])?;
        // Rows come first in NumPy, columns in glam.
        let rotation = DMat3::from_cols_array(&rotation).transpose();
        let off = rotation * rotation.transpose() - DMat3::IDENTITY;
        let off = off
            .to_cols_array()
            .map(f64::abs)
            .into_iter()
            .fold(0.0, f64::max);
        within(
            "rotation's distance from an orthonormal matrix",
            off,
            [0.0, SLACK],
        )?;
        within("rotation's determinant", rotation.determinant(), [0.5, 1.5])?;
        Ok(Self(capture::Camera {
            width,
            height,
            fx,
            fy,
            cx,
            cy,
            rotation,
            translation: DVec3::from(translation),
        }))
    }

    /// Width of the picture in pixels.
    #[getter]
    fn width(&self) -> u32 {
        self.0.width
    }

    /// Height of the picture in pixels.
    #[getter]
    fn height(&self) -> u32 {
        self.0.height
    }

    /// Horizontal focal length in pixels.
    #[getter]
    fn fx(&self) -> f64 {
        self.0.fx
    }

    /// Vertical focal length in pixels.
    #[getter]
    fn fy(&self) -> f64 {
        self.0.fy
    }

    /// Horizontal principal point in pixels.
    #[getter]
    fn cx(&self) -> f64 {
        self.0.cx
    }

    /// Vertical principal point in pixels.
    #[getter]
    fn cy(&self) -> f64 {
        self.0.cy
    }

    /// World-to-camera rotation, float64 `[3, 3]`.
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let rows = self.0.rotation.transpose().to_cols_array();
        of_shape(py, rows.to_vec(), &[3, 3])
    }

    /// World-to-camera translation in world units, float64 `[3]`.
    #[getter]
    fn translation<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        of_shape(py, self.0.translation.to_array().to_vec(), &[3])
    }

    /// The camera's center in world units, float64 `[3]`.
    #[getter]
    fn center<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        of_shape(py, self.0.center().to_array().to_vec(), &[3])
    }

    /// The same view at another size.
    fn resized(&self, width: u32, height: u32) -> PyResult<Self> {
        within("width", width, [1, LONGEST])?;
        within("height", height, [1, LONGEST])?;
        Ok(Self(self.0.resized(width, height)))
    }

    fn __repr__(&self) -> String {
        let capture::Camera {
            width,
            height,
            fx,
            fy,
            ..
        } = &self.0;
        format!("Camera({width} x {height}, fx={fx:.2}, fy={fy:.2})")
    }
}
