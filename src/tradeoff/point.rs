//! Running a point: its command lines, its folder, what its reports say.

use std::{
    fs,
    path::{self, Path, PathBuf},
    time::Instant,
};

use serde::Serialize;

use super::{
    TradeoffError, TradeoffOptions, child,
    knobs::{self, Given},
    report::{Outcome, Point, PointStage, Seconds, Setting, Subject},
    space::{Task, base_name, find},
};
use crate::{
    capture::{LoadOptions, MaskSource, Normalize},
    chroma::teacher::located,
    disk,
    effects::Overrules,
    input,
    luma::LumaSettings,
    report::{Evaluation, Method},
    run::{Overlay, Preset, RunError, RunFolder, files, teacher_or_photos},
};

/// The option of `fit` for the longer side at which held-out views are measured: only
/// at one size can points of several `max-side` be compared.
const MEASURE_SIDE: &str = "--measure-side";

/// Frames of `eval`'s path, of which nothing is used: as few as it takes.
const FRAMES: &str = "2";

/// The settings of luma of a point, in its folder.
const SETTINGS: &str = "settings.json";

/// Where points run.
pub(super) struct Bench<'a> {
    /// `points/` of the sweep, absolute.
    points: PathBuf,
    /// The COLMAP folder, absolute.
    scene: PathBuf,
    /// The teacher, absolute.
    teacher: Option<PathBuf>,
    preset: Preset,
    /// What the base has of luma's settings instead of its preset's.
    overlay: &'a Overlay,
    /// Options of every `fit` but for what a setting overrules.
    options: Vec<Given>,
    /// Longer side at which the base sees photos.
    side: u32,
}

impl<'a> Bench<'a> {
    /// The bench of a sweep in `folder`.
    ///
    /// # Errors
    /// [`RunError::File`] when a file is missing.
    pub fn new(
        options: &'a TradeoffOptions,
        folder: &Path,
        preset: Preset,
        largest_side: u32,
    ) -> Result<Self, RunError> {
        let absolute = |path: &Path| fs::canonicalize(path).map_err(files::at(path));
        let load = preset.load_options(&options.load, &options.overrules);
        let teacher = options.teacher.as_deref();
        let teacher = teacher.map(|teacher| teacher_or_photos(teacher, &options.colmap_dir));
        let teacher = teacher.as_deref().map(located).transpose()?;
        Ok(Self {
            points: absolute(folder)?.join(super::POINTS),
            scene: absolute(&options.colmap_dir)?,
            teacher: teacher.as_deref().map(absolute).transpose()?,
            preset,
            overlay: &options.settings,
            options: [
                vec![("--preset", Some(preset.name().to_owned()))],
                load_options(&options.load)?,
                overruled(&options.overrules),
            ]
            .concat(),
            side: load
                .max_side
                .map_or(largest_side, |side| side.min(largest_side)),
        })
    }

    /// What is swept.
    pub fn subject(&self) -> Result<Subject, RunError> {
        Ok(Subject {
            scene: text(&self.scene)?,
            preset: self.preset.name().to_owned(),
            teacher: self.teacher.as_deref().map(text).transpose()?,
            luma: self.luma(&[]),
            options: spelled(&self.options),
        })
    }

    /// The settings of luma of a point.
    fn luma(&self, settings: &[Setting]) -> LumaSettings {
        let preset = knobs::preset(settings).unwrap_or(self.preset);
        let mut luma = preset.settings();
        (self.overlay)(&mut luma);
        knobs::turn(&mut luma, settings);
        luma
    }

    /// A point's run folder.
    pub fn folder(&self, name: &str) -> RunFolder {
        RunFolder::at(&self.points.join(name))
    }

    /// What a point ran on.
    pub fn device(&self, task: &Task) -> Option<String> {
        let report = self.folder(&task.name).read_report();
        report.ok().map(|report| report.device.name)
    }

