//! `auto`: from a film or photos to everything, each step skipped whose result is there.
//!
//! A step's result is there when it was made from the same files and options before:
//! `auto.json` in the output folder keeps what each was made from.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    sync::Arc,
};

use crate::{
    capture::{Film, IMAGES},
    chroma::{
        ChromaSettings, Degree,
        teacher::{Teacher, TeacherSettings},
    },
    prepare::{PrepareError, PrepareOptions, digest, digest_of, prepare},
    run::{
        CheckpointOptions, ColorizeOptions, EvalOptions, Event, ExportOptions, FitOptions,
        FramesOptions, Interrupt, Preset, RunError, RunFolder, Stage, TeachOptions, colorize, eval,
        export, files, fit, folder::OF_AUTO, frames, originals,
    },
};

/// What each result was made from.
const KEPT: &str = "auto.json";

/// Frames of the page's path.
const PATH: usize = 60;

/// What `auto` is asked to do.
pub struct AutoOptions {
    /// How the input is prepared; its output is not heeded.
    pub prepare: PrepareOptions,
    /// The folder for everything.
    pub output: PathBuf,
    /// Who colors the photos.
    pub teacher: PathBuf,
    /// How a network is asked.
    pub teacher_settings: TeacherSettings,
    /// A folder of painted hints.
    pub hints: Option<PathBuf>,
    /// How long is trained; by the device by default.
    pub preset: Option<Preset>,
    /// What interrupts training and coloring so that they can go on.
    pub interrupt: Arc<Interrupt>,
}

/// A step of the whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Step {
    /// Frames and poses.
    Prepare,
    /// The gray scene.
    Fit,
    /// Its colors.
    Colorize,
    /// The photos in color.
    Frames,
    /// A file for viewers.
    Export,
    /// Measurements and their page.
    Eval,
}

impl Step {
    /// All, in order.
    pub const ALL: [Self; 6] = [
        Self::Prepare,
        Self::Fit,
        Self::Colorize,
        Self::Frames,
        Self::Export,
        Self::Eval,
    ];

    /// The command that does it.
    pub fn command(self) -> &'static str {
        match self {
            Self::Prepare => "prepare",
            Self::Fit => "fit",
            Self::Colorize => "colorize",
            Self::Frames => "frames",
            Self::Export => "export",
            Self::Eval => "eval",
        }
    }
}

/// What is told while it goes on.
pub enum Told {
    /// A step begins, and goes through these stages.
    Begins(Step, Vec<Stage>),
    /// A step's result is there.
    Skips(Step),
    /// Of the present step.
    Event(Event),
}

/// The film in color.
const FILM: &str = "colored.mp4";

/// The folder of photos in color.
const PICTURES: &str = "colored";

/// The scene for viewers.
const SCENE: &str = "scene.ply";

/// What lies where.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Results {
    /// The photos in color: a film, or a folder.
    pub colored: PathBuf,
    /// The scene for viewers.
    pub scene: PathBuf,
    /// What was measured, to be opened in a browser.
    pub page: PathBuf,
    /// Photos beside gray scene, teacher and colored scene.
    pub contact_sheet: PathBuf,
    /// Photos, masks and poses.
    pub house: PathBuf,
    /// The run folder.
    pub run: PathBuf,
}

