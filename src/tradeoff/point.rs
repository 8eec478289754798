//! Running a point: its command lines, its folder, what its reports say.

use std::{
    fs,
    path::{Path, PathBuf},
    time::Instant,
};

use super::{
    child, curve,
    knobs::{self, Base},
    request::{POINTS, TradeoffOptions},
    search::{Task, base_name},
    sweep::{Outcome, PointStage, Subject, SweepPoint, Tradeoff},
};
use crate::{
    chroma::teacher::located,
    disk, input,
    report::{Evaluation, Method},
    run::{RunError, teacher_or_photos},
    store::{RunFolder, StoreError, files},
};

/// The option of `fit` for the longer side at which held-out views are measured: only
/// at one size can points of several `max-side` be compared.
const MEASURE_SIDE: &str = "--measure-side";

/// The option of `fit` that keeps pictures of its way.
const ALBUM: &str = "--album";

/// Frames of `eval`'s path, of which nothing is used: as few as it takes.
const FRAMES: &str = "2";

/// Folder and subject of the points.
pub(super) struct Bench {
    /// `points/` of the sweep, absolute.
    points: PathBuf,
    /// Their scene, teacher and options.
    pub subject: Subject,
    /// Longer side of the largest photo, in pixels.
    largest_side: u32,
}

impl Bench {
    /// The bench of a sweep in `folder`.
    ///
    /// # Errors
    /// [`StoreError::File`] when a file is missing.
    pub fn new(
        options: &TradeoffOptions,
        folder: &Path,
        largest_side: u32,
    ) -> Result<Self, RunError> {
        let absolute = |path: &Path| fs::canonicalize(path).map_err(files::at(path));
        let teacher = options.teacher.as_deref();
        let teacher = teacher.map(|teacher| teacher_or_photos(teacher, &options.colmap_dir));
        let teacher = teacher.as_deref().map(located).transpose()?;
        let teacher = teacher.map(|teacher| text(&absolute(&teacher)?));
        Ok(Self {
            points: absolute(folder)?.join(POINTS),
            subject: Subject {
                scene: text(&absolute(&options.colmap_dir)?)?,
                teacher: teacher.transpose()?,
                options: options.fit.clone(),
            },
            largest_side,
        })
    }

    /// A point's run folder.
    pub fn folder(&self, name: &str) -> RunFolder {
        RunFolder::at(&self.points.join(name))
    }

    /// The base of a stage that has run.
    pub fn base(&self, stage: PointStage) -> Result<Base, RunError> {
        Ok(Base {
            report: self.folder(base_name(stage)).read_report()?,
            largest_side: self.largest_side,
        })
    }

    /// Runs a point in an empty folder and reads what its reports say, along its way too; `tell`
    /// hears now and then how many seconds it has taken.
    ///
    /// # Errors
    /// [`RunError`] when the folder cannot be made. What the program itself fails at is
    /// the point's reason.
    pub fn run(
        &self,
        task: &Task,
        sweep: &Tradeoff,
        tell: &mut dyn FnMut(f64),
    ) -> Result<Vec<SweepPoint>, RunError> {
        let begun = Instant::now();
        let folder = self.folder(&task.name);
        // Of a sweep that was stopped in the middle of this point.
        disk::remove(folder.path()).map_err(files::at(folder.path()))?;
        files::make_folder(folder.path())?;
        if task.stage == PointStage::Color {
            self.begin_from_base(&task.name)?;
        }
        let commands = self.commands(task)?;
        let log = folder.path().join("stderr.txt");
        let ran = (commands.iter()).try_for_each(|arguments| {
            child::run(arguments, &log, &mut || tell(begun.elapsed().as_secs_f64()))
        });
        let outcome = ran.and_then(|()| {
            let outcome = self.outcome(task, sweep);
            outcome.map_err(|error| error.to_string())
        });
        let point = SweepPoint {
            name: task.name.clone(),
            stage: task.stage,
            settings: task.settings.clone(),
            after: None,
            picture: curve::picture_of(&folder, &folder.contact_sheet())
                .filter(|_| outcome.is_ok()),
            commands,
            took: begun.elapsed().as_secs_f64(),
            failed: outcome.as_ref().err().cloned(),
            outcome: outcome.ok(),
        };
        let of_base = |knob: &str| point.settings.iter().all(|setting| setting.knob == knob);
        let along = match point.stage {
            _ if point.failed.is_some() => Vec::new(),
            PointStage::Luma if of_base("iterations") => curve::of_luma(&point, &folder)?,
            PointStage::Color if point.is_base() => curve::of_color(&point, &folder)?,
            // Others would crowd out what matters.
            _ => Vec::new(),
        };
        Ok([vec![point], along].concat())
    }

