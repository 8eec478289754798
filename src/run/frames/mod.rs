//! `frames`: the photos themselves in color.

mod out;
mod painted;
mod painter;
mod range;
mod shots;
mod unplaced;

use std::{cell::RefCell, path::PathBuf, sync::Arc};

use out::Out;
use painted::Painted;
use painter::Painter;
use range::own_range;
use shots::{Shot, shots_of};
use unplaced::{Ends, Known, Unknown, carry, chain, tell, way, whole};

use super::{
    RunError,
    teach::{TeachOptions, Teachers},
};
use crate::{
    capture::{Dataset, Film, LoadOptions},
    chroma::teacher::TeacherSettings,
    eval::exposures,
    frames::{Believed, Canvas, SceneDrawer, believable, blend, finish},
    gpu::Gpu,
    raster::Raster,
    report::Report,
    store::{
        RunFolder,
        film::{FRAME_RATE, is_film},
        originals::Kept,
    },
    subject::{
        Hold, Run, SubjectError,
        scene::{Frame, read_scene},
        sound::open_same,
    },
    tell::{Event, Observer, Stage, keeping},
};

/// A share of a photo that the scene leaves open from which on the photo before is asked.
const OPEN: f64 = 0.005;

/// Pixels of photos without a pose, 2 bytes each, that wait for the next one with a pose; of more
/// photos the files are read again.
const KEPT: usize = 1 << 28;

/// What `frames` is asked to do.
#[derive(Clone, Debug, Default)]
pub struct FramesOptions {
    /// Run folder; the newest run by default.
    pub run: Option<PathBuf>,
    /// COLMAP folder, where it is not the one that `fit` noted.
    pub colmap: Option<PathBuf>,
    /// Who colors what the scene does not cover; the run's teachers by default.
    pub teacher: Option<PathBuf>,
    /// How it is asked.
    pub teacher_settings: TeacherSettings,
    /// A folder for pictures, or a film by its extension.
    pub output: PathBuf,
    /// A folder of painted hints, for what the scene does not cover; the run's by default.
    pub hints: Option<PathBuf>,
    /// Whether the scene is left out: the teacher's own pictures, to compare with.
    pub teacher_alone: bool,
    /// Frames a second of a film; by default those of the film that the photos come from, or 24.
    pub frame_rate: Option<[u32; 2]>,
}

/// What `frames` did.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Frames {
    /// The folder or film.
    pub output: PathBuf,
    /// Photos in color.
    pub photos: usize,
    /// How many of them have a pose.
    pub placed: usize,
    /// How many take their neighbors' colors.
    pub carried: usize,
    /// How many show strokes on what the scene leaves open.
    pub painted: usize,
    /// Share of photos with a pose that the scene covers.
    pub covered: f64,
    /// All that is doubtful, such as photos that cannot be read.
    pub warnings: Vec<String>,
    /// Wall time, in seconds.
    pub seconds: f64,
}

