//! Gaussians as arrays of NumPy, in files, and under gsplat's names.

use std::path::PathBuf;

use glam::DVec3;
use gs_chroma::{
    capture::Capture,
    splats::{self, ShField, WriteOptions, read_splats, sh::coefficient_count, write_splats},
};
use numpy::PyArrayDyn;
use pyo3::{exceptions::PyValueError, prelude::*, types::PyDict};

use crate::{
    arrays::{exactly, floats, of_shape, rows, shape_error},
    error::python,
    progress::warn,
};

/// Opacity logits for which infinite ones stand: such Gaussians are opaque or not there.
const SURE: f32 = 80.0;

/// A set of N Gaussians, as arrays of NumPy. An array that is read is a copy.
#[pyclass(frozen, module = "gs_chroma", skip_from_py_object)]
#[derive(Clone)]
pub struct Splats {
    /// The Gaussians.
    pub splats: splats::Splats,
    /// Offset that was subtracted from COLMAP's coordinates, in world units.
    pub offset: DVec3,
    /// True if opacities fall by what the screen blur spreads (Mip-Splatting).
    pub antialiased: bool,
}

#[pymethods]
impl Splats {
    #[new]
    #[pyo3(signature = (*, means, log_scales, quaternions, opacity_logits, sh, offset=None, antialiased=false))]
    fn new(
        means: &Bound<'_, PyAny>,
        log_scales: &Bound<'_, PyAny>,
        quaternions: &Bound<'_, PyAny>,
        opacity_logits: &Bound<'_, PyAny>,
        sh: &Bound<'_, PyAny>,
        offset: Option<&Bound<'_, PyAny>>,
        antialiased: bool,
    ) -> PyResult<Self> {
        let means: Vec<[f32; 3]> = rows("means", means)?;
        let count = means.len();
        let splats = splats::Splats {
            means,
            log_scales: as_many("log_scales", rows("log_scales", log_scales)?, count)?,
            quats: as_many("quaternions", rows("quaternions", quaternions)?, count)?,
            opacity_logits: logits(opacity_logits, count)?,
            sh: field(sh, count)?,
        };
        if splats
            .quats
            .iter()
            .any(|q| q.iter().all(|&value| value == 0.0))
        {
            return Err(PyValueError::new_err("quaternions: one is zero"));
        }
        let offset = offset.map(|offset| exactly("offset", offset, &[3]));
        Ok(Self {
            splats,
            offset: offset.transpose()?.map_or(DVec3::ZERO, DVec3::from),
            antialiased,
        })
    }

    /// Reads a splat file: .ply, .compressed.ply, .splat, .spz or .sog. What is doubtful about it
    /// is a warning.
    #[staticmethod]
    fn read(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let read = py.detach(|| python(read_splats(&path)))?;
        let shown = path.display();
        if read.skipped > 0 {
            let count = read.skipped;
            warn(
                py,
                &format!("{shown}: {count} Gaussians are not finite, and left out"),
            )?;
        }
        for doubt in &read.doubts {
            warn(py, &format!("{shown}: {doubt}"))?;
        }
        Ok(Self {
            splats: read.splats,
            offset: read.offset,
            antialiased: read.antialiased,
        })
    }

    /// Writes a splat file, whose name tells the format: .ply, .compressed.ply, .splat, .spz,
    /// .sog, .glb or .usda. Gray becomes RGB. What the format loses is a warning.
    fn write(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let options = WriteOptions {
            generator: format!("gs-chroma {}", env!("CARGO_PKG_VERSION")),
            antialiased: self.antialiased,
            offset: self.offset,
            added: DVec3::ZERO,
        };
        if self.splats.sh.channels == 2 {
            return Err(PyValueError::new_err("chroma alone is no splat file"));
        }
        let written = py.detach(|| python(write_splats(&path, &self.splats, &options)))?;
        written.iter().try_for_each(|doubt| warn(py, doubt))
    }

    /// From the parameters of gsplat: a dictionary of arrays or tensors `means` [N, 3], `scales`
    /// (logarithms) [N, 3], `quats` (w x y z) [N, 4], `opacities` (logits) [N], `sh0` [N, 1, 3]
    /// and `shN` [N, K, 3], K being 0, 3, 8 or 15.
    #[staticmethod]
    #[pyo3(signature = (params, *, offset=None, antialiased=false))]
    fn from_gsplat(
        params: &Bound<'_, PyAny>,
        offset: Option<&Bound<'_, PyAny>>,
        antialiased: bool,
    ) -> PyResult<Self> {
        let of = |name: &str| params.get_item(name);
        let (shape, constant) = floats("sh0", &of("sh0")?)?;
        if shape.len() != 3 || shape[1..] != [1, 3] {
            return Err(shape_error("sh0", &shape, "[N, 1, 3]"));
        }
        let (rest_shape, rest) = match params.contains("shN")? {
            true => floats("shN", &of("shN")?)?,
            false => (vec![shape[0], 0, 3], Vec::new()),
        };
        if rest_shape.len() != 3 || rest_shape[0] != shape[0] || rest_shape[2] != 3 {
            return Err(shape_error("shN", &rest_shape, "[N, 0, 3, 8 or 15, 3]"));
        }
        let each = 3 * rest_shape[1];
        let harmonics: Vec<f32> = (0..shape[0])
            .flat_map(|i| [&constant[3 * i..3 * i + 3], &rest[each * i..each * (i + 1)]].concat())
            .collect();
        let all = of_shape(params.py(), harmonics, &[shape[0], 1 + rest_shape[1], 3])?;
        Self::new(
            &of("means")?,
            &of("scales")?,
            &of("quats")?,
            &of("opacities")?,
            all.as_any(),
            offset,
            antialiased,
        )
    }