/// What stopped it.
#[derive(Debug, thiserror::Error)]
pub enum AutoError {
    /// Frames or poses.
    #[error(transparent)]
    Prepare(#[from] PrepareError),
    /// A later step.
    #[error(transparent)]
    Run(#[from] RunError),
}

/// Whoever is told.
pub type Teller<'a> = dyn FnMut(Told) + 'a;

/// Does every step whose result is not there.
///
/// # Errors
/// [`AutoError`]; what was done before it stays, and the same command goes on from there.
pub fn auto(options: &AutoOptions, tell: &mut Teller<'_>) -> Result<Results, AutoError> {
    // Better now than after hours of work; photos are asked for once they are there.
    if options.teacher.as_os_str() != "photos" {
        let opened = Teacher::open(&options.teacher, None, &options.teacher_settings);
        opened.map_err(RunError::from)?;
    }
    let hints = match &options.hints {
        Some(hints) => digest(hints)?,
        None => String::new(),
    };
    let input = &options.prepare.input;
    // A folder that COLMAP has been through needs nothing.
    let prepared = input.join(IMAGES).is_dir() && input.join("sparse").is_dir();
    files::make_folder(&options.output)?;
    let _originals = originals::Kept::default().with(input, "an original").keep();
    for result in [FILM, SCENE] {
        files::check_no_original(&options.output.join(result))?;
    }
    if input.is_dir() && options.output.join(PICTURES).is_dir() {
        files::make_pictures_folder(&options.output.join(PICTURES))?;
    }
    let mut kept = Kept::read(&options.output)?;
    let house = match prepared {
        true => input.clone(),
        false => options.output.join("house"),
    };
    if prepared {
        tell(Told::Skips(Step::Prepare));
    } else {
        // It knows by itself what is there.
        tell(Told::Begins(Step::Prepare, Vec::new()));
        let asked = PrepareOptions {
            output: house.clone(),
            ..options.prepare.clone()
        };
        prepare(&asked, &mut |event| tell(Told::Event(event)))?;
    }
    let film = Film::read(&house).map_err(RunError::from)?;
    let run = RunFolder::at(&options.output.join(OF_AUTO));
    let results = Results {
        colored: options.output.join(match film {
            Some(_) => FILM,
            None => PICTURES,
        }),
        scene: options.output.join(SCENE),
        page: run.evaluation_page().join(files::PAGE),
        contact_sheet: run.contact_sheet(),
        house: house.clone(),
        run: run.path().to_owned(),
    };

    let preset = options.preset;
    let from = digest_of(&[
        &digest(&house.join("sparse"))?,
        &digest(&house.join(IMAGES))?,
        &masks(&house)?,
        &format!("{preset:?}"),
    ]);
    let goes_on = run.checkpoint().is_file() && kept.begun(Step::Fit, &from);
    if kept.due(Step::Fit, &from, &[&run.luma(), &run.report()]) {
        kept.begin(Step::Fit, &from)?;
        let asked = FitOptions {
            output: Some(run.path().to_owned()),
            preset,
            checkpoints: checkpoints(options, goes_on),
            ..FitOptions::new(house.clone())
        };
        tell(Told::Begins(Step::Fit, asked.stages()));
        fit(&asked, &mut |event| tell(Told::Event(event)))?;
        kept.done(Step::Fit, &from)?;
    } else {
        tell(Told::Skips(Step::Fit));
    }

    let teacher = options.teacher.to_string_lossy().into_owned();
    let from = digest_of(&[
        &digest(&run.luma())?,
        &teacher,
        &teacher_digest(&options.teacher)?,
        &format!("{:?}", options.teacher_settings),
        &hints,
    ]);
    let goes_on = run.color_checkpoint().is_file() && kept.begun(Step::Colorize, &from);
    if kept.due(Step::Colorize, &from, &[&run.color(), &run.chroma()]) {
        kept.begin(Step::Colorize, &from)?;
        let asked = ColorizeOptions {
            run: Some(run.path().to_owned()),
            teach: TeachOptions {
                teachers: vec![(options.teacher.clone(), 1.0)],
                settings: options.teacher_settings.clone(),
                hints: options.hints.clone(),
                ..TeachOptions::default()
            },
            output: None,
            until: None,
            settings: ChromaSettings::irls(),
            sh_degree: Degree::Fixed(0),
            correct_views: None,
            colmap: None,
            relight: false,
            force: false,
            timings: false,
            checkpoints: checkpoints(options, goes_on),
            live: None,
        };
        tell(Told::Begins(Step::Colorize, asked.stages()));
        colorize(&asked, &mut |event| tell(Told::Event(event)))?;
        kept.done(Step::Colorize, &from)?;
    } else {
        tell(Told::Skips(Step::Colorize));
    }

    let from = digest_of(&[&digest(&run.chroma())?, &digest(&run.color())?]);
    if kept.due(Step::Frames, &from, &[&results.colored]) {
        let asked = FramesOptions {
            run: Some(run.path().to_owned()),
            colmap: None,
            teacher: Some(options.teacher.clone()),
            teacher_settings: options.teacher_settings.clone(),
            output: results.colored.clone(),
            hints: options.hints.clone(),
            teacher_alone: false,
            frame_rate: None,
        };
        tell(Told::Begins(Step::Frames, asked.stages()));
        let done = frames(&asked, &mut |event| tell(Told::Event(event)))?;
        if done.carried > 0 {
            tell(Told::Event(Event::Note(format!(
                "{} of {} photos have no pose: they take colors from their neighbors, or from the teacher alone",
                done.carried, done.photos
            ))));
        }
        kept.done(Step::Frames, &from)?;
    } else {
        tell(Told::Skips(Step::Frames));
    }

    if kept.due(Step::Export, &from, &[&results.scene]) {
        let asked = ExportOptions {
            run: Some(run.path().to_owned()),
            output: results.scene.clone(),
            luma: false,
            colmap_coordinates: false,
            clean: false,
            viewer: None,
            colmap: None,
        };
        tell(Told::Begins(Step::Export, asked.stages()));
        export(&asked, &mut |event| tell(Told::Event(event)))?;
        kept.done(Step::Export, &from)?;
    } else {
        tell(Told::Skips(Step::Export));
    }

    if kept.due(Step::Eval, &from, &[&results.page, &run.evaluation()]) {
        let asked = EvalOptions {
            run: Some(run.path().to_owned()),
            teacher: Some(options.teacher.clone()),
            teacher_settings: options.teacher_settings.clone(),
            colmap: None,
            frames: PATH,
            baselines: false,
            recipes: Vec::new(),
            memory_limit: None,
            flow: None,
            lpips: None,
        };
        tell(Told::Begins(Step::Eval, asked.stages()));
        eval(&asked, &mut |event| tell(Told::Event(event)))?;
        kept.done(Step::Eval, &from)?;
    } else {
        tell(Told::Skips(Step::Eval));
    }
    Ok(results)
}

fn checkpoints(options: &AutoOptions, resume: bool) -> CheckpointOptions {
    CheckpointOptions {
        resume,
        interrupt: options.interrupt.clone(),
        ..CheckpointOptions::default()
    }
}

/// Of the masks beside the photos, where there are some.
fn masks(house: &Path) -> Result<String, PrepareError> {
    let masks = house.join("masks");
    match masks.is_dir() {
        true => digest(&masks),
        false => Ok(String::new()),
    }
}

/// Of a teacher's file or folder; a name stands for what the catalog says.
fn teacher_digest(teacher: &Path) -> Result<String, PrepareError> {
    match teacher.exists() {
        true => digest(teacher),
        false => Ok(String::new()),
    }
}

/// What results were made from, by step; of a step that has only begun with `begun` behind.
struct Kept {
    path: PathBuf,
    made: BTreeMap<String, String>,
}

impl Kept {
    fn read(folder: &Path) -> Result<Self, RunError> {
        let path = folder.join(KEPT);
        let text = crate::input::read_to_string(&path);
        // What cannot be read is made anew.
        let made = text.ok().and_then(|text| serde_json::from_str(&text).ok());
        Ok(Self {
            path,
            made: made.unwrap_or_default(),
        })
    }

    /// Whether a step has to be done: nothing of it is there, or it was made from something else.
    fn due(&self, step: Step, from: &str, results: &[&Path]) -> bool {
        let same = self
            .made
            .get(step.command())
            .is_some_and(|made| made == from);
        !(same && results.iter().all(|result| result.exists()))
    }

    /// Whether a step was begun from the same and not ended.
    fn begun(&self, step: Step, from: &str) -> bool {
        let begun = self.made.get(&begun(step));
        begun.is_some_and(|begun| begun == from)
    }

    fn begin(&mut self, step: Step, from: &str) -> Result<(), RunError> {
        self.made.insert(begun(step), from.to_owned());
        self.write()
    }

    fn done(&mut self, step: Step, from: &str) -> Result<(), RunError> {
        self.made.remove(&begun(step));
        self.made.insert(step.command().to_owned(), from.to_owned());
        self.write()
    }

    fn write(&self) -> Result<(), RunError> {
        let text = serde_json::to_string_pretty(&self.made).unwrap_or_default();
        files::write(&self.path, (text + "\n").as_bytes())
    }
}

fn begun(step: Step) -> String {
    format!("{} begun", step.command())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_due_unless_its_result_was_made_from_the_same() {
        let folder = tempfile::tempdir().expect("a folder");
        let result = folder.path().join("luma.ply");
        let mut kept = Kept::read(folder.path()).expect("nothing yet");
        assert!(kept.due(Step::Fit, "a", &[&result]));
        kept.begin(Step::Fit, "a").expect("writable");
        let again = Kept::read(folder.path()).expect("readable");
        assert!(again.begun(Step::Fit, "a") && !again.begun(Step::Fit, "b"));
        assert!(!again.begun(Step::Colorize, "a"));
        kept.done(Step::Fit, "a").expect("writable");
        let kept = Kept::read(folder.path()).expect("readable");
        assert!(!kept.begun(Step::Fit, "a"));
        // The result is missing, there, and there from something else.
        assert!(kept.due(Step::Fit, "a", &[&result]));
        std::fs::write(&result, "").expect("writable");
        assert!(!kept.due(Step::Fit, "a", &[&result]));
        assert!(kept.due(Step::Fit, "b", &[&result]));
        std::fs::write(folder.path().join(KEPT), "damaged").expect("writable");
        let kept = Kept::read(folder.path()).expect("nothing is known");
        assert!(kept.due(Step::Fit, "a", &[&result]));
    }
}
