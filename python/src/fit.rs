//! Stage 1: photos in, a gray scene out.

use std::sync::Arc;

use gs_chroma::{
    effects::{Effect, Overrules, Survey},
    gpu::Gpu,
    luma::{self, Fit, Goal, LumaEvent, LumaOverlay, LumaSettings, Preset},
    raster::Raster,
};
use pyo3::{exceptions::PyValueError, prelude::*, types::PyDict};

use crate::{
    dataset::Dataset,
    device::gpu,
    error::python,
    progress::{Progress, Reporter},
    settings::{of_python, overlaid, to_python, within},
    splats::Splats,
};

/// A trained gray scene.
#[pyclass(frozen, module = "gs_chroma")]
pub struct LumaScene {
    /// The scene.
    pub scene: luma::LumaScene,
    /// Photos that it was trained on.
    pub dataset: Arc<gs_chroma::capture::Dataset>,
}

#[pymethods]
impl LumaScene {
    /// The Gaussians, one channel.
    #[getter]
    pub(crate) fn splats(&self) -> Splats {
        Splats {
            splats: self.scene.splats.clone(),
            offset: self.dataset.capture.offset,
            antialiased: self.scene.settings.antialiased,
        }
    }

    /// Photos that it was trained on.
    #[getter]
    fn dataset(&self) -> Dataset {
        Dataset(self.dataset.clone())
    }

    /// Settings of the training, as a dictionary.
    #[getter]
    fn settings<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.scene.settings)
    }

    /// Effects of image formation with the evidence for them, a list of dictionaries.
    #[getter]
    fn effects<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.scene.plan.decisions)
    }

    /// Scores of held-out views during training, a list of dictionaries: `iteration`, `seconds`,
    /// `splats`, `psnr` in dB.
    #[getter]
    fn curve<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.scene.curve)
    }

    /// Iterations that led to the Gaussians.
    #[getter]
    fn iterations(&self) -> usize {
        self.scene.iterations
    }

    fn __repr__(&self) -> String {
        let (count, iterations) = (self.scene.splats.len(), self.scene.iterations);
        format!("LumaScene({count} Gaussians, {iterations} iterations)")
    }
}

/// What a training is to do.
struct Job {
    preset: Option<Preset>,
    overlay: LumaOverlay,
    overrules: Overrules,
    start: Option<gs_chroma::splats::Splats>,
}

/// Trains a gray scene, geometry and luminance.
///
/// `preset` is by default `paper` on a GPU, `draft` without one; it does not change the photos'
/// size. `start` are Gaussians to begin with instead of COLMAP's points. `memory_limit` is in
/// bytes of the device. `progress` is called with a `Progress`; an exception that it raises, or
/// Ctrl-C, ends the training.
#[pyfunction]
#[pyo3(signature = (dataset, *, preset=None, sh_degree=None, with_effects=None, without_effects=None, start=None, progress=None, **settings))]
#[allow(
    clippy::too_many_arguments,
    reason = "keywords of Python, each of which may be left out"
)]
pub fn fit(
    py: Python<'_>,
    dataset: &Dataset,
    preset: Option<&Bound<'_, PyAny>>,
    sh_degree: Option<u32>,
    with_effects: Option<&Bound<'_, PyAny>>,
    without_effects: Option<&Bound<'_, PyAny>>,
    start: Option<&Splats>,
    progress: Option<Py<PyAny>>,
    settings: Option<&Bound<'_, PyDict>>,
) -> PyResult<LumaScene> {
    let effects = |words: Option<&Bound<'_, PyAny>>| match words {
        Some(words) => of_python::<Vec<Effect>>(words),
        None => Ok(Vec::new()),
    };
    if let Some(degree) = sh_degree {
        within("sh_degree", degree, [0, 3])?;
    }
    let job = Job {
        preset: preset.map(of_python).transpose()?,
        overlay: overlaid(&LumaOverlay::default(), settings)?,
        overrules: Overrules {
            with: effects(with_effects)?,
            without: effects(without_effects)?,
            sh_degree,
        },
        start: start.map(|start| start.seen_by(&dataset.0.capture).to_luma()),
    };
    if start.is_some_and(|start| start.splats.is_empty()) {
        return Err(PyValueError::new_err("start: there is no Gaussian"));
    }
    let dataset = dataset.0.clone();
    py.detach(|| job.run(dataset, progress))
}

impl Job {
    fn run(
        &self,
        dataset: Arc<gs_chroma::capture::Dataset>,
        progress: Option<Py<PyAny>>,
    ) -> PyResult<LumaScene> {
        let gpu = gpu()?;
        let settings = self.settings(&gpu)?;
        let mut reporter = Reporter::new(progress);
        let scene = python(self.trained(&gpu, &dataset, &settings, &mut reporter));
        let scene = reporter.end(scene)?;
        Ok(LumaScene { scene, dataset })
    }

    /// The preset's settings with those that were given in their place.
    fn settings(&self, gpu: &Gpu) -> PyResult<LumaSettings> {
        let usual = if gpu.is_software() {
            Preset::Draft
        } else {
            Preset::Paper
        };
        let mut settings = self.preset.unwrap_or(usual).settings();
        self.overlay.apply(&mut settings);
        within("iterations", settings.iterations, [1, 1_000_000])?;
        within("max_splats", settings.max_splats, [1, 1 << 30])?;
        within("haste", self.overlay.haste.unwrap_or(1.0), [1e-3, 1e3])?;
        Ok(settings)
    }

    fn trained(
        &self,
        gpu: &Gpu,
        dataset: &Arc<gs_chroma::capture::Dataset>,
        settings: &LumaSettings,
        reporter: &mut Reporter,
    ) -> Result<luma::LumaScene, luma::LumaError> {
        let mut survey = Survey::new(&dataset.capture, &dataset.cameras, &dataset.split);
        let views: Vec<usize> = (0..dataset.cameras.len()).collect();
        dataset.visit(&views, |view, photo| {
            survey.look(view, photo);
            let name = &dataset.capture.views[view].name;
            match reporter
                .tell(Progress::of("photos", view, views.len(), name))
                .is_break()
            {
                true => Err(luma::LumaError::Cancelled),
                false => Ok(()),
            }
        })?;
        let evidence = survey.finish();
        let fit = Fit {
            raster: &Arc::new(Raster::new(gpu)),
            dataset,
            evidence: &evidence,
            overrules: &self.overrules,
            goal: Goal::Fixed,
            tries: true,
            start: self.start.as_ref(),
            surroundings: 0,
            exposures: None,
            grows: None,
            watched: None,
            album: false,
        };
        fit.run(settings, &mut |event| match event {
            LumaEvent::Examined { view, total } => {
                reporter.tell(Progress::of("photos", view, total, ""))
            }
            LumaEvent::Trial(trial) => {
                reporter.tell(Progress::of("trial", trial.done, trial.total, ""))
            }
            LumaEvent::Placing => reporter.tell(Progress::of("placing", 0, 0, "")),
            LumaEvent::Capped(fits) => {
                reporter.warn(&format!("the device has room for {fits} Gaussians only"))
            }
            LumaEvent::Starting { iteration, end } => {
                reporter.tell(Progress::of("training", iteration, end, ""))
            }
            LumaEvent::Training(done) => reporter.tell(Progress {
                loss: Some(done.loss),
                gaussians: Some(done.splats),
                ..Progress::of("training", done.iteration, done.end, "")
            }),
            LumaEvent::Plan(_) => std::ops::ControlFlow::Continue(()),
        })
    }
}
