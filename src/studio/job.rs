//! A command of the program in a process of its own.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    thread,
};

use serde::Serialize;

use crate::{
    invocation::Invocation,
    programs::{Program, Tether},
};

/// Warnings of a job that are kept.
const WARNINGS: usize = 50;

/// State of a job.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Phase {
    #[default]
    Going,
    /// It was asked to end, and writes what it needs to continue.
    Stopping,
    Stopped,
    Done,
    Failed,
}

/// What a job has said so far.
#[derive(Clone, Debug, Default, Serialize)]
pub struct JobState {
    pub phase: Phase,
    /// The line that began its present step, such as `step 2 of 6, fit`.
    pub step: String,
    /// Its last line.
    pub doing: String,
    pub warnings: Vec<String>,
    /// Address of the page that it serves.
    pub url: Option<String>,
}

/// A command line that goes on or has ended.
pub struct Job {
    pub number: usize,
    /// Arguments of the program.
    pub words: Vec<String>,
    /// True if it trains or colors a scene.
    pub makes: bool,
    state: Mutex<JobState>,
    tether: Arc<Tether>,
}

impl Job {
    /// A job that has not begun.
    pub fn new(number: usize, words: Vec<String>, makes: bool) -> Self {
        Self {
            number,
            words,
            makes,
            state: Mutex::default(),
            tether: Arc::default(),
        }
    }

    /// Name of what it works on: a folder's, or a network's.
    pub fn subject(&self) -> Option<&str> {
        let place = match self.words.first().map(String::as_str) {
            Some("auto") => self.words.iter().position(|word| word == "-o")? + 1,
            Some("teacher") => 2,
            _ => 1,
        };
        Path::new(self.words.get(place)?).file_name()?.to_str()
    }

    pub fn state(&self) -> MutexGuard<'_, JobState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns true until its process has ended.
    pub fn goes_on(&self) -> bool {
        matches!(self.state().phase, Phase::Going | Phase::Stopping)
    }

    /// Asks it to end, so that the same command can continue.
    pub fn stop(&self) {
        let mut state = self.state();
        if state.phase == Phase::Going {
            state.phase = Phase::Stopping;
            self.tether.cut();
        }
    }

    /// Starts it in a folder; `told` is called after every line.
    pub fn start(self: Arc<Self>, folder: PathBuf, told: impl Fn() + Send + 'static) {
        thread::spawn(move || {
            // In Python's process the program is started by Python.
            let [program, before @ ..] = &*Invocation::present().command else {
                self.end(Err("the program's own file is not known".to_owned()));
                return told();
            };
            let command = Program::new(program).args(before).args(self.words.clone());
            let done = command.run_tethered(&folder, &self.tether, &mut |line| {
                self.hear(line);
                told();
            });
            self.end(done.map_err(|error| error.to_string()));
            told();
        });
    }

    fn hear(&self, line: &str) {
        let mut state = self.state();
        if let Some(warning) = line.strip_prefix("warning: ") {
            if state.warnings.len() < WARNINGS {
                state.warnings.push(warning.to_owned());
            }
            return;
        }
        if line.starts_with("step ") {
            state.step = line.to_owned();
        }
        if let Some(url) = line
            .split(' ')
            .next()
            .filter(|url| url.starts_with("http://127.0.0.1:"))
        {
            state.url = Some(url.to_owned());
        }
        state.doing = line.to_owned();
    }

    fn end(&self, done: Result<(), String>) {
        let mut state = self.state();
        state.url = None;
        state.phase = match (&done, state.phase) {
            (_, Phase::Stopping) => Phase::Stopped,
            (Ok(()), _) => Phase::Done,
            (Err(reason), _) => {
                state.doing = reason.clone();
                Phase::Failed
            }
        };
    }
}
