//! `frames`: the photos themselves in color.

mod out;
mod painted;
mod shots;

use std::{cell::RefCell, num::NonZero, path::PathBuf, sync::Arc, thread};

use out::Out;
use painted::Painted;
use shots::{Shot, shots_of};

use super::{
    Event, Observer, RunError, RunFolder, Stage,
    film::FRAME_RATE,
    fit::open_gpu,
    keeping,
    lock::RunLock,
    scene::{Frame, open, read_scene},
    teach::{TeachOptions, Teachers},
};
use crate::{
    capture::{CaptureError, Dataset, Exposure, Film, LoadOptions, Original, in_order},
    chroma::teacher::{AbImage, Query, TeacherSettings},
    eval::exposures,
    frames::{
        Believed, Between, Canvas, Carried, Colored, SceneDrawer, Strokes, ViewOf, blend, finish,
    },
    raster::Raster,
    report::Report,
};

/// A share of a photo without a pose that has to be known from its neighbors; else the teacher
/// is asked.
const CARRIED: f64 = 0.9;

/// A share of a photo that the scene leaves open from which on the photo before is asked.
const OPEN: f64 = 0.005;

/// Pixels of photos without a pose, 2 bytes each, that wait for the next one with a pose; of more
/// photos the files are read again.
const KEPT: usize = 1 << 28;

/// What `frames` is asked to do.
#[derive(Clone, Debug)]
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
pub struct Frames {
    /// The folder or film.
    pub output: PathBuf,
    /// Photos in color.
    pub photos: usize,
    /// How many of them have a pose.
    pub placed: usize,
    /// How many take their colors from their neighbors.
    pub carried: usize,
    /// How many show strokes where the scene leaves them open.
    pub painted: usize,
    /// Which share of the photos with a pose the scene covers, their mean.
    pub covered: f64,
    /// All that is doubtful, photos that cannot be read among it.
    pub warnings: Vec<String>,
    /// Seconds of the whole.
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
    let folder = match &options.run {
        Some(path) => RunFolder::at(path),
        None => RunFolder::newest()?,
    };
    observe(Event::begins(Stage::Model));
    let (_lock, report) = RunLock::to_read(&folder)?;
    let noted = PathBuf::from(&report.capture.path);
    let colmap_dir = options.colmap.clone().unwrap_or(noted);
    let scene = read_scene(&folder.luma(), Frame::Own, observe)?;
    let chroma = folder.read_chroma(scene.splats.len())?;
    let chroma = chroma.ok_or_else(|| RunError::NoColors(folder.path().to_owned()))?;
    let load = LoadOptions {
        force: true,
        ..report.capture.load.clone()
    };
    let dataset = open(&colmap_dir, &load, observe)?.caching(0);
    let film = Film::read(&colmap_dir)?;
    // At the rate of the film that the photos come from.
    let rate = options
        .frame_rate
        .or(film.as_ref().map(|film| film.frame_rate));
    let rate = rate.unwrap_or(FRAME_RATE);
    let shots = shots_of(&dataset, film.as_ref(), (&options.output, rate))?;
    let teachers = open_teachers(options, &report, &folder, &dataset, observe)?;
    let luma = scene.splats.to_luma();
    let drawn = report.luma.settings.raster_options();
    observe(Event::begins(Stage::Device));
    let raster = Arc::new(Raster::with(&open_gpu(false)?, drawn));
    let mut painter = Painter {
        drawer: SceneDrawer::new(&raster, &luma, &chroma, dataset.extent)?,
        exposures: exposures(&dataset, &report.luma.exposures),
        dataset: &dataset,
        teachers,
        side: None,
    };
    let mut out = Out::open(options, rate, film.as_ref(), &shots)?;
    let painted = find_painted(options, &report, &shots, &mut painter, observe)?;
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
        observe(Event::Progress {
            stage: Stage::Coloring,
            done,
            total: shots.len(),
            message: name.to_owned(),
        });
    };

    // The last photo with a pose, and those without one since.
    let mut last: Option<Known> = None;
    let mut open: Vec<Unknown<'_>> = Vec::new();
    let mut unread = Vec::new();
    let mut kept = 0;
    for (index, shot) in shots.iter().enumerate() {
        progress(told.photos + open.len(), &shot.name);
        let strokes = painted.on(index);
        told.painted += usize::from(strokes.is_some());
        if shot.views.is_empty() {
            match dataset.loader().unplaced(&shot.path) {
                Ok(original) => {
                    let canvas = Canvas::of(&original, painter.side(&original));
                    kept += original.gray.len();
                    open.push(Unknown {
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
        let original = dataset.loader().original(painter.view(shot))?;
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
        carry(&mut painter, &open, &steps, &ends, &mut out)?;
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
        carry(&mut painter, &open, &steps, &ends, &mut out)?;
    }
    out.finish()?;
    progress(shots.len(), "");
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
    let chroma = report.chroma.as_ref();
    let strength = chroma.map_or(1.0, |chroma| chroma.strength);
    let of_run = || {
        let teachers = chroma.into_iter().flat_map(|chroma| &chroma.teachers);
        teachers.filter_map(|teacher| Some((PathBuf::from(teacher.path.as_ref()?), teacher.weight)))
    };
    let teach = TeachOptions {
        teachers: match &options.teacher {
            Some(path) => vec![(path.clone(), 1.0)],
            None => of_run().collect(),
        },
        settings: options.teacher_settings.clone(),
        strength,
        ..TeachOptions::default()
    };
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
                "what the scene does not cover takes the colors around it, for the run's teacher cannot be asked: {error}"
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
                "what the scene does not cover is not painted, for the run's hints cannot be read: {error}"
            )));
            Ok(Painted::default())
        }
        found => found,
    }
}