/// Colors the photos of a run and writes them.
///
/// # Errors
/// [`RunError`].
pub fn frames(options: &FramesOptions, observe: &mut Observer<'_>) -> Result<Frames, RunError> {
    let begun = std::time::Instant::now();
    let warnings = RefCell::default();
    let observe = &mut keeping(&warnings, observe);
    observe(Event::begins(Stage::Model));
    let run = Run::find(options.run.as_deref(), Hold::Reading)?;
    let (folder, report) = (&run.folder, &run.report);
    let named = options.teacher.iter().chain(&options.hints);
    let named = Kept::default().with_all(named, "a file of a teacher or a hint");
    let kept = named.with_all(&options.colmap, "a file of the COLMAP folder");
    let _kept = kept.with_run(folder, report).keep();
    let colmap_dir = run.colmap(options.colmap.as_deref());
    let scene = read_scene(&folder.luma(), Frame::Own, observe)?;
    let chroma = folder.read_chroma(scene.splats.len())?;
    let chroma = chroma.ok_or_else(|| SubjectError::NoColors(folder.path().to_owned()))?;
    let load = LoadOptions {
        force: true,
        ..report.capture.load.clone()
    };
    let dataset = open_same(&colmap_dir, &load, &report.capture, observe)?.caching(0);
    let film = Film::read(&colmap_dir)?;
    // At the rate of the film that the photos come from.
    let rate = options
        .frame_rate
        .or(film.as_ref().map(|film| film.frame_rate));
    let rate = rate.unwrap_or(FRAME_RATE);
    let shots = shots_of(&dataset, film.as_ref(), rate)?;
    let in_step = |film: &Film| film.times.is_none() && is_film(&options.output);
    if film.as_ref().is_some_and(in_step) && shots.iter().any(|shot| shot.repeats != 1) {
        observe(Event::Note(
            "at another frame rate some frames are repeated or left out, so that the sound stays in step".to_owned(),
        ));
    }
    let teachers = open_teachers(options, report, folder, &dataset, observe)?;
    let luma = scene.splats.to_luma();
    let drawn = report.luma.settings.raster_options();
    observe(Event::begins(Stage::Device));
    let raster = Arc::new(Raster::with(&Gpu::open()?, drawn));
    let believed = believable(luma.len(), report.luma.surroundings);
    let mut painter = Painter {
        drawer: SceneDrawer::new(&raster, &luma, [&chroma, &believed], dataset.extent)?,
        exposures: exposures(&dataset, &report.luma.exposures),
        dataset: &dataset,
        teachers,
        range: own_range(&dataset, film.as_ref(), &shots, observe),
        side: None,
    };
    let mut out = Out::open(options, rate, film.as_ref(), &shots, observe)?;
    let painted = find_painted(options, report, &shots, &mut painter, observe)?;
    let mut told = Frames {
        output: options.output.clone(),
        photos: 0,
        placed: 0,
        carried: 0,
        painted: 0,
        covered: 0.0,
        warnings: Vec::new(),
        seconds: 0.0,
    };
    let mut progress = |done: usize, name: &str| {
        observe(Event::progress(Stage::Coloring, done, shots.len(), name));
    };

    // The last photo with a pose, and those without one since.
    let mut last: Option<Known> = None;
    let mut open: Vec<Unknown<'_>> = Vec::new();
    let (mut unplaced, mut unread) = (Vec::new(), Vec::new());
    let mut kept = 0;
    for (index, shot) in shots.iter().enumerate() {
        progress(told.photos + open.len(), &shot.name);
        let strokes = painted.on(index);
        told.painted += usize::from(strokes.is_some());
        if shot.views.is_empty() {
            match painter.original(shot) {
                Ok(original) => {
                    let canvas = Canvas::of(&original, painter.side(&original));
                    kept += original.gray.len();
                    open.push(Unknown {
                        index,
                        shot,
                        canvas,
                        strokes,
                        original: (kept <= KEPT).then_some(original),
                    });
                }
                Err(error) => unread.push(error.to_string()),
            }
            continue;
        }
        kept = 0;
        let original = painter.original(shot)?;
        let canvas = painter.canvas(shot, &original);
        let seen = match options.teacher_alone {
            true => Believed::nothing(canvas.len()),
            false => painter.seen(shot, &canvas)?,
        };
        let steps = match &last {
            Some(last)
                if !options.teacher_alone && (!open.is_empty() || 1.0 - seen.share() > OPEN) =>
            {
                way(&last.canvas, &open, Some(&canvas))
            }
            // Those before the first photo with a pose take its colors.
            None if !options.teacher_alone => {
                chain(open.iter().map(|unknown| &unknown.canvas).chain([&canvas]))
            }
            _ => Vec::new(),
        };
        let before = (last.as_ref()).and_then(|last| {
            Some(
                last.as_carried(false)
                    .along(&whole(&steps)?, false, &canvas),
            )
        });
        let answer = painter.answer(&shot.name, painter.views(shot).first(), &canvas)?;
        let ab = blend(&canvas, &seen, answer.as_deref(), before.as_ref());
        // What comes after is colored as if nothing were painted, and painted by itself.
        let shown = strokes.map(|strokes| strokes.over(&canvas, &seen, &ab));
        let next = Known { canvas, ab, shown };
        let ends = Ends {
            before: last.as_ref(),
            after: Some(&next),
        };
        told.carried += open.len();
        told.photos += open.len();
        unplaced.extend(carry(&mut painter, &open, &steps, &ends, &mut out)?);
        open.clear();
        out.write(shot, finish(&original, &next.canvas, next.shown().to_vec()))?;
        told.covered += seen.share();
        told.placed += 1;
        told.photos += 1;
        last = Some(next);
    }
    if let Some(known) = &last {
        let steps = match options.teacher_alone {
            true => Vec::new(),
            false => way(&known.canvas, &open, None),
        };
        let ends = Ends {
            before: last.as_ref(),
            after: None,
        };
        told.carried += open.len();
        told.photos += open.len();
        unplaced.extend(carry(&mut painter, &open, &steps, &ends, &mut out)?);
    }
    progress(shots.len(), "");
    out.finish(observe)?;
    if !options.teacher_alone {
        tell(&unplaced, &shots, observe);
    }
    for line in unread {
        observe(Event::Warning(format!("left out: {line}")));
    }
    told.covered /= told.placed.max(1) as f64;
    told.seconds = begun.elapsed().as_secs_f64();
    told.warnings = warnings.take();
    Ok(told)
}