    /// The parameters of gsplat, a dictionary of float32 arrays as `from_gsplat` takes it.
    fn to_gsplat<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let field = self.splats.sh.to_rgb();
        if field.channels != 3 {
            return Err(PyValueError::new_err("chroma alone is no RGB"));
        }
        let (count, terms) = (self.splats.len(), coefficient_count(field.degree));
        let each = || field.coefficients.chunks_exact(3 * terms);
        let constant: Vec<f32> = each().flat_map(|all| &all[..3]).copied().collect();
        let rest: Vec<f32> = each().flat_map(|all| &all[3..]).copied().collect();
        let params = PyDict::new(py);
        params.set_item("means", self.means(py)?)?;
        params.set_item("scales", self.log_scales(py)?)?;
        params.set_item("quats", self.quaternions(py)?)?;
        params.set_item("opacities", self.opacity_logits(py)?)?;
        params.set_item("sh0", of_shape(py, constant, &[count, 1, 3])?)?;
        params.set_item("shN", of_shape(py, rest, &[count, terms - 1, 3])?)?;
        Ok(params)
    }

    /// The same Gaussians in gray: one channel, the mean of all.
    fn to_luma(&self) -> Self {
        Self {
            splats: self.splats.to_luma(),
            ..*self
        }
    }

    /// Number of Gaussians.
    fn __len__(&self) -> usize {
        self.splats.len()
    }

    /// Centers in world units, float32 `[N, 3]`.
    #[getter]
    fn means<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        of_rows(py, &self.splats.means)
    }

    /// Natural logarithms of the standard deviations along the rotated axes, in world units,
    /// float32 `[N, 3]`.
    #[getter]
    fn log_scales<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        of_rows(py, &self.splats.log_scales)
    }

    /// Rotations as quaternions w x y z of any length, float32 `[N, 4]`.
    #[getter]
    fn quaternions<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        of_rows(py, &self.splats.quats)
    }

    /// Logits of the opacities, float32 `[N]`.
    #[getter]
    fn opacity_logits<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        of_shape(py, self.splats.opacity_logits.clone(), &[self.splats.len()])
    }

    /// SH coefficients, float32 `[N, (degree + 1)², channels]`, in the order and with the signs of
    /// 3D Gaussian Splatting: 1 channel gray, 3 RGB, sRGB-encoded less 0.5; 2 CIELAB a and b.
    #[getter]
    fn sh<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let ShField {
            degree,
            channels,
            coefficients,
        } = &self.splats.sh;
        let shape = [self.splats.len(), coefficient_count(*degree), *channels];
        of_shape(py, coefficients.clone(), &shape)
    }

    /// Offset that was subtracted from COLMAP's coordinates, in world units, float64 `[3]`.
    #[getter]
    fn offset<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        of_shape(py, self.offset.to_array().to_vec(), &[3])
    }

    /// True if opacities fall by what the screen blur spreads (Mip-Splatting).
    #[getter]
    fn antialiased(&self) -> bool {
        self.antialiased
    }

    fn __repr__(&self) -> String {
        let ShField {
            degree, channels, ..
        } = &self.splats.sh;
        let count = self.splats.len();
        format!("Splats({count} Gaussians, {channels} channels, SH degree {degree})")
    }
}

impl Splats {
    /// The Gaussians in the coordinates of a capture, which may be moved.
    pub fn seen_by(&self, capture: &Capture) -> splats::Splats {
        let by = self.offset - capture.offset;
        let mut moved = self.splats.clone();
        if by != DVec3::ZERO {
            for mean in &mut moved.means {
                *mean = (DVec3::from(mean.map(f64::from)) + by).as_vec3().to_array();
            }
        }
        moved
    }
}

fn of_rows<'py, const N: usize>(
    py: Python<'py>,
    rows: &[[f32; N]],
) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
    of_shape(py, rows.as_flattened().to_vec(), &[rows.len(), N])
}

/// Refuses another number of rows than there are Gaussians.
fn as_many<T>(name: &str, rows: Vec<T>, count: usize) -> PyResult<Vec<T>> {
    match rows.len() == count {
        true => Ok(rows),
        false => Err(PyValueError::new_err(format!(
            "{name}: {} rows for {count} means",
            rows.len()
        ))),
    }
}

fn logits(value: &Bound<'_, PyAny>, count: usize) -> PyResult<Vec<f32>> {
    // Opaque Gaussians have infinite ones.
    let numpy = value.py().import("numpy")?;
    let value = numpy.call_method1("clip", (crate::arrays::array(value)?, -SURE, SURE))?;
    let (shape, logits) = floats("opacity_logits", &value)?;
    match shape == [count] || shape == [count, 1] {
        true => Ok(logits),
        false => Err(shape_error("opacity_logits", &shape, &format!("[{count}]"))),
    }
}

fn field(value: &Bound<'_, PyAny>, count: usize) -> PyResult<ShField> {
    let (shape, coefficients) = floats("sh", value)?;
    let found = match shape[..] {
        [rows, terms, channels @ 1..=3] if rows == count => (0..=splats::sh::MAX_DEGREE)
            .find(|&degree| coefficient_count(degree) == terms)
            .map(|degree| ShField {
                degree,
                channels,
                coefficients,
            }),
        _ => None,
    };
    found.ok_or_else(|| {
        shape_error(
            "sh",
            &shape,
            &format!("[{count}, 1, 4, 9 or 16, 1, 2 or 3]"),
        )
    })
}