    /// Runs a point in an empty folder and reads what its reports say; `tell` hears now
    /// and then how many seconds it has taken.
    ///
    /// # Errors
    /// [`RunError`] when the folder cannot be made. What the program itself fails at is
    /// the point's reason.
    pub fn run(
        &self,
        task: &Task,
        points: &[Point],
        tell: &mut dyn FnMut(f64),
    ) -> Result<Point, RunError> {
        let begun = Instant::now();
        let folder = self.folder(&task.name);
        // Of a sweep that was stopped in the middle of this point.
        disk::remove(folder.path()).map_err(files::at(folder.path()))?;
        files::make_folder(folder.path())?;
        match task.stage {
            PointStage::Color => self.begin_from_base(&task.name)?,
            PointStage::Luma => {
                let luma = serde_json::to_vec_pretty(&self.luma(&task.settings));
                // Plain structs with string keys: serializing them cannot fail.
                files::write(&folder.path().join(SETTINGS), &luma.unwrap_or_default())?;
            }
        }
        let commands = self.commands(task)?;
        let log = folder.path().join("stderr.txt");
        let ran = (commands.iter()).try_for_each(|arguments| {
            child::run(arguments, &log, &mut || tell(begun.elapsed().as_secs_f64()))
        });
        let outcome = ran.and_then(|()| {
            let outcome = self.outcome(task, points);
            outcome.map_err(|error| error.to_string())
        });
        Ok(Point {
            name: task.name.clone(),
            stage: task.stage,
            phase: task.phase,
            settings: task.settings.clone(),
            commands,
            took: begun.elapsed().as_secs_f64(),
            failed: outcome.as_ref().err().cloned(),
            outcome: outcome.ok(),
        })
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
        let turned = knobs::options(&task.settings);
        let pictures = text(&self.pictures(&task.name))?;
        let render = owned(&["render", &folder, "-o", &pictures]);
        Ok(match (task.stage, &self.teacher) {
            (PointStage::Color, Some(teacher)) => {
                let colorize = owned(&["colorize", &folder, "--teacher", &text(teacher)?]);
                let eval = owned(&["eval", &folder, "--frames", FRAMES]);
                vec![[colorize, spelled(&turned)].concat(), eval, render]
            }
            _ => {
                let overruled = |option: &str| turned.iter().any(|(other, _)| *other == option);
                let mut options = self.options.clone();
                options.retain(|(option, _)| !overruled(option));
                options.extend(turned.clone());
                options.push((MEASURE_SIDE, Some(self.side.to_string())));
                let settings = text(&self.folder(&task.name).path().join(SETTINGS))?;
                let scene = text(&self.scene)?;
                let fit = owned(&["fit", &scene, "-o", &folder, "--settings", &settings]);
                vec![[fit, spelled(&options)].concat(), render]
            }
        })
    }

    /// Where a point's pictures of the held-out views are.
    pub fn pictures(&self, name: &str) -> PathBuf {
        self.folder(name).path().join(super::pictures::FOLDER)
    }