/// What a photo's colors are found with.
struct Painter<'a> {
    drawer: SceneDrawer,
    exposures: Vec<Exposure>,
    dataset: &'a Dataset,
    teachers: Option<Teachers>,
    /// Longer side of the canvas met last, over that of its photo's.
    side: Option<f64>,
}

impl<'a> Painter<'a> {
    fn view(&self, shot: &Shot) -> &'a crate::capture::View {
        &self.dataset.capture.views[shot.views.start]
    }

    fn views(&self, shot: &Shot) -> Vec<ViewOf<'a>> {
        let dataset = self.dataset;
        let of = |i: usize| ViewOf {
            view: &dataset.capture.views[i],
            camera: &dataset.cameras[i],
            exposure: self.exposures[i],
        };
        shot.views.clone().map(of).collect()
    }

    /// A photo with a pose at the size at which its views were trained.
    fn canvas(&mut self, shot: &Shot, original: &crate::capture::Original) -> Canvas {
        let size = SceneDrawer::size(&self.views(shot));
        let size = size.unwrap_or([original.width, original.height]);
        let canvas = Canvas::sized(original, size);
        let longer = |width: u32, height: u32| f64::from(width.max(height));
        let scale = longer(canvas.width, canvas.height) / longer(original.width, original.height);
        self.side = Some(scale);
        canvas
    }

    /// The longer side for a photo without a pose: at the scale of the others.
    fn side(&self, original: &crate::capture::Original) -> u32 {
        let scale = self.side.or_else(|| self.usual_scale()).unwrap_or(1.0);
        let longer = f64::from(original.width.max(original.height));
        ((longer * scale).round() as u32).max(1)
    }

    /// That of the first view.
    fn usual_scale(&self) -> Option<f64> {
        let view = self.dataset.capture.views.first()?;
        let seen = ViewOf {
            view,
            camera: &self.dataset.cameras[0],
            exposure: Exposure::NONE,
        };
        let [width, height] = SceneDrawer::size(&[seen])?;
        let size = self.dataset.loader().file_size(view).ok()?;
        Some(f64::from(width.max(height)) / f64::from(size[0].max(size[1])))
    }

    fn seen(&mut self, shot: &Shot, canvas: &Canvas) -> Result<Believed, RunError> {
        let views = self.views(shot);
        Ok(self.drawer.draw(&views, canvas)?)
    }

    /// What the teachers say of a photo.
    fn answer(
        &mut self,
        name: &str,
        view: Option<&ViewOf<'_>>,
        canvas: &Canvas,
    ) -> Result<Option<Vec<[f32; 2]>>, RunError> {
        let Some(teachers) = &mut self.teachers else {
            return Ok(None);
        };
        let name = view.map_or(name, |seen| &seen.view.photo);
        let answer = teachers.color(Query::from(name), canvas.gray_image())?;
        Ok(answer.map(|AbImage { ab, .. }| ab))
    }
}

/// A photo whose colors are known.
struct Known {
    canvas: Canvas,
    ab: Vec<[f32; 2]>,
    /// With strokes over them, where there are some.
    shown: Option<Vec<[f32; 2]>>,
}

impl Known {
    fn shown(&self) -> &[[f32; 2]] {
        self.shown.as_deref().unwrap_or(&self.ab)
    }

    fn as_carried(&self, shown: bool) -> Carried<'_> {
        Carried {
            canvas: &self.canvas,
            ab: if shown { self.shown() } else { &self.ab },
        }
    }
}

