//! `tradeoff`: what quality costs in time, on the user's scene and device.

mod child;
mod curve;
#[cfg(test)]
mod fixtures;
mod knobs;
mod plot;
mod point;
mod report;
mod request;
mod search;
mod state;
mod sweep;
mod worth;

use std::path::{Path, PathBuf};

pub use child::end_with_parent;
pub use knobs::knob_names;
pub use report::{front_table, shell_line};
pub use request::{FILES, TradeoffError, TradeoffOptions};
pub use sweep::{PointStage, Tradeoff};

use crate::{
    capture::{Capture, split},
    run::RunError,
    store::{RunFolder, StoreError, files},
    tell::{Event, Observer, Stage},
};
use point::Bench;
use search::Task;
use state::SweepState;
use sweep::SweepPoint;

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
    let folder = options.output.clone().unwrap_or_else(|| {
        let run = RunFolder::for_capture(&options.colmap_dir);
        let mut folder = run.path().as_os_str().to_owned();
        folder.push("-tradeoff");
        folder.into()
    });
    let capture = Capture::load(&options.colmap_dir).map_err(RunError::from)?;
    let holdout = options.fit.iter().all(|word| word != "--no-holdout");
    if split(&capture.views, holdout).test.is_empty() {
        return Err(TradeoffError::NothingToMeasure(options.colmap_dir.clone()));
    }
    let sides = capture.views.iter().flat_map(|view| view.photo_size());
    let largest_side = sides.max().unwrap_or(0);
    files::make_own_folder(&folder, &[FILES[0], request::POINTS], &[])?;
    let bench = Bench::new(options, &folder, largest_side)?;
    let mut state = SweepState::open(&folder, bench.subject.clone(), options.budget)?;

    while let Some(task) = next(options, &bench, &state.sweep)? {
        let points = run(&bench, &task, &state.sweep, observe)?;
        observe(Event::Note(in_words(&points[0])));
        let failed = points[0].failed.clone();
        let report = bench.folder(&task.name).read_report();
        state.add(points, report.ok().map(|report| report.device.name));
        write(&folder, &state)?;
        if task.expected.is_none() {
            let said = worth::sentence(&state.sweep, task.stage);
            let page = folder.join(FILES[1]);
            let said = said.map_or(String::new(), |said| format!("so far {said}; "));
            observe(Event::Note(format!("{said}see {}", page.display())));
        }
        if let (None, Some(reason)) = (task.expected, failed) {
            return Err(TradeoffError::Base {
                point: task.name,
                reason,
            });
        }
    }
    // An earlier start may have been stopped between its files.
    write(&folder, &state)?;
    Ok((folder, state.sweep))
}

/// The next point: what there is to try follows from the bases' reports.
fn next(
    options: &TradeoffOptions,
    bench: &Bench,
    sweep: &Tradeoff,
) -> Result<Option<Task>, RunError> {
    // The last base that ran knows most.
    let ran = PointStage::ALL.into_iter().rfind(|&stage| {
        let base = sweep.base(stage);
        base.is_some_and(|base| base.outcome.is_some())
    });
    let values = match ran {
        Some(stage) => knobs::values(&bench.base(stage)?, &options.knobs),
        None => Vec::new(),
    };
    Ok(search::next(&values, sweep, options.teacher.is_some()))
}

/// Runs a point, and tells how far the budget is spent; the point comes first, then those on its
/// way.
fn run(
    bench: &Bench,
    task: &Task,
    sweep: &Tradeoff,
    observe: &mut Observer<'_>,
) -> Result<Vec<SweepPoint>, RunError> {
    let (spent, count) = (sweep.spent(), sweep.points.len());
    let expected = task
        .expected
        .map_or(String::new(), |seconds| format!(", about {seconds:.0} s"));
    bench.run(task, sweep, &mut |seconds| {
        observe(Event::progress(
            Stage::Sweep,
            (spent + seconds) as usize,
            sweep.limit().ceil() as usize,
            format!("{count} points; {}{expected}", task.name),
        ));
    })
}

/// A finished point on one line.
fn in_words(point: &SweepPoint) -> String {
    let Some(outcome) = &point.outcome else {
        let reason = point.failed.as_deref().unwrap_or_default();
        return format!("{}: failed: {reason}", point.name);
    };
    let figures = sweep::MEASURES.iter().filter(|m| m.stage == point.stage);
    let figures: Vec<String> = figures.map(|measure| measure.in_words(outcome)).collect();
    format!(
        "{}: {:.1} s{}",
        point.name,
        outcome.seconds,
        figures.concat()
    )
}

/// Writes both files; the one that a sweep goes on from last.
fn write(folder: &Path, state: &SweepState) -> Result<(), StoreError> {
    files::write(
        &folder.join(FILES[1]),
        report::page(&state.sweep).as_bytes(),
    )?;
    state.write()
}