    /// A point in color has the base's luma and, but for the first that asked, the
    /// answers that the teacher has given.
    fn begin_from_base(&self, name: &str) -> Result<(), RunError> {
        let (base, here) = (self.folder(base_name(PointStage::Luma)), self.folder(name));
        link(&base.luma(), &here.luma())?;
        link(&base.report(), &here.report())?;
        let asked = self.folder(base_name(PointStage::Color)).teacher();
        if here.teacher() != asked && asked.is_dir() {
            files::make_folder(&here.teacher())?;
            for entry in fs::read_dir(&asked).map_err(files::at(&asked))? {
                let answer = entry.map_err(files::at(&asked))?.path();
                let name = answer.file_name().unwrap_or_default();
                link(&answer, &here.teacher().join(name))?;
            }
        }
        Ok(())
    }

    /// The program's arguments, one list for each call.
    fn commands(&self, task: &Task) -> Result<Vec<Vec<String>>, RunError> {
        let folder = text(self.folder(&task.name).path())?;
        let owned = |words: &[&str]| words.iter().map(|&w| w.to_owned()).collect::<Vec<_>>();
        let turned: Vec<[&str; 2]> = knobs::options(&task.settings).collect();
        let turned_words = owned(turned.as_flattened());
        Ok(match (task.stage, &self.subject.teacher) {
            (PointStage::Color, Some(teacher)) => {
                let colorize = owned(&["colorize", &folder, "--teacher", teacher]);
                let eval = owned(&["eval", &folder, "--frames", FRAMES]);
                vec![[colorize, turned_words].concat(), eval]
            }
            _ => {
                let fit = owned(&["fit", &self.subject.scene, "-o", &folder, ALBUM]);
                let mut options = self.subject.options.clone();
                for [option, _] in turned {
                    options = without(options, option);
                }
                options.extend(turned_words);
                let sized = options
                    .iter()
                    .any(|option| option.starts_with(MEASURE_SIDE));
                if !task.settings.is_empty() && !sized {
                    let side = self.base(PointStage::Luma)?.side();
                    options.extend([MEASURE_SIDE.to_owned(), side.to_string()]);
                }
                vec![[fit, options].concat()]
            }
        })
    }

    /// Outcome of a point, from its reports.
    fn outcome(&self, task: &Task, sweep: &Tradeoff) -> Result<Outcome, RunError> {
        let folder = self.folder(&task.name);
        let report = folder.read_report()?;
        let luma = &report.luma;
        let mut outcome = Outcome {
            iterations: luma.iterations,
            splats: luma.splats,
            seconds: luma.seconds.load + luma.seconds.train + luma.seconds.measure,
            psnr: luma.held_out.map(|quality| quality.psnr),
            ssim: luma.held_out.map(|quality| quality.ssim),
            peak_host_memory: luma.peak_host_memory,
            peak_device_memory: luma.peak_device_memory,
            ..Outcome::default()
        };
        if let Some(chroma) = &report.chroma {
            // One that asks at another size finds no answers.
            let asks = task.settings.iter().any(|s| s.knob == "teacher-size");
            let base = sweep.base(PointStage::Color).filter(|_| !asks);
            let asked = base.and_then(|base| base.outcome.as_ref());
            let seconds = &chroma.seconds;
            outcome.teacher_seconds = asked.map_or(seconds.teacher, |base| base.teacher_seconds);
            outcome.seconds =
                outcome.teacher_seconds + seconds.distill + seconds.bake + seconds.measure;
            // Other targets, or more freedom to meet them, are no smaller error.
            let same = task.settings.iter().all(|setting| setting.knob == "rounds");
            outcome.loss = same.then_some(chroma.loss);
            outcome.delta_e = chroma.pictures.delta_e.map(|error| error.mean);
            outcome.consistency = consistency(&folder)?;
            outcome.colorfulness = Some(chroma.pictures.colorfulness);
            outcome.peak_host_memory = chroma.peak_host_memory;
            outcome.peak_device_memory = chroma.peak_device_memory;
        }
        Ok(outcome)
    }
}

