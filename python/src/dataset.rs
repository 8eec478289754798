//! Photos with poses.

use std::{path::PathBuf, sync::Arc};

use gs_chroma::capture::{self, LoadOptions, Normalize, Notice};
use numpy::PyArrayDyn;
use pyo3::{
    exceptions::{PyIndexError, PyValueError},
    prelude::*,
    types::{PyDict, PyString},
};

use crate::{
    arrays::of_shape,
    camera::Camera,
    error::python,
    progress::{Progress, Reporter},
    settings::{overlaid, to_python, within},
};

/// The shortest that photos' longer side may be scaled to, in pixels.
const SHORTEST: u32 = 16;

/// Photos of a COLMAP folder with their cameras, at working size. Photos are decoded when they
/// are asked for.
#[pyclass(frozen, module = "gs_chroma")]
pub struct Dataset(pub Arc<capture::Dataset>);

#[pymethods]
impl Dataset {
    /// Opens a COLMAP folder with images/ and sparse/.
    ///
    /// `max_side` is the longer side that larger photos are scaled to, in pixels. Every 8th view
    /// is held out, unless `holdout=False`. What is left out or doubtful is a warning.
    #[staticmethod]
    #[pyo3(signature = (dir, *, progress=None, **options))]
    fn open(
        py: Python<'_>,
        dir: PathBuf,
        progress: Option<Py<PyAny>>,
        options: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        let options = load_options(options)?;
        py.detach(|| {
            let mut reporter = Reporter::new(progress);
            let mut ended = false;
            let opened = capture::Dataset::open(&dir, &options, &mut |notice| {
                let told = match notice {
                    Notice::Doubt(line) => reporter.warn(line),
                    Notice::LeftOut(left_out) => {
                        reporter.warn(&format!("left out {}: {}", left_out.name, left_out.reason))
                    }
                    Notice::Sampled { done, total, name } => {
                        reporter.tell(Progress::of("photos", done, total, name))
                    }
                    Notice::Normalized(_) => return,
                };
                ended |= told.is_break();
            });
            reporter
                .end(python(opened))
                .map(|dataset| Self(Arc::new(dataset)))
        })
    }

    /// Number of views.
    fn __len__(&self) -> usize {
        self.0.cameras.len()
    }

    /// Name of each view: its photo's path below `images/`.
    #[getter]
    fn names(&self) -> Vec<&str> {
        let views = self.0.capture.views.iter();
        views.map(|view| view.name.as_str()).collect()
    }

    /// Camera of each view, at working size.
    #[getter]
    fn cameras(&self) -> Vec<Camera> {
        self.0.cameras.iter().cloned().map(Camera).collect()
    }

    /// Indices of the views that are trained on.
    #[getter]
    fn train(&self) -> Vec<usize> {
        self.0.split.train.clone()
    }

    /// Indices of the views that are held out.
    #[getter]
    fn test(&self) -> Vec<usize> {
        self.0.split.test.clone()
    }

    /// COLMAP's points in world units, float64 `[P, 3]`.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let points = self.0.capture.points.iter();
        let points: Vec<f64> = points.flat_map(|point| point.position.to_array()).collect();
        let count = points.len() / 3;
        of_shape(py, points, &[count, 3])
    }

    /// The scene's extent in world units: 1.1 times the largest distance of a camera from the
    /// cameras' mean.
    #[getter]
    fn extent(&self) -> f64 {
        self.0.extent
    }

    /// Offset that was subtracted from COLMAP's coordinates, in world units, float64 `[3]`; zero
    /// unless these were large.
    #[getter]
    fn offset<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        of_shape(py, self.0.capture.offset.to_array().to_vec(), &[3])
    }

    /// Options of loading, as a dictionary.
    #[getter]
    fn options<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.0.options)
    }

    /// The gray photo of a view, uint8 `[height, width]`, sRGB-encoded.
    fn photo<'py>(&self, py: Python<'py>, view: usize) -> PyResult<Bound<'py, PyArrayDyn<u8>>> {
        self.check(view)?;
        let photo = py.detach(|| python(self.0.photo(view)))?;
        let size = [photo.height as usize, photo.width as usize];
        of_shape(py, photo.gray.clone(), &size)
    }

    /// The mask of a view, uint8 `[height, width]`: 255 where a pixel counts; `None` where all do.
    fn mask<'py>(
        &self,
        py: Python<'py>,
        view: usize,
    ) -> PyResult<Option<Bound<'py, PyArrayDyn<u8>>>> {
        self.check(view)?;
        let photo = py.detach(|| python(self.0.photo(view)))?;
        let size = [photo.height as usize, photo.width as usize];
        let mask = photo.mask.clone();
        mask.map(|mask| of_shape(py, mask, &size)).transpose()
    }

    fn __repr__(&self) -> String {
        let dataset = &self.0;
        format!(
            "Dataset({}, {} views, {} held out, {} points)",
            dataset.capture.root.display(),
            dataset.cameras.len(),
            dataset.split.test.len(),
            dataset.capture.points.len()
        )
    }
}

impl Dataset {
    /// Refuses the index of a view that is not there.
    pub fn check(&self, view: usize) -> PyResult<()> {
        match view < self.0.cameras.len() {
            true => Ok(()),
            false => Err(PyIndexError::new_err(format!("there is no view {view}"))),
        }
    }
}

/// Options in keywords, over the library's defaults.
fn load_options(keywords: Option<&Bound<'_, PyDict>>) -> PyResult<LoadOptions> {
    let Some(keywords) = keywords else {
        return Ok(LoadOptions::default());
    };
    // In JSON there is no word for `auto`.
    let normalize = match keywords.get_item("normalize")? {
        None => Normalize::default(),
        Some(word) if word.is_instance_of::<PyString>() => {
            let word: String = word.extract()?;
            word.parse().map_err(PyValueError::new_err)?
        }
        Some(range) => {
            let [low, high]: [f64; 2] = range.extract()?;
            let words = format!("{low},{high}");
            words.parse().map_err(PyValueError::new_err)?
        }
    };
    let others = keywords.copy()?;
    if others.contains("normalize")? {
        others.del_item("normalize")?;
    }
    let options = overlaid(&LoadOptions::default(), Some(&others))?;
    if let Some(side) = options.max_side {
        within("max_side", side, [SHORTEST, u32::MAX])?;
    }
    Ok(LoadOptions {
        normalize,
        ..options
    })
}
