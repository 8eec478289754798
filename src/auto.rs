//! `auto`: from a film or photos to everything, each step skipped whose result is there.
//!
//! A step's result is there when it was made from the same files and options before:
//! `auto.json` in the output folder keeps what each was made from.

pub(crate) mod outcome;
mod page;
pub(crate) mod reel;
mod steps;

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use serde_json::json;
pub use steps::Step;
use steps::StepRecords;

use crate::{
    capture::{Film, is_capture, originals},
    chroma::{
        ChromaSettings,
        teacher::{Teacher, TeacherSettings},
    },
    gpu::Gpu,
    prepare::{CameraMotion, PrepareError, PrepareOptions, digest, digest_of, prepare},
    run::{
        ColorizeRequest, EvalOptions, ExportOptions, FitRequest, FramesOptions, RunError,
        TeachOptions, colorize, eval, export, fit, frames,
    },
    store::{
        CheckpointOptions, Codec, Interrupt, RunFolder, StoreError, files, folder::OF_AUTO,
        originals,
    },
    subject::Live,
    tell::{Event, Observer, Stage},
};

/// Frames of the page's path.
const PATH: usize = 60;

#[derive(Clone)]
pub struct AutoOptions {
    /// Options of the preparation; its output is ignored.
    pub prepare: PrepareOptions,
    /// The folder for everything.
    pub output: PathBuf,
    /// Teacher of the colors: a file, a folder or a known name.
    pub teacher: PathBuf,
    /// Options of a network.
    pub teacher_settings: TeacherSettings,
    /// A folder of painted hints.
    pub hints: Option<PathBuf>,
    /// Options of the training; its folders and checkpoints are ignored. The coloring has its limit
    /// of memory.
    pub fit: FitRequest,
    /// Codec of the film or the pictures in color.
    pub codec: Option<Codec>,
    /// Frames a second of the film in color; by default those of the film.
    pub frame_rate: Option<[u32; 2]>,
    /// True if nothing is measured.
    pub without_eval: bool,
    /// Interrupt flag of training and coloring, after which they can continue.
    pub interrupt: Arc<Interrupt>,
    /// State for live viewers.
    pub live: Option<Arc<Live>>,
}

/// Event of a run of `auto`.
pub enum AutoEvent {
    /// A shot begins: its number, the count of shots, and its time.
    Shot(usize, usize, String),
    /// A step begins, and goes through these stages.
    Begins(Step, Vec<Stage>),
    /// A step's result exists already.
    Skips(Step),
    /// Event of the present step.
    Event(Event),
}

/// The folder of photos in color; a film has an extension besides.
const COLORED: &str = "colored";

/// The scene for viewers.
const SCENE: &str = "scene.ply";

impl AutoOptions {
    /// Path of the film in color, or of a folder where the codec is one of pictures.
    fn film(&self) -> PathBuf {
        let path = self.output.join(COLORED);
        match self.codec.unwrap_or_default().film_extension() {
            Some(extension) => path.with_extension(extension),
            None => path,
        }
    }
}

/// Paths of the results.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Results {
    /// The photos in color: a film, or a folder.
    pub colored: PathBuf,
    /// The scene for viewers.
    pub scene: PathBuf,
    /// Page of the evaluation, to be opened in a browser; `None` if nothing was measured.
    pub page: Option<PathBuf>,
    /// Photos beside gray scene, teacher and colored scene.
    pub contact_sheet: PathBuf,
    /// Photos, masks and poses.
    pub house: PathBuf,
    /// The run folder.
    pub run: PathBuf,
    /// Motion of the camera; `None` if not known.
    pub camera: Option<CameraMotion>,
}

impl Results {
    /// Name of what is in color.
    pub fn colored_as(&self) -> &'static str {
        match self.colored.extension() {
            Some(_) => "the film in color",
            None => "the photos in color",
        }
    }
}

