//! Stage 2: a gray scene and a teacher in, a colored scene out.

use std::sync::Arc;

use gs_chroma::{
    capture::Dataset as Photos,
    chroma::{
        self, ChromaError, ChromaProgress, ChromaSettings, ColorizeEvent, Degree, Distill,
        NoChromaCheckpoints, SolverKind, native_rgb, teach, teacher::TeacherSettings,
    },
    raster::{Raster, RasterOptions, RenderedImage, SceneRenderer},
    splats::{self, sh::coefficient_count},
};
use numpy::PyArrayDyn;
use pyo3::{
    exceptions::{PyTypeError, PyValueError},
    prelude::*,
    types::{PyDict, PyString},
};

use crate::{
    arrays::of_shape,
    dataset::Dataset,
    device::gpu,
    error::python,
    fit::LumaScene,
    progress::{Progress, Reporter, warn},
    settings::{of_python, overlaid, to_python, within},
    splats::Splats,
    teacher::Teacher,
};

/// Iterations of Adam, as the code of ChromaDistill has them.
const ADAM_ITERATIONS: usize = 3_000;

/// A colored scene.
#[pyclass(frozen, module = "gs_chroma")]
pub struct Colored {
    colored: chroma::Colored,
    /// Photos that it was colored from.
    pub dataset: Arc<Photos>,
    drawn: RasterOptions,
}

#[pymethods]
impl Colored {
    /// The Gaussians with RGB harmonics, as splat files have them.
    #[getter]
    pub(crate) fn splats(&self) -> Splats {
        Splats {
            splats: self.colored.splats.clone(),
            offset: self.dataset.capture.offset,
            antialiased: self.drawn.antialiased,
        }
    }

    /// SH coefficients of CIELAB a and b, float32 `[N, (degree + 1)², 2]`, from which RGB is made.
    #[getter]
    fn chroma<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArrayDyn<f32>>> {
        let field = &self.colored.distilled.chroma;
        let shape = [
            self.colored.splats.len(),
            coefficient_count(field.degree),
            2,
        ];
        of_shape(py, field.coefficients.clone(), &shape)
    }

    /// Photos that it was colored from.
    #[getter]
    fn dataset(&self) -> Dataset {
        Dataset(self.dataset.clone())
    }

    /// Settings of the solver, as a dictionary.
    #[getter]
    fn settings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.colored.distilled.settings)
    }

    /// Factor that makes colors as strong as the teacher's; it is in `splats` and `chroma`.
    #[getter]
    fn saturation(&self) -> f64 {
        self.colored.distilled.saturation
    }

    /// The photo of a view in the scene's colors, at its own lightness: uint8 `[height, width, 3]`,
    /// sRGB. What the scene does not show stays gray.
    fn photo<'py>(&self, py: Python<'py>, view: usize) -> PyResult<Bound<'py, PyArrayDyn<u8>>> {
        Dataset(self.dataset.clone()).check(view)?;
        let camera = &self.dataset.cameras[view];
        let shape = [camera.height as usize, camera.width as usize, 3];
        let rgb = py.detach(|| self.painted(view))?;
        let bytes = rgb.as_flattened().iter();
        let bytes = bytes.map(|value| (255.0 * value.clamp(0.0, 1.0)).round() as u8);
        of_shape(py, bytes.collect(), &shape)
    }

    fn __repr__(&self) -> String {
        let (count, views) = (
            self.colored.splats.len(),
            self.colored.distilled.colored_views,
        );
        format!("Colored({count} Gaussians, from {views} colored views)")
    }
}

impl Colored {
    /// RGB in [0, 1] of a view, `[height, width]`.
    fn painted(&self, view: usize) -> PyResult<Vec<[f32; 3]>> {
        let photo = python(self.dataset.photo(view))?;
        let raster = Arc::new(Raster::with(&gpu()?, self.drawn));
        let (splats, field) = (&self.colored.splats, &self.colored.distilled.chroma);
        let camera = &self.dataset.cameras[view];
        let renderer = SceneRenderer::of(&raster, splats, &[field], self.dataset.extent);
        let chroma = python(renderer.and_then(|mut renderer| renderer.render(camera)))?;
        let luma = RenderedImage {
            width: photo.width,
            height: photo.height,
            channels: 1,
            pixels: photo.gray_values(),
        };
        Ok(native_rgb(&luma, &chroma[0]))
    }
}

