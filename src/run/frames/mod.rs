//! `frames`: the photos themselves in color.

mod change_report;
mod changes;
mod estimated;
mod out;
mod painted;
mod painter;
mod range;
mod shots;
mod unplaced;
mod without_scene;

pub(crate) use without_scene::{PlainFramesOptions, frames_without_scene};

use std::{cell::RefCell, path::PathBuf};

#[cfg(test)]
pub(crate) use change_report::ChangeReport;
use changes::{Changes, FrameSources};
use estimated::estimate;
use out::FrameOutput;
use painted::Painted;
use painter::Painter;
use range::own_range;
use shots::{Shot, shots_of};
use unplaced::{Bracket, Carried, Known, Steps, Unknown, carry, chain, tell, way, whole};

use super::{
    RunError,
    teach::{TeachOptions, Teachers},
};
use crate::{
    capture::{Dataset, Film, LoadOptions},
    chroma::teacher::TeacherSettings,
    eval::exposures,
    frames::{Canvas, SceneDrawer, Strokes, WeightedColors, believable, blend, finish, steady},
    gpu::Gpu,
    report::Report,
    store::{Codec, RunFolder, film::FRAME_RATE, is_film, originals::OriginalFiles},
    subject::{
        LockMode, Run, SubjectError,
        scene::{Frame, read_scene},
        sound::open_same,
    },
    tell::{Event, Observer, Stage, keeping},
};

/// A share of a photo that the scene leaves open from which on the photo before is asked.
const OPEN: f64 = 0.005;

/// Share of the colors of a film's frame that stays in the next one: about three frames count.
const STEADIED: f32 = 0.7;

/// Pixels of photos without a pose, 2 bytes each, that wait for the next one with a pose; of more
/// photos the files are read again.
const KEPT: usize = 1 << 28;

#[derive(Clone, Debug, Default, serde::Serialize)]
pub struct FramesOptions {
    /// Run folder; the newest run by default.
    pub run: Option<PathBuf>,
    /// COLMAP folder, where it is not the one that `fit` noted.
    pub colmap: Option<PathBuf>,
    /// Teacher for what the scene does not cover; the run's by default.
    pub teacher: Option<PathBuf>,
    pub teacher_settings: TeacherSettings,
    /// A folder for pictures, or a film by its extension.
    pub output: PathBuf,
    /// A folder of painted hints, for what the scene does not cover; the run's by default.
    pub hints: Option<PathBuf>,
    /// True if the scene is left out, for comparison with the teacher's images alone.
    pub teacher_alone: bool,
    /// Codec of the film or the pictures; by default by the output's extension and the source.
    pub codec: Option<Codec>,
    /// Frames a second of a film; by default those of the film that the photos come from, or 24.
    pub frame_rate: Option<[u32; 2]>,
}

/// Result of `frames`.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Frames {
    /// The folder or film.
    pub output: PathBuf,
    /// Codec of the film or the pictures.
    pub codec: Codec,
    /// Photos in color.
    pub photos: usize,
    /// Photos with a pose, those included whose pose is taken between their neighbors'.
    pub placed: usize,
    /// Photos with colors carried from their neighbors.
    pub carried: usize,
    /// Photos with strokes on what the scene does not cover.
    pub painted: usize,
    /// Share of photos with a pose that the scene covers.
    pub covered: f64,
    /// The change report: where each frame's colors come from; `None` where it cannot be written.
    pub changes: Option<PathBuf>,
    /// All that is doubtful, such as photos that cannot be read.
    pub warnings: Vec<String>,
    /// Wall time, in seconds.
    pub seconds: f64,
}

