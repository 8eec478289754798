//! `tradeoff`: what quality costs in time, on the user's scene and device.

mod around;
mod child;
mod knobs;
mod pictures;
mod point;
mod report;
mod search;
#[cfg(test)]
mod search_tests;
mod space;
mod state;

use std::path::{Path, PathBuf};

pub use child::end_with_parent;
pub use knobs::knob_names;
pub use report::{PointStage, Tradeoff, front_table, shell_line};

use crate::{
    capture::{Capture, LoadOptions, split},
    effects::Overrules,
    gpu::Gpu,
    run::{Event, Observer, Overlay, Preset, RunError, RunFolder, Stage, Work, files},
};
use around::Around;
use pictures::Album;
use point::Bench;
use report::{Measure, Phase, Point, csv, page};
use space::{Space, Task, base_name, find};
use state::State;

/// What `tradeoff` is asked to do; `None` leaves it to the preset.
pub struct TradeoffOptions {
    /// The COLMAP folder.
    pub colmap_dir: PathBuf,
    /// Folder for the points and the results; `runs/<folder name>-tradeoff` by default.
    pub output: Option<PathBuf>,
    /// The base; `paper` on a GPU and `draft` on a software adapter by default.
    pub preset: Option<Preset>,
    /// What is asked of the base instead of its preset's settings.
    pub settings: Overlay,
    /// How photos are loaded; some have to be held out.
    pub load: LoadOptions,
    /// Effects that are on or off in every point.
    pub overrules: Overrules,
    /// The teacher, for points in color.
    pub teacher: Option<PathBuf>,
    /// Wall seconds that all points may take together.
    pub budget: f64,
    /// Names of the knobs to turn; empty for all.
    pub knobs: Vec<String>,
}