/// The teachers of the run, or the one that is named; none where nobody can be asked.
fn open_teachers(
    options: &FramesOptions,
    report: &Report,
    folder: &RunFolder,
    dataset: &Dataset,
    observe: &mut Observer<'_>,
) -> Result<Option<Teachers>, RunError> {
    let mut teach = TeachOptions {
        settings: options.teacher_settings.clone(),
        ..TeachOptions::of_run(report)
    };
    if let Some(path) = &options.teacher {
        teach.teachers = vec![(path.clone(), 1.0)];
    }
    if teach.teachers.is_empty() {
        return Ok(None);
    }
    let root = &dataset.capture.root;
    match Teachers::open(&teach, root, Some(&folder.teacher())) {
        Ok(mut teachers) => {
            teachers.know(&dataset.capture);
            Ok(Some(teachers))
        }
        Err(error) if options.teacher.is_none() => {
            observe(Event::Warning(format!(
                "the run's teacher is not available, so what the scene does not cover takes the colors around it: {error}"
            )));
            Ok(None)
        }
        Err(error) => Err(error),
    }
}

/// The strokes of the hints that are named, or of the run's where these are still there.
fn find_painted(
    options: &FramesOptions,
    report: &Report,
    shots: &[Shot],
    painter: &mut Painter<'_>,
    observe: &mut Observer<'_>,
) -> Result<Painted, RunError> {
    let of_run = report.chroma.as_ref();
    let noted = of_run.and_then(|chroma| chroma.hint_folder.as_ref());
    let folder = match (&options.hints, noted) {
        (Some(folder), _) => folder.clone(),
        (None, Some(noted)) => PathBuf::from(noted),
        (None, None) => return Ok(Painted::default()),
    };
    if options.teacher_alone {
        return Ok(Painted::default());
    }
    let grow = options.hints.is_some() || of_run.is_some_and(|chroma| chroma.claimed.is_some());
    match Painted::find(&folder, grow, shots, painter, observe) {
        Err(error) if options.hints.is_none() => {
            observe(Event::Warning(format!(
                "the run's hints cannot be read, so they are not used on what the scene does not cover: {error}"
            )));
            Ok(Painted::default())
        }
        found => found,
    }
}