    /// What the reports of a point say.
    fn outcome(&self, task: &Task, points: &[Point]) -> Result<Outcome, TradeoffError> {
        let folder = self.folder(&task.name);
        let report = folder.read_report()?;
        let luma = &report.luma;
        let mut outcome = Outcome {
            iterations: luma.iterations,
            splats: luma.splats,
            seconds: Seconds {
                load: luma.seconds.load,
                train: luma.seconds.train,
                measure: luma.seconds.measure,
                ..Seconds::default()
            },
            psnr: luma.held_out.map(|quality| quality.psnr),
            corrected_psnr: luma.held_out.and_then(|quality| quality.corrected_psnr),
            ssim: luma.held_out.map(|quality| quality.ssim),
            delta_e: None,
            consistency: None,
            colorfulness: None,
            teacher_colorfulness: None,
            peak_host_memory: luma.peak_host_memory,
            peak_device_memory: luma.peak_device_memory,
        };
        if let Some(chroma) = &report.chroma {
            let own = chroma.seconds.teacher;
            outcome.seconds.teacher = asked_elsewhere(task, points).unwrap_or(own);
            outcome.seconds.distill = chroma.seconds.distill;
            outcome.seconds.bake = chroma.seconds.bake + chroma.seconds.measure;
            outcome.delta_e = chroma.pictures.delta_e.map(|error| error.mean);
            outcome.consistency = consistency(&folder)?;
            outcome.colorfulness = Some(chroma.pictures.colorfulness);
            outcome.teacher_colorfulness = chroma.pictures.teacher_colorfulness;
            outcome.peak_host_memory = chroma.peak_host_memory;
            outcome.peak_device_memory = chroma.peak_device_memory;
        }
        outcome.seconds = outcome.seconds.summed();
        match outcome.psnr {
            Some(_) => Ok(outcome),
            None => Err(TradeoffError::NothingToMeasure(self.scene.clone())),
        }
    }
}

/// The seconds of the point whose answers of the teacher this one took. One that asks at
/// another size finds none.
fn asked_elsewhere(task: &Task, points: &[Point]) -> Option<f64> {
    let asks = task.settings.iter().any(|s| s.knob == "teacher-size");
    let base = find(points, base_name(PointStage::Color)).filter(|_| !asks)?;
    Some(base.outcome.as_ref()?.seconds.teacher)
}

/// How far the exported pictures of photographed views are apart.
fn consistency(folder: &RunFolder) -> Result<Option<f64>, RunError> {
    let path = folder.evaluation();
    let text = input::read_to_string(&path).map_err(files::at(&path))?;
    let evaluation: Evaluation = serde_json::from_str(&text).map_err(|error| RunError::File {
        path,
        reason: error.to_string(),
    })?;
    let mut scores = evaluation.between.consistency.iter();
    let exported = scores.find(|score| score.method == Method::Exported);
    Ok(exported.and_then(|score| score.rms))
}

/// The options of `fit` that say how photos are loaded.
fn load_options(load: &LoadOptions) -> Result<Vec<Given>, RunError> {
    let plain = LoadOptions::default();
    let masks = match &load.masks {
        MaskSource::Beside => None,
        MaskSource::Alpha => Some("alpha".to_owned()),
        MaskSource::Off => Some("off".to_owned()),
        MaskSource::Folder(path) => Some(text(&path::absolute(path).map_err(files::at(path))?)?),
    };
    let normalize = match load.normalize {
        Normalize::Auto => None,
        Normalize::Off => Some("off".to_owned()),
        Normalize::Range([low, high]) => Some(format!("{low},{high}")),
    };
    Ok([
        given(load.max_side, "--max-side"),
        given(chosen(load.channel, plain.channel), "--channel"),
        given(chosen(load.encoding, plain.encoding), "--encoding"),
        given(normalize, "--normalize"),
        given(masks, "--masks"),
        given(chosen(load.masked, plain.masked), "--masked"),
        load.force
            .then_some(("--force", None))
            .into_iter()
            .collect(),
    ]
    .concat())
}

/// The options of `fit` that overrule the plan of effects.
fn overruled(overrules: &Overrules) -> Vec<Given> {
    let named =
        |option| move |effect: &crate::effects::Effect| (option, Some(effect.name().to_owned()));
    let with = overrules.with.iter().map(named("--with"));
    let without = overrules.without.iter().map(named("--without"));
    let degree = given(overrules.sh_degree, "--sh-degree");
    with.chain(without).chain(degree).collect()
}

/// An option, if there is a value for it.
fn given(value: Option<impl ToString>, option: &'static str) -> Vec<Given> {
    let value = value.map(|value| (option, Some(value.to_string())));
    value.into_iter().collect()
}