/// A gray scene, its photos and what colors are to be.
struct Job {
    dataset: Arc<Photos>,
    luma: splats::Splats,
    drawn: RasterOptions,
    settings: ChromaSettings,
    sh_degree: Degree,
    correct_views: Option<bool>,
}

/// Colors a gray scene, or Gaussians of another program together with their `dataset`.
///
/// A teacher is a callable, asked once for each photo: gray float32 `[H, W]` in 0 to 1, upright,
/// in; CIELAB a and b `[h, w, 2]`, or RGB `[h, w, 3]` as uint8 or floats from 0 to 1, or `None`,
/// out. The answer may be of any size, an array or a tensor on any device. Or it is the path of an
/// .onnx file or of a folder of colored photos, the name of a network (`gs-chroma teacher list`),
/// or `photos`, whose own colors are meant. An exception of the callable comes back as it is.
#[pyfunction]
#[pyo3(signature = (scene, teacher, *, dataset=None, sh_degree=None, correct_views=None, network=None, progress=None, **settings))]
#[allow(
    clippy::too_many_arguments,
    reason = "keywords of Python, each of which may be left out"
)]
pub fn colorize(
    py: Python<'_>,
    scene: &Bound<'_, PyAny>,
    teacher: &Bound<'_, PyAny>,
    dataset: Option<&Dataset>,
    sh_degree: Option<&Bound<'_, PyAny>>,
    correct_views: Option<bool>,
    network: Option<&Bound<'_, PyDict>>,
    progress: Option<Py<PyAny>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<Colored> {
    let (dataset, luma, drawn, seed) = subject(scene, dataset)?;
    let settings = chroma_settings(settings, seed)?;
    let teacher_settings = overlaid(&TeacherSettings::default(), network)?;
    let mut teacher = Teacher::open(teacher, &dataset, &teacher_settings)?;
    let job = Job {
        sh_degree: degree(sh_degree)?,
        dataset,
        luma,
        drawn,
        settings,
        correct_views,
    };
    let colored = py.detach(|| {
        let mut reporter = Reporter::new(progress);
        let colored = job.run(&mut teacher, &mut reporter);
        reporter.end(colored)
    })?;
    teacher
        .doubts()?
        .iter()
        .try_for_each(|doubt| warn(py, doubt))?;
    Ok(Colored {
        colored,
        dataset: job.dataset,
        drawn,
    })
}

/// Photos, gray Gaussians, options of drawing and seed of a scene.
fn subject(
    scene: &Bound<'_, PyAny>,
    dataset: Option<&Dataset>,
) -> PyResult<(Arc<Photos>, splats::Splats, RasterOptions, u64)> {
    if let Ok(trained) = scene.cast::<LumaScene>() {
        let LumaScene {
            scene,
            dataset: own,
        } = trained.get();
        if dataset.is_some_and(|other| !Arc::ptr_eq(&other.0, own)) {
            return Err(PyValueError::new_err(
                "dataset: the scene was trained on another",
            ));
        }
        let drawn = scene.settings.raster_options();
        return Ok((
            own.clone(),
            as_in_files(scene.splats.clone()),
            drawn,
            scene.settings.seed,
        ));
    }
    let splats = scene.cast::<Splats>().map_err(|_| {
        PyTypeError::new_err("scene: a LumaScene, or Splats together with a dataset")
    })?;
    let Some(dataset) = dataset else {
        return Err(PyTypeError::new_err(
            "dataset: Splats need the photos that they show",
        ));
    };
    let splats = splats.get();
    if splats.splats.is_empty() {
        return Err(PyValueError::new_err("scene: there is no Gaussian"));
    }
    let drawn = RasterOptions {
        antialiased: splats.antialiased,
        ..RasterOptions::default()
    };
    let luma = splats.seen_by(&dataset.0.capture).to_luma();
    Ok((dataset.0.clone(), luma, drawn, 0))
}

/// Gaussians as they are read from a file, of unit quaternions and three channels: a trained scene
/// gets the same colors as from its file.
fn as_in_files(mut splats: splats::Splats) -> splats::Splats {
    for quaternion in &mut splats.quats {
        let wide = quaternion.map(f64::from);
        let norm = wide.iter().map(|value| value * value).sum::<f64>().sqrt();
        if norm > 0.0 {
            *quaternion = wide.map(|value| (value / norm) as f32);
        }
    }
    splats.sh = splats.sh.to_rgb();
    splats.to_luma()
}

/// Settings of the solver with those in keywords in their place.
fn chroma_settings(keywords: Option<&Bound<'_, PyDict>>, seed: u64) -> PyResult<ChromaSettings> {
    let solver = keywords.map(|keywords| keywords.get_item("solver"));
    let solver = solver.transpose()?.flatten();
    let defaults = match solver.as_ref().map(of_python).transpose()? {
        Some(SolverKind::Adam) => ChromaSettings::adam(ADAM_ITERATIONS),
        Some(SolverKind::Irls) | None => ChromaSettings::irls(),
    };
    let settings = overlaid(&ChromaSettings { seed, ..defaults }, keywords)?;
    within("rounds", settings.rounds, [1, 1000])?;
    within("iterations", settings.iterations, [0, 1_000_000])?;
    within("scales", settings.scales, [0, 8])?;
    Ok(settings)
}

fn degree(value: Option<&Bound<'_, PyAny>>) -> PyResult<Degree> {
    match value {
        None => Ok(Degree::Fixed(0)),
        Some(word) if word.cast::<PyString>().is_ok_and(|word| word == "auto") => Ok(Degree::Auto),
        Some(number) => {
            let degree: u32 = number.extract()?;
            within("sh_degree", degree, [0, 3])?;
            Ok(Degree::Fixed(degree))
        }
    }
}

impl Job {
    fn run(&self, teacher: &mut Teacher, reporter: &mut Reporter) -> PyResult<chroma::Colored> {
        let raster = Arc::new(Raster::with(&gpu()?, self.drawn));
        python(self.colored(&raster, teacher, reporter))
    }

    fn colored(
        &self,
        raster: &Arc<Raster>,
        teacher: &mut Teacher,
        reporter: &mut Reporter,
    ) -> Result<chroma::Colored, ChromaError> {
        let (dataset, settings) = (&self.dataset, &self.settings);
        let total = dataset.cameras.len();
        let supervision = teach(dataset, teacher, settings.target_scales(), &mut |view| {
            let name = &dataset.capture.views[view].name;
            reporter.tell(Progress::of("teacher", view, total, name))
        })?;
        let distill = Distill {
            dataset,
            supervision: &supervision,
            sh_degree: self.sh_degree,
            correct_views: self.correct_views,
        };
        let scene = (raster, &self.luma);
        let keeps = &mut NoChromaCheckpoints;
        distill.color_gaussians(scene, None, keeps, settings, &mut |event| {
            reporter.tell(match event {
                ColorizeEvent::Asked { view, total } => Progress::of("teacher", view, total, ""),
                ColorizeEvent::Trying { progress, .. } => solving("SH degree", progress),
                ColorizeEvent::Solving(progress) => solving("solving", progress),
                ColorizeEvent::Baking(progress) => solving("baking", progress),
                ColorizeEvent::Matching { view, total } => {
                    Progress::of("matching", view, total, "")
                }
                ColorizeEvent::Drawing { view, total } => Progress::of("drawing", view, total, ""),
                _ => return std::ops::ControlFlow::Continue(()),
            })
        })
    }
}

fn solving(name: &str, progress: ChromaProgress) -> Progress {
    Progress {
        loss: Some(progress.loss),
        ..Progress::of(name, progress.iteration, progress.total, "")
    }
}
