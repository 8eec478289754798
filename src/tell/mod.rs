//! Events of a command while it goes on.

mod stage;

use std::cell::RefCell;

pub use stage::Stage;

use crate::eval::{self, Task};

/// An event of a command.
#[derive(Clone, Debug)]
pub enum Event {
    /// Some lines worth reading once.
    Note(String),
    /// A line about something doubtful that does not stop the run.
    Warning(String),
    /// Progress of a stage; the first of another stage ends the one before.
    Progress {
        /// Stage of the command.
        stage: Stage,
        /// Steps done.
        done: usize,
        /// Steps in all; 0 where they are not counted.
        total: usize,
        /// Figures of the moment.
        message: String,
    },
}

impl Event {
    /// A stage that is so far.
    pub fn progress(stage: Stage, done: usize, total: usize, message: impl Into<String>) -> Self {
        Self::Progress {
            stage,
            done,
            total,
            message: message.into(),
        }
    }

    /// A stage begins, whose steps are counted later if at all.
    pub fn begins(stage: Stage) -> Self {
        Self::progress(stage, 0, 0, "")
    }
}

/// Tells how far a stage is, whose total may be an estimate.
pub(crate) fn count(observe: &mut Observer<'_>, stage: Stage, done: usize, total: usize) {
    observe(Event::progress(stage, done.min(total), total, ""));
}

impl From<eval::Progress<'_>> for Event {
    fn from(progress: eval::Progress<'_>) -> Self {
        let stage = match progress.task {
            Task::Teacher => Stage::Teacher,
            Task::Peer => Stage::Baseline,
            Task::Measure => Stage::Measuring,
            Task::Path => Stage::Path,
            Task::Views => Stage::Views,
            Task::Pairs => Stage::Pairs,
            Task::Strength => Stage::Strength,
        };
        Self::progress(stage, progress.done, progress.total, progress.name)
    }
}

pub type Observer<'a> = dyn FnMut(Event) + 'a;

/// Tells `observe` everything and keeps the warnings.
pub(crate) fn keeping<'a>(
    warnings: &'a RefCell<Vec<String>>,
    observe: &'a mut Observer<'_>,
) -> impl FnMut(Event) + 'a {
    move |event| {
        if let Event::Warning(line) = &event {
            warnings.borrow_mut().push(line.clone());
        }
        observe(event);
    }
}