/// Difference between the exported pictures of photographed views, RMS in CIELAB units.
fn consistency(folder: &RunFolder) -> Result<Option<f64>, RunError> {
    let path = folder.evaluation();
    let text = input::read_to_string(&path).map_err(files::at(&path))?;
    let evaluation: Evaluation =
        serde_json::from_str(&text).map_err(|error| StoreError::file(&path, error.to_string()))?;
    let mut scores = evaluation.between.consistency.iter();
    let exported = scores.find(|score| score.method == Method::Exported);
    Ok(exported.and_then(|score| score.rms))
}

/// Words of a command line without an option, which has one value.
fn without(words: Vec<String>, option: &str) -> Vec<String> {
    let joined = format!("{option}=");
    let (mut kept, mut words) = (Vec::new(), words.into_iter());
    while let Some(word) = words.next() {
        if word == option {
            words.next();
        } else if !word.starts_with(&joined) {
            kept.push(word);
        }
    }
    kept
}

/// A path as an argument that JSON can hold.
fn text(path: &Path) -> Result<String, StoreError> {
    let text = path.to_str().map(str::to_owned);
    text.ok_or_else(|| StoreError::file(path, "its name is no Unicode: rename it"))
}

/// The same file in two places, copied where the file system cannot do that. Every file
/// of a run is replaced, never changed, so neither place notices the other.
fn link(from: &Path, to: &Path) -> Result<(), StoreError> {
    disk::link(from, to).map_err(files::at(from))
}

#[cfg(test)]
mod tests {
    use super::super::{fixtures::sweep, sweep::Setting};
    use super::*;

    fn commands(stage: PointStage, knob: &str, value: &str) -> Vec<String> {
        let options = "--preset draft --max-side=64 --measure-side 50 --max-splats 70";
        let bench = Bench {
            points: PathBuf::from("/out/points"),
            subject: Subject {
                scene: "/my scene".to_owned(),
                teacher: Some("/t.onnx".to_owned()),
                options: options.split(' ').map(str::to_owned).collect(),
            },
            largest_side: 64,
        };
        let task = Task {
            name: "here".to_owned(),
            stage,
            settings: vec![Setting {
                knob: knob.to_owned(),
                value: value.to_owned(),
            }],
            expected: None,
            information: 0.0,
        };
        assert!(bench.outcome(&task, &sweep(Vec::new())).is_err(), "no run");
        let commands = bench.commands(&task).expect("names");
        commands.iter().map(|words| words.join(" ")).collect()
    }

    #[test]
    fn a_setting_takes_the_place_of_the_bases_option() {
        assert_eq!(
            commands(PointStage::Luma, "max-side", "48"),
            [
                "fit /my scene -o /out/points/here --album --preset draft --measure-side 50 --max-splats 70 --max-side 48"
            ]
        );
        assert_eq!(
            commands(PointStage::Luma, "max-splats", "35"),
            [
                "fit /my scene -o /out/points/here --album --preset draft --max-side=64 --measure-side 50 --max-splats 35"
            ]
        );
    }

    #[test]
    fn a_point_in_color_is_colored_and_measured() {
        assert_eq!(
            commands(PointStage::Color, "chroma-degree", "1"),
            [
                "colorize /out/points/here --teacher /t.onnx --sh-degree 1",
                "eval /out/points/here --frames 2"
            ]
        );
    }
}