/// Colors the photos of a run and writes them.
pub fn frames(options: &FramesOptions, observe: &mut Observer<'_>) -> Result<Frames, RunError> {
    let begun = std::time::Instant::now();
    let warnings = RefCell::default();
    let observe = &mut keeping(&warnings, observe);
    observe(Event::begins(Stage::Model));
    let run = Run::find(options.run.as_deref(), LockMode::Reading)?;
    let (folder, report) = (&run.folder, &run.report);
    let named = options.teacher.iter().chain(&options.hints);
    let named = OriginalFiles::default().with_all(named, "a file of a teacher or a hint");
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
    let signal = film.as_ref().and_then(|film| film.signal.as_ref());
    let codec = Codec::of(&options.output, options.codec, signal)?;
    let mut shots = shots_of(&dataset, film.as_ref(), rate)?;
    out::name(&mut shots, codec, film.as_ref());
    let in_step = |film: &Film| film.times.is_none() && is_film(&options.output);
    if film.as_ref().is_some_and(in_step) && shots.iter().any(|shot| shot.repeats != 1) {
        observe(Event::Note(
            "at another frame rate some frames are repeated or left out, so that the sound stays in step".to_owned(),
        ));
    }
    let teachers = open_teachers(options, report, folder, &dataset, observe)?;
    let luma = scene.splats.to_luma();
    observe(Event::begins(Stage::Device));
    let raster = report.luma.settings.raster(&Gpu::open()?);
    let believed = believable(luma.len(), report.luma.surroundings);
    let estimated = estimate(film.as_ref().map(|_| &dataset), &shots);
    let between = estimated.iter().flatten().count();
    if between > 0 {
        observe(Event::Note(format!(
            "the camera stands or turns: {between} photos without a pose take one between their neighbors'"
        )));
    }
    let mut painter = Painter {
        drawer: SceneDrawer::new(&raster, &luma, [&chroma, &believed], dataset.extent)?,
        exposures: exposures(&dataset, &report.luma.exposures),
        dataset: &dataset,
        estimated: &estimated,
        teachers,
        range: own_range(&dataset, film.as_ref(), &shots, observe),
        side: None,
    };
    let to = &options.output;
    let out = FrameOutput::open(to, codec, rate, film.as_ref(), &shots, observe)?;
    let painted = find_painted(options, report, &shots, &mut painter, observe)?;
    let mut coloring = Coloring {
        painter,
        out,
        teacher_alone: options.teacher_alone,
        is_film: film.is_some(),
        last: None,
        open: Vec::new(),
        kept: 0,
        unplaced: Vec::new(),
        unread: Vec::new(),
        sources: Vec::new(),
        told: Frames {
            output: options.output.clone(),
            codec,
            ..Frames::default()
        },
    };
    coloring.color_all(&shots, &painted, observe)?;
    coloring.out.finish(observe)?;
    if !options.teacher_alone {
        tell(&coloring.unplaced, &shots, observe);
    }
    for line in coloring.unread {
        observe(Event::Warning(format!("left out: {line}")));
    }
    observe(Event::begins(Stage::Saving));
    let teachers = coloring.painter.teachers.as_ref();
    let changes = Changes {
        output: &options.output,
        hints: options.hints.as_deref(),
        settings: serde_json::to_value(options).unwrap_or_default(),
        report,
        film: film.as_ref(),
        root: &dataset.capture.root,
        codec,
        rate,
        teachers: teachers.map_or(Vec::new(), Teachers::describe),
        shots: &shots,
        frames: coloring.sources,
    };
    let changes = changes.write();
    if let Err(error) = &changes {
        observe(Event::Warning(format!("no change report: {error}")));
    }
    let told = coloring.told;
    Ok(Frames {
        changes: changes.ok(),
        covered: told.covered / told.placed.max(1) as f64,
        seconds: begun.elapsed().as_secs_f64(),
        warnings: warnings.take(),
        ..told
    })
}

/// Photos in color, one after the other; those without a pose wait for the next that has one.
struct Coloring<'a> {
    painter: Painter<'a>,
    out: FrameOutput,
    teacher_alone: bool,
    /// True if the photos are frames of a film, one after the other.
    is_film: bool,
    /// The last photo with a pose.
    last: Option<Known>,
    /// Photos without one since.
    open: Vec<Unknown<'a>>,
    /// Their pixels that are kept.
    kept: usize,
    /// Photos that were colored from others.
    unplaced: Vec<Carried>,
    unread: Vec<String>,
    /// Sources of each photo's colors.
    sources: Vec<FrameSources>,
    told: Frames,
}

impl<'a> Coloring<'a> {
    /// Colors all photos, in order.
    fn color_all(
        &mut self,
        shots: &'a [Shot],
        painted: &'a Painted,
        observe: &mut Observer<'_>,
    ) -> Result<(), RunError> {
        let count = shots.len();
        for (index, shot) in shots.iter().enumerate() {
            let done = self.told.photos + self.open.len();
            observe(Event::progress(Stage::Coloring, done, count, &*shot.name));
            let strokes = painted.on(index);
            self.told.painted += usize::from(strokes.is_some());
            match self.painter.views(shot).is_empty() {
                true => self.wait(index, shot, strokes),
                false => self.color(shot, strokes)?,
            }
        }
        self.end()?;
        observe(Event::progress(Stage::Coloring, count, count, ""));
        Ok(())
    }