#[derive(Debug, thiserror::Error)]
pub enum AutoError {
    /// Frames or poses.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// A later step.
    #[error(transparent)]
    Run(#[from] RunError),
    /// The folder of results.
    #[error(transparent)]
    Store(#[from] StoreError),
}

/// Whoever is told.
pub type Teller<'a> = dyn FnMut(AutoEvent) + 'a;

/// Does every step whose result is not there.
///
/// # Errors
/// [`AutoError`]; what was done before it stays, and the same command goes on from there.
pub fn auto(options: &AutoOptions, tell: &mut Teller<'_>) -> Result<Results, AutoError> {
    let hints = match &options.hints {
        Some(hints) => digest(hints)?,
        None => String::new(),
    };
    let input = &options.prepare.input;
    let _originals = originals::OriginalFiles::default()
        .with(input, "an original")
        .keep();
    check(options)?;
    let (house, camera) = prepared(options, tell)?;
    let run = RunFolder::at(&options.output.join(OF_AUTO));
    let results = Results {
        camera,
        ..results(options, &house, &run)?
    };
    let mut steps = Steps {
        kept: StepRecords::read(&options.output)?,
        tell,
    };
    make_scene(options, (&house, &run), &hints, &mut steps)?;
    make_results(options, &run, results, &mut steps)
}

/// Trains the gray scene and colors it.
fn make_scene(
    options: &AutoOptions,
    (house, run): (&Path, &RunFolder),
    hints: &str,
    steps: &mut Steps<'_, '_>,
) -> Result<(), AutoError> {
    let mut capture = originals(house);
    capture.retain(|path| path.exists());
    let capture: Result<Vec<_>, _> = capture.iter().map(|path| digest(path)).collect();
    let from = digest_of(&[
        &capture?.concat(),
        &masks(house)?,
        &json!(options.fit).to_string(),
    ]);
    let mut asked = FitRequest {
        colmap_dir: house.to_owned(),
        output: Some(run.path().to_owned()),
        checkpoints: checkpoints(options),
        live: options.live.clone(),
        ..options.fit.clone()
    };
    let results_of = [&*run.luma(), &run.report()];
    let stages = asked.stages();
    steps.step(Step::Fit, &from, &results_of, stages, |begun, observe| {
        asked.checkpoints.resume = begun && run.checkpoint().is_file();
        fit(&asked, observe).map(drop)
    })?;

    let settings = ChromaSettings {
        memory_limit: options.fit.settings.memory_limit,
        ..ChromaSettings::irls()
    };
    let from = digest_of(&[
        &digest(&run.luma())?,
        &*options.teacher.to_string_lossy(),
        &teacher_digest(&options.teacher)?,
        &json!(options.teacher_settings).to_string(),
        hints,
        &json!(settings).to_string(),
    ]);
    let mut asked = ColorizeRequest {
        run: Some(run.path().to_owned()),
        teach: TeachOptions {
            teachers: vec![(options.teacher.clone(), 1.0)],
            settings: options.teacher_settings.clone(),
            hints: options.hints.clone(),
            ..TeachOptions::default()
        },
        settings,
        checkpoints: checkpoints(options),
        live: options.live.clone(),
        ..ColorizeRequest::default()
    };
    let results_of = [&*run.color(), &run.chroma()];
    let stages = asked.stages();
    steps.step(
        Step::Colorize,
        &from,
        &results_of,
        stages,
        |begun, observe| {
            asked.checkpoints.resume = begun && run.color_checkpoint().is_file();
            colorize(&asked, observe).map(drop)
        },
    )?;
    Ok(())
}

/// Writes the photos in color and the file for viewers, and measures.
fn make_results(
    options: &AutoOptions,
    run: &RunFolder,
    results: Results,
    steps: &mut Steps<'_, '_>,
) -> Result<Results, AutoError> {
    let from = digest_of(&[
        &digest(&run.chroma())?,
        &digest(&run.color())?,
        &json!([options.frame_rate, options.codec]).to_string(),
    ]);
    let asked = FramesOptions {
        run: Some(run.path().to_owned()),
        teacher: Some(options.teacher.clone()),
        teacher_settings: options.teacher_settings.clone(),
        output: results.colored.clone(),
        codec: options.codec,
        frame_rate: options.frame_rate,
        hints: options.hints.clone(),
        ..FramesOptions::default()
    };
    let stages = asked.stages();
    steps.step(Step::Frames, &from, &[&results.colored], stages, |_, observe| {
        let done = frames(&asked, observe)?;
        if done.carried > 0 {
            observe(Event::Note(format!(
                "{} of {} photos have no pose: they take colors from their neighbors, or from the teacher alone",
                done.carried, done.photos
            )));
        }
        let (what, path) = (results.colored_as(), results.colored.display());
        observe(Event::Note(format!("ready: {path}, {what}")));
        Ok(())
    })?;

    let asked = ExportOptions {
        run: Some(run.path().to_owned()),
        output: results.scene.clone(),
        ..ExportOptions::default()
    };
    let stages = asked.stages();
    steps.step(
        Step::Export,
        &from,
        &[&results.scene],
        stages,
        |_, observe| export(&asked, observe).map(drop),
    )?;

    if options.without_eval {
        return Ok(Results {
            page: None,
            ..results
        });
    }
    let page = run.evaluation_page().join(files::PAGE);
    let asked = EvalOptions {
        run: Some(run.path().to_owned()),
        teacher: Some(options.teacher.clone()),
        teacher_settings: options.teacher_settings.clone(),
        frames: PATH,
        ..EvalOptions::default()
    };
    let results_of = [&*page, &run.evaluation()];
    let stages = asked.stages();
    steps.step(Step::Eval, &from, &results_of, stages, |_, observe| {
        eval(&asked, observe).map(drop)
    })?;
    Ok(results)
}

/// Opens device, teacher and the places of results: better now than after hours of work.
fn check(options: &AutoOptions) -> Result<(), AutoError> {
    Gpu::open().map_err(RunError::from)?;
    // Photos are asked for once they are there.
    if options.teacher.as_os_str() != "photos" {
        let opened = Teacher::open(&options.teacher, None, &options.teacher_settings);
        opened.map_err(RunError::from)?;
    }
    files::make_folder(&options.output)?;
    for result in [options.film(), options.output.join(SCENE)] {
        files::check_no_original(&result)?;
    }
    let pictures = options.output.join(COLORED);
    if options.prepare.input.is_dir() && pictures.is_dir() {
        files::make_pictures_folder(&pictures)?;
    }
    Ok(())
}

/// Paths of the results of photos and poses in `house`.
fn results(options: &AutoOptions, house: &Path, run: &RunFolder) -> Result<Results, AutoError> {
    let film = Film::read(house).map_err(RunError::from)?;
    let colored = match &film {
        Some(_) => options.film(),
        None => options.output.join(COLORED),
    };
    // A codec that photos cannot have is refused before the training.
    Codec::of(&colored, options.codec, None)?;
    Ok(Results {
        colored,
        scene: options.output.join(SCENE),
        page: Some(run.evaluation_page().join(files::PAGE)),
        contact_sheet: run.contact_sheet(),
        house: house.to_owned(),
        run: run.path().to_owned(),
        camera: None,
    })
}

/// The folder of photos and poses. One that COLMAP has been through needs nothing.
fn prepared(
    options: &AutoOptions,
    tell: &mut Teller<'_>,
) -> Result<(PathBuf, Option<CameraMotion>), AutoError> {
    let input = &options.prepare.input;
    if is_capture(input) {
        tell(AutoEvent::Skips(Step::Prepare));
        return Ok((input.clone(), None));
    }
    // It knows by itself what is there.
    tell(AutoEvent::Begins(Step::Prepare, Vec::new()));
    let asked = PrepareOptions {
        output: options.output.join("house"),
        ..options.prepare.clone()
    };
    let made = prepare(&asked, &mut |event| tell(AutoEvent::Event(event)))?;
    Ok((asked.output, made.motion.map(|motion| motion.camera)))
}

/// Steps, of which those are skipped whose results are there.
struct Steps<'a, 'o> {
    kept: StepRecords,
    tell: &'a mut Teller<'o>,
}

impl Steps<'_, '_> {
    /// Does a step that makes `results`; `work` hears whether it was begun from the same before.
    fn step(
        &mut self,
        step: Step,
        from: &str,
        results: &[&Path],
        stages: Vec<Stage>,
        work: impl FnOnce(bool, &mut Observer<'_>) -> Result<(), RunError>,
    ) -> Result<(), AutoError> {
        if !self.kept.due(step, from, results) {
            (self.tell)(AutoEvent::Skips(step));
            return Ok(());
        }
        let begun = self.kept.begun(step, from);
        self.kept.begin(step, from)?;
        (self.tell)(AutoEvent::Begins(step, stages));
        work(begun, &mut |event| (self.tell)(AutoEvent::Event(event)))?;
        Ok(self.kept.done(step, from)?)
    }
}

fn checkpoints(options: &AutoOptions) -> CheckpointOptions {
    CheckpointOptions {
        interrupt: options.interrupt.clone(),
        ..CheckpointOptions::default()
    }
}

/// Digest of the masks beside the photos; empty without any.
fn masks(house: &Path) -> Result<String, PrepareError> {
    let masks = house.join("masks");
    match masks.is_dir() {
        true => digest(&masks),
        false => Ok(String::new()),
    }
}

/// Digest of a teacher's file or folder; empty for a known name.
fn teacher_digest(teacher: &Path) -> Result<String, PrepareError> {
    match teacher.exists() {
        true => digest(teacher),
        false => Ok(String::new()),
    }
}
