//! The studio: a page that starts the program's own commands, one process each, and shows what
//! they made.
//!
//! It does nothing itself: a [`Job`](job::Job) is a command line, which the page shows, and the runs
//! are those in a folder. A request never names a file of it; runs go by the digest of their path.

mod content;
mod error;
mod job;
mod kept;
mod request;
mod shelf;

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError},
    time::Duration,
};

pub use content::StudioContent;
pub use error::StudioError;
use job::Job;
use kept::keep;
use request::StudioRequest;
use serde_json::{Value, json};

use crate::tradeoff::shell_line;

/// Jobs that go on at a time, at most.
const GOING: usize = 8;

/// A folder of runs, and the commands that were started from its page.
pub struct Studio {
    folder: PathBuf,
    state: Mutex<State>,
    changed: Condvar,
}

struct State {
    /// Counts up with every change.
    version: u64,
    jobs: Vec<Arc<Job>>,
}

impl Studio {
    /// A studio of a folder; runs are made in `runs/` below it.
    ///
    /// # Errors
    /// [`StudioError::NoInput`] where there is no such folder.
    pub fn open(folder: &Path) -> Result<Arc<Self>, StudioError> {
        let found = folder.canonicalize().ok().filter(|found| found.is_dir());
        let folder = found.ok_or_else(|| StudioError::NoInput(folder.to_owned()))?;
        Ok(Arc::new(Self {
            folder,
            state: Mutex::new(State {
                version: 1,
                jobs: Vec::new(),
            }),
            changed: Condvar::new(),
        }))
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn change(&self) {
        self.state().version += 1;
        self.changed.notify_all();
    }

    /// Does what the page asks for.
    fn take(self: &Arc<Self>, request: StudioRequest) -> Result<(), StudioError> {
        match request {
            StudioRequest::Stop { job } => {
                let jobs = self.state().jobs.clone();
                let job = jobs.into_iter().find(|known| known.number == job);
                job.ok_or(StudioError::Gone)?.stop();
            }
            other => {
                let (words, makes) = other.words(&self.folder)?;
                self.begin(words, makes)?;
            }
        }
        self.change();
        Ok(())
    }

    /// Starts a command, unless the same goes on.
    fn begin(self: &Arc<Self>, words: Vec<String>, makes: bool) -> Result<(), StudioError> {
        let mut state = self.state();
        let going = || state.jobs.iter().filter(|job| job.goes_on());
        if going().any(|job| job.words == words) {
            return Ok(());
        }
        if going().count() >= GOING || (makes && going().any(|job| job.makes)) {
            return Err(StudioError::Busy);
        }
        if makes {
            keep(&words)?;
        }
        let number = state.jobs.last().map_or(1, |job| job.number + 1);
        let job = Arc::new(Job::new(number, words, makes));
        state.jobs.push(job.clone());
        drop(state);
        let (studio, folder) = (self.clone(), self.folder.clone());
        job.start(folder, move || studio.change());
        Ok(())
    }

    /// What the page shows, as soon as it is not of `version`, or after some time.
    fn told(&self, version: u64, within: Duration) -> Value {
        let waited = (self.changed)
            .wait_timeout_while(self.state(), within, |state| state.version == version)
            .unwrap_or_else(PoisonError::into_inner);
        let (version, jobs) = (waited.0.version, waited.0.jobs.clone());
        drop(waited);
        let jobs = jobs.iter().rev().map(|job| {
            let mut told = json!(*job.state());
            told["number"] = json!(job.number);
            told["subject"] = json!(job.subject());
            told["makes"] = json!(job.makes);
            told["command"] = json!(shell_line(&job.words));
            told
        });
        json!({
            "version": version,
            "folder": self.folder,
            "jobs": jobs.collect::<Vec<_>>(),
            "runs": shelf::runs(&self.folder),
        })
    }
}