    /// Takes a photo without a pose.
    fn wait(&mut self, index: usize, shot: &'a Shot, strokes: Option<&'a Strokes>) {
        match self.painter.original(shot) {
            Ok(original) => {
                let canvas = Canvas::of(&original, self.painter.side(&original));
                self.kept += original.gray.len();
                self.open.push(Unknown {
                    index,
                    shot,
                    canvas,
                    strokes,
                    original: (self.kept <= KEPT).then_some(original),
                });
            }
            Err(error) => self.unread.push(error.to_string()),
        }
    }

    /// Colors a photo with a pose, and those that waited for it.
    fn color(&mut self, shot: &Shot, strokes: Option<&'a Strokes>) -> Result<(), RunError> {
        self.kept = 0;
        let original = self.painter.original(shot)?;
        let canvas = self.painter.canvas(shot, &original);
        let seen = match self.teacher_alone {
            true => WeightedColors::nothing(canvas.len()),
            false => self.painter.seen(shot, &canvas)?,
        };
        let steps = match &self.last {
            Some(last)
                if !self.teacher_alone
                    && (self.is_film || !self.open.is_empty() || 1.0 - seen.share() > OPEN) =>
            {
                way(&last.canvas, &self.open, Some(&canvas))
            }
            // Those before the first photo with a pose take its colors.
            None if !self.teacher_alone => chain(
                self.open
                    .iter()
                    .map(|unknown| &unknown.canvas)
                    .chain([&canvas]),
            ),
            _ => Vec::new(),
        };
        let before = (self.last.as_ref()).and_then(|last| {
            Some(
                last.as_carried(false)
                    .along(&whole(&steps)?, false, &canvas),
            )
        });
        let views = self.painter.views(shot);
        let answer = (self.painter).answer(&shot.name, views.first(), &canvas)?;
        let mut ab = blend(&canvas, &seen, answer.as_deref(), before.as_ref());
        if let (true, Some(before)) = (self.is_film, &before) {
            steady(&mut ab, before, STEADIED);
        }
        let shares = changes::placed(&seen, before.as_ref(), answer.is_some(), strokes);
        let (index, pose) = (shot.index, !shot.views.is_empty());
        self.sources.push(FrameSources {
            index,
            pose,
            shares,
        });
        // What comes after is colored as if nothing were painted, and painted by itself.
        let shown = strokes.map(|strokes| strokes.over(&canvas, &seen, &ab));
        let next = Known { canvas, ab, shown };
        self.carry(&steps, Some(&next))?;
        self.out
            .write(shot, finish(&original, &next.canvas, next.shown().to_vec()))?;
        self.told.covered += seen.share();
        self.told.placed += 1;
        self.told.photos += 1;
        self.last = Some(next);
        Ok(())
    }

    /// Colors the photos that wait for none any more.
    fn end(&mut self) -> Result<(), RunError> {
        let steps = match &self.last {
            Some(known) if !self.teacher_alone => way(&known.canvas, &self.open, None),
            Some(_) => Vec::new(),
            None => return Ok(()),
        };
        self.carry(&steps, None)
    }

    /// Colors those that wait from the photos before and after them.
    fn carry(&mut self, steps: &Steps, after: Option<&Known>) -> Result<(), RunError> {
        let ends = Bracket {
            before: self.last.as_ref(),
            after,
        };
        self.told.carried += self.open.len();
        self.told.photos += self.open.len();
        let unplaced = carry(&mut self.painter, &self.open, steps, &ends, &mut self.out)?;
        self.sources
            .extend(unplaced.iter().map(|carried| carried.sources));
        self.unplaced.extend(unplaced);
        self.open.clear();
        Ok(())
    }
}

/// The teachers of the run, or the one that is named; none where nobody can be asked.
fn open_teachers(
    options: &FramesOptions,
    report: &Report,
    folder: &RunFolder,
    dataset: &Dataset,
    observe: &mut Observer<'_>,
) -> Result<Option<Teachers>, RunError> {
    let mut teach = TeachOptions::of_run(report);
    if let Some(path) = &options.teacher {
        teach.teachers = vec![(path.clone(), 1.0)];
        teach.settings = options.teacher_settings.clone();
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