/// A photo without a pose.
struct Unknown<'a> {
    shot: &'a Shot,
    canvas: Canvas,
    strokes: Option<&'a Strokes>,
    /// None where there are too many to be kept.
    original: Option<Original>,
}

/// What is known before and after photos without a pose.
struct Ends<'a> {
    before: Option<&'a Known>,
    after: Option<&'a Known>,
}

/// Steps from each photo to the next; `None` where their shapes differ.
type Steps = Vec<Option<Between>>;

fn way(first: &Canvas, open: &[Unknown<'_>], last: Option<&Canvas>) -> Steps {
    let inner = open.iter().map(|unknown| &unknown.canvas);
    chain(std::iter::once(first).chain(inner).chain(last))
}

fn chain<'a>(photos: impl Iterator<Item = &'a Canvas>) -> Steps {
    let photos: Vec<&Canvas> = photos.collect();
    let pairs: Vec<[&Canvas; 2]> = photos.windows(2).map(|pair| [pair[0], pair[1]]).collect();
    let mut steps = Vec::with_capacity(pairs.len());
    let compared: Result<(), std::convert::Infallible> = in_order(
        &pairs,
        |[first, second]| Between::of(first, second),
        |_, step| {
            steps.push(step);
            Ok(())
        },
    );
    match compared {
        Ok(()) => steps,
    }
}

/// All of some steps; none where one is missing, or there is none.
fn whole(steps: &[Option<Between>]) -> Option<Vec<&Between>> {
    let steps: Option<Vec<&Between>> = steps.iter().map(Option::as_ref).collect();
    steps.filter(|steps| !steps.is_empty())
}

/// Colors photos without a pose by those before and after, and writes them. `steps` lead from
/// the one before, if there is one, over all of them to the one after, if there is one.
fn carry(
    painter: &mut Painter<'_>,
    open: &[Unknown<'_>],
    steps: &Steps,
    ends: &Ends<'_>,
    out: &mut Out,
) -> Result<(), RunError> {
    // Of several the slow part is done at once, and as many wait as there are threads.
    let threads = thread::available_parallelism().map_or(1, NonZero::get);
    for (part, some) in open.chunks(threads).enumerate() {
        let mut known = Vec::with_capacity(some.len());
        for (k, unknown) in some.iter().enumerate() {
            let canvas = &unknown.canvas;
            let i = part * threads + k;
            // With nothing before, the first step leads from the first of them to the second.
            let first = usize::from(ends.before.is_some());
            let (before, after) = steps.split_at((i + first).min(steps.len()));
            let of = |known: Option<&Known>, way: &[Option<Between>], backwards: bool| {
                let way = whole(way)?;
                Some(known?.as_carried(true).along(&way, backwards, canvas))
            };
            let nearness = (i + 1) as f32 / (open.len() + 1) as f32;
            let seen = joined(
                canvas.len(),
                [
                    (of(ends.before, before, false), 1.0 - nearness),
                    (of(ends.after, after, true), nearness),
                ],
            );
            let answer = match seen.share() < CARRIED {
                true => painter.answer(&unknown.shot.name, None, canvas)?,
                false => None,
            };
            known.push((unknown, seen, answer));
        }
        let loader = painter.dataset.loader();
        in_order(
            &known,
            |(unknown, seen, answer)| {
                let canvas = &unknown.canvas;
                let ab = blend(canvas, seen, answer.as_deref(), None);
                let ab = match unknown.strokes {
                    Some(strokes) => strokes.over(canvas, &Believed::nothing(canvas.len()), &ab),
                    None => ab,
                };
                match &unknown.original {
                    Some(original) => Ok(finish(original, canvas, ab)),
                    None => {
                        let original = loader.unplaced(&unknown.shot.path)?;
                        Ok(finish(&original, canvas, ab))
                    }
                }
            },
            |(unknown, ..), colored: Result<Colored, CaptureError>| {
                out.write(unknown.shot, colored?)
            },
        )?;
    }
    Ok(())
}

/// What is carried from both sides, each by its share.
fn joined(pixels: usize, sides: [(Option<Believed>, f32); 2]) -> Believed {
    let mut all = Believed::nothing(pixels);
    let mut total = vec![0.0; pixels];
    for (side, share) in sides {
        let Some(side) = side else { continue };
        for (i, total) in total.iter_mut().enumerate() {
            let weight = share * side.weight[i];
            *total += weight;
            for k in 0..2 {
                all.ab[i][k] += weight * side.ab[i][k];
            }
            all.weight[i] = all.weight[i].max(side.weight[i]);
        }
    }
    for (ab, total) in all.ab.iter_mut().zip(total) {
        if total > 0.0 {
            *ab = ab.map(|value| value / total);
        }
    }
    all
}