/// The name of a choice, unless it is the default.
fn chosen<T: Serialize + PartialEq>(choice: T, default: T) -> Option<String> {
    let name = serde_json::to_value(&choice).ok()?.as_str()?.to_owned();
    (choice != default).then_some(name)
}

/// Options as words of a command line. A value that begins with a dash is no option only
/// behind `=`.
fn spelled(options: &[Given]) -> Vec<String> {
    let words = options.iter().flat_map(|(option, value)| match value {
        Some(value) if value.starts_with('-') => vec![format!("{option}={value}")],
        Some(value) => vec![(*option).to_owned(), value.clone()],
        None => vec![(*option).to_owned()],
    });
    words.collect()
}

/// A path as an argument that JSON can hold.
fn text(path: &Path) -> Result<String, RunError> {
    let text = path.to_str().map(str::to_owned);
    text.ok_or_else(|| RunError::File {
        path: path.to_owned(),
        reason: "its name is no Unicode: rename it".to_owned(),
    })
}

/// The same file in two places, copied where the file system cannot do that. Every file
/// of a run is replaced, never changed, so neither place notices the other.
fn link(from: &Path, to: &Path) -> Result<(), RunError> {
    disk::link(from, to).map_err(files::at(from))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{capture::Channel, effects::Effect, tradeoff::report::Phase};

    fn bench(overlay: &Overlay) -> Bench<'_> {
        let load = LoadOptions {
            max_side: Some(64),
            channel: Channel::R,
            normalize: Normalize::Range([-1.0, 2.0]),
            ..LoadOptions::default()
        };
        let overrules = Overrules {
            without: vec![Effect::Background],
            ..Overrules::default()
        };
        Bench {
            points: PathBuf::from("/out/points"),
            scene: PathBuf::from("/my scene"),
            teacher: Some(PathBuf::from("/t.onnx")),
            preset: Preset::Draft,
            overlay,
            options: [load_options(&load).expect("paths"), overruled(&overrules)].concat(),
            side: 64,
        }
    }

    fn task(stage: PointStage, knob: &str, value: &str) -> Task {
        Task {
            name: "here".to_owned(),
            stage,
            phase: Phase::One,
            settings: vec![Setting {
                knob: knob.to_owned(),
                value: value.to_owned(),
            }],
            expected: None,
        }
    }

    #[test]
    fn a_setting_takes_the_place_of_the_bases_option() {
        let overlay: Overlay = Box::new(|_| {});
        let commands = bench(&overlay).commands(&task(PointStage::Luma, "max-side", "48"));
        let commands = commands.expect("paths");
        assert_eq!(
            commands[0].join(" "),
            "fit /my scene -o /out/points/here --settings /out/points/here/settings.json --channel r --normalize=-1,2 \
             --without background --max-side 48 --measure-side 64"
        );
        assert_eq!(commands[1][0], "render");
        assert_eq!(commands.len(), 2);
    }

    #[test]
    fn luma_is_the_presets_overlaid_and_turned() {
        let overlay: Overlay = Box::new(|settings| settings.max_splats = 70);
        let bench = bench(&overlay);
        let turned = task(PointStage::Luma, "iterations", "9").settings;
        let luma = bench.luma(&turned);
        assert_eq!((luma.iterations, luma.max_splats), (9, 70));
        let paper = bench.luma(&task(PointStage::Luma, "preset", "paper").settings);
        assert_eq!((paper.sh_degree, paper.max_splats), (3, 70));
    }

    #[test]
    fn a_point_in_color_is_colored_and_measured() {
        let overlay: Overlay = Box::new(|_| {});
        let commands = bench(&overlay).commands(&task(PointStage::Color, "until", "900"));
        let commands = commands.expect("paths");
        assert_eq!(
            commands[0].join(" "),
            "colorize /out/points/here --teacher /t.onnx --solver adam --until 900"
        );
        assert_eq!(commands[1].join(" "), "eval /out/points/here --frames 2");
    }
}