/// What can stop a sweep.
#[derive(Debug, thiserror::Error)]
pub enum TradeoffError {
    /// The photos, the device or the file system.
    #[error(transparent)]
    Run(#[from] RunError),
    /// Nothing is held out, and quality cannot be weighed against time.
    #[error("{}: no view is held out to measure on: leave --no-holdout out, or name a folder with more photos", .0.display())]
    NothingToMeasure(PathBuf),
    /// What everything is compared with does not run.
    #[error("{point}, which all other points are compared with, failed: {reason}")]
    Base {
        /// Name of the point, also of its folder.
        point: String,
        /// What the program said.
        reason: String,
    },
}

/// What `tradeoff` writes, beside the points' folders.
pub const FILES: [&str; 3] = ["tradeoff.csv", "tradeoff.json", "tradeoff.html"];

/// The folder of the points' folders.
const POINTS: &str = "points";

/// Runs the points that are missing in the folder and gives the folder and all of
/// them. The files are written anew after every point.
///
/// # Errors
/// [`TradeoffError`]: the folder holds another sweep, or a base fails. What the points
/// that ran have shown is kept. A point that fails otherwise is part of the result.
pub fn tradeoff(
    options: &TradeoffOptions,
    observe: &mut Observer<'_>,
) -> Result<(PathBuf, Tradeoff), TradeoffError> {
    let preset = match options.preset {
        Some(preset) => preset,
        None => Preset::for_device(&Gpu::open().map_err(RunError::from)?),
    };
    let folder = options
        .output
        .clone()
        .unwrap_or_else(|| default_folder(&options.colmap_dir));
    let capture = Capture::load(&options.colmap_dir).map_err(RunError::from)?;
    if split(&capture.views, options.load.holdout).test.is_empty() {
        return Err(TradeoffError::NothingToMeasure(options.colmap_dir.clone()));
    }
    let sides = capture.views.iter().flat_map(|view| view.photo_size());
    let largest_side = sides.max().unwrap_or(0);
    files::make_own_folder(&folder, &["tradeoff.lock", FILES[1]], &[])?;
    let bench = Bench::new(options, &folder, preset, largest_side)?;
    let mut state = State::open(&folder, bench.subject()?, options.budget)?;
    let mut album = Album::new(&folder, capture);

    while let Some(task) = next(options, &bench, &state.sweep, preset, largest_side)? {
        let point = run(&bench, &task, &state.sweep, observe)?;
        observe(Event::Note(in_words(&point)));
        let failed = point.failed.clone();
        state.add(point, bench.device(&task));
        write(&folder, &state, &mut album)?;
        if let (None, Some(reason)) = (task.expected, failed) {
            return Err(TradeoffError::Base {
                point: task.name,
                reason,
            });
        }
    }
    if (state.sweep.points.iter()).all(|point| point.phase == Phase::Base) {
        observe(Event::Note(format!(
            "only the base fits into {:.0} minutes: the same command with a larger --budget continues from here",
            options.budget / 60.0
        )));
    }
    // An earlier start may have been stopped between its files.
    write(&folder, &state, &mut album)?;
    Ok((folder, state.sweep))
}

/// `runs/<name of the COLMAP folder>-tradeoff`.
fn default_folder(colmap_dir: &Path) -> PathBuf {
    let mut folder = RunFolder::for_capture(colmap_dir)
        .path()
        .as_os_str()
        .to_owned();
    folder.push("-tradeoff");
    PathBuf::from(folder)
}

/// The next point: what there is to try follows from the bases' reports.
fn next(
    options: &TradeoffOptions,
    bench: &Bench<'_>,
    sweep: &Tradeoff,
    preset: Preset,
    largest_side: u32,
) -> Result<Option<Task>, TradeoffError> {
    let done = |stage| find(&sweep.points, base_name(stage)).is_some();
    let report = |stage| bench.folder(base_name(stage)).read_report();
    let mut space = Space {
        color: options.teacher.is_some(),
        ..Space::default()
    };
    if done(PointStage::Luma) {
        let adam = preset.adam_iterations();
        let mut around = Around::new(&report(PointStage::Luma)?, largest_side, adam);
        let asked = |preset: Preset| Work::asked(preset, &options.settings, options.load.max_side);
        let others = Preset::ALL.into_iter().filter(|&other| other != preset);
        around.presets = others
            .map(|other| (other.name(), around.work(&asked(other), &asked(preset))))
            .collect();
        if done(PointStage::Color) {
            around = around.colored(&report(PointStage::Color)?);
        }
        space.iterations = around.iterations;
        space.values = knobs::values(&around, &options.knobs);
    }
    Ok(search::next(&space, &sweep.points, options.budget))
}

/// Runs a point, and tells how far the budget is spent.
fn run(
    bench: &Bench<'_>,
    task: &Task,
    sweep: &Tradeoff,
    observe: &mut Observer<'_>,
) -> Result<Point, RunError> {
    let (spent, count) = (sweep.spent(), sweep.points.len());
    let expected = task
        .expected
        .map_or(String::new(), |seconds| format!(", about {seconds:.0} s"));
    bench.run(task, &sweep.points, &mut |seconds| {
        observe(Event::Progress {
            stage: Stage::Sweep,
            done: (spent + seconds) as usize,
            total: sweep.budget.ceil() as usize,
            message: format!("{count} points; {}{expected}", task.name),
        });
    })
}

/// A finished point on one line.
fn in_words(point: &Point) -> String {
    match (&point.outcome, &point.failed) {
        (Some(outcome), _) => {
            let mut line = format!("{}: {:.1} s", point.name, outcome.seconds.total);
            for &measure in Measure::of(point.stage) {
                if let Some(value) = measure.value(outcome) {
                    line += &format!(", {}", measure.in_words(value));
                }
            }
            line
        }
        (None, reason) => format!(
            "{}: failed: {}",
            point.name,
            reason.as_deref().unwrap_or_default()
        ),
    }
}

/// Writes the three files; the one that a sweep goes on from last.
fn write(folder: &Path, state: &State, album: &mut Album) -> Result<(), RunError> {
    let [table, _, html] = FILES.map(|name| folder.join(name));
    let pictures = album.of(&state.sweep);
    files::write(&table, csv(&state.sweep).as_bytes())?;
    files::write(&html, page(&state.sweep, pictures).as_bytes())?;
    state.write()
}
