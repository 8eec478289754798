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
    thread,
    time::{Duration, Instant},
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

/// Jobs that have ended and are still listed, at most.
const ENDED: usize = 20;

/// The folder is looked at no sooner than after so long.
const EVERY: Duration = Duration::from_secs(1);

/// A folder of runs, and the commands that were started from its page.
pub struct Studio {
    folder: PathBuf,
    state: Mutex<State>,
    changed: Condvar,
    looked: Mutex<Option<Look>>,
}

/// The runs that were found in the folder, when, and the version then.
struct Look {
    at: Instant,
    version: u64,
    runs: Vec<Value>,
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
            looked: Mutex::default(),
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
        let ended = state.jobs.iter().filter(|job| !job.goes_on()).count();
        let mut over = ended.saturating_sub(ENDED);
        state.jobs.retain(|job| {
            let goes = over > 0 && !job.goes_on();
            over -= usize::from(goes);
            !goes
        });
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
        let version = waited.0.version;
        drop(waited);
        let (version, runs) = self.runs(version);
        let jobs = self.state().jobs.clone();
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
            "runs": runs,
        })
    }

    /// The runs in the folder as they are at `version` or later, and which: a job says more lines
    /// than anybody can look at.
    fn runs(&self, version: u64) -> (u64, Vec<Value>) {
        let mut looked = self.looked.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(look) = &*looked {
            let fresh = EVERY.saturating_sub(look.at.elapsed());
            if look.version >= version && !fresh.is_zero() {
                return (look.version, look.runs.clone());
            }
            thread::sleep(fresh);
        }
        let version = self.state().version;
        let runs = shelf::runs(&self.folder);
        let at = Instant::now();
        *looked = Some(Look {
            at,
            version,
            runs: runs.clone(),
        });
        (version, runs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_folder_is_looked_at_once_a_second_and_no_change_is_missed() {
        let place = tempfile::tempdir().unwrap();
        let studio = Studio::open(place.path()).unwrap();
        let mut version = studio.told(0, Duration::ZERO)["version"].as_u64().unwrap();
        let begun = Instant::now();
        for k in 1..=2 {
            for _ in 0..50 {
                studio.change();
            }
            let run = place.path().join(format!("run{k}"));
            std::fs::create_dir(&run).unwrap();
            std::fs::write(run.join("report.json"), "{}").unwrap();
            studio.change();
            let told = studio.told(version, Duration::from_secs(9));
            assert_eq!(told["runs"].as_array().unwrap().len(), k);
            version = told["version"].as_u64().unwrap();
            assert_eq!(version, studio.state().version);
        }
        assert!(
            begun.elapsed() >= 2 * EVERY.mul_f64(0.9),
            "{:?}",
            begun.elapsed()
        );
        // Another page is told the same without waiting.
        let begun = Instant::now();
        studio.told(0, Duration::ZERO);
        assert!(begun.elapsed() < EVERY / 2);
    }

    #[test]
    fn jobs_that_have_ended_leave_the_list_and_numbers_stay_their_own() {
        let place = tempfile::tempdir().unwrap();
        let studio = Studio::open(place.path()).unwrap();
        for k in 0..ENDED + 5 {
            // No such command: it fails at once.
            studio
                .begin(vec!["--none".to_owned(), k.to_string()], false)
                .unwrap();
            let last = studio.state().jobs.last().cloned().unwrap();
            assert_eq!(last.number, k + 1);
            while last.goes_on() {
                thread::sleep(Duration::from_millis(5));
            }
        }
        let jobs = studio.state().jobs.clone();
        assert!((ENDED..=ENDED + 1).contains(&jobs.len()), "{}", jobs.len());
        assert_eq!(jobs.last().unwrap().number, ENDED + 5);
    }
}
