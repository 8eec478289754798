//! Checkpoints in the run folder: what is interrupted goes on from the last.

use std::{
    cell::RefCell,
    collections::BTreeMap,
    fmt::{self, Write as _},
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use serde::{Deserialize, Serialize, de::DeserializeOwned};
use serde_json::Value;

use super::files;
use crate::{
    input, sections,
    store::StoreError,
    tell::{Event, Observer},
};

/// Layout of the files; raised when another program could not go on from them.
const VERSION: u32 = 3;

/// A checkpoint is made no sooner than after so many times what the last one took: at most one
/// fiftieth of the time goes into them.
const RARELY: u32 = 50;

/// Whoever asks for a training to end soon.
#[derive(Debug, Default)]
pub struct Interrupt {
    raised: AtomicBool,
    heeded: AtomicBool,
}

impl Interrupt {
    /// Asks for the end. `false` where nobody heeds it, or where it was asked for before: then
    /// nothing is lost by ending at once.
    pub fn raise(&self) -> bool {
        self.heeded.load(Ordering::SeqCst) && !self.raised.swap(true, Ordering::SeqCst)
    }

    fn is_raised(&self) -> bool {
        self.raised.load(Ordering::SeqCst)
    }
}

/// Checkpoint options of a command.
#[derive(Clone, Debug)]
pub struct CheckpointOptions {
    /// True to resume from the checkpoint in the run folder.
    pub resume: bool,
    /// Minutes between two; `None`: none is made but when interrupted.
    pub every: Option<f64>,
    /// Interrupt flag of the command.
    pub interrupt: Arc<Interrupt>,
}

/// Minutes between two checkpoints.
pub const EVERY: f64 = 10.0;

impl Default for CheckpointOptions {
    fn default() -> Self {
        Self {
            resume: false,
            every: Some(EVERY),
            interrupt: Arc::default(),
        }
    }
}

/// Metadata of a checkpoint.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Header<S> {
    version: u32,
    /// Options and inputs of the command, to be compared by name.
    question: Value,
    /// Seconds of the command so far, all of them.
    seconds: f64,
    /// Rows of the log.
    log: String,
    /// Results of the command's setup.
    started: S,
}

/// A checkpoint that was found.
pub(crate) struct Found<S, C> {
    path: PathBuf,
    header: Header<S>,
    pub checkpoint: C,
}

impl<S: DeserializeOwned, C> Found<S, C> {
    /// The checkpoint at a path, of which `parse` makes what goes on.
    ///
    /// # Errors
    /// [`StoreError::File`] where it is damaged or of another layout.
    pub fn read(
        path: &Path,
        parse: impl FnOnce(&BTreeMap<String, Vec<u8>>) -> Option<C>,
    ) -> Result<Self, StoreError> {
        let damaged =
            |reason: &str| StoreError::file(path, format!("{reason}: remove it, and start over"));
        let bytes = input::read(path).map_err(files::at(path))?;
        let sections = sections::read(&bytes).ok_or_else(|| damaged("is damaged"))?;
        let header = sections.get("run").map(Vec::as_slice).unwrap_or_default();
        let version = serde_json::from_slice::<Value>(header).ok();
        if version.is_none_or(|header| header["version"] != VERSION) {
            return Err(damaged("is one of another version of gs-chroma"));
        }
        let header = serde_json::from_slice(header).ok();
        let found = header.zip(parse(&sections));
        let (header, checkpoint) = found.ok_or_else(|| damaged("is damaged"))?;
        Ok(Self {
            path: path.to_owned(),
            header,
            checkpoint,
        })
    }

    /// Results of the command's setup.
    pub fn started(&self) -> &S {
        &self.header.started
    }

    /// When a command that goes on now would have begun.
    pub fn begun(&self) -> Instant {
        let now = Instant::now();
        let before = now.checked_sub(Duration::from_secs_f64(self.header.seconds));
        before.unwrap_or(now)
    }

    /// Rows of the log.
    pub fn log(&self) -> String {
        self.header.log.clone()
    }

    /// # Errors
    /// [`StoreError::OtherCheckpoint`] where it is one of something else.
    pub fn check(&self, question: &Value) -> Result<(), StoreError> {
        let mut differs = Vec::new();
        differences("", &self.header.question, question, &mut differs);
        if differs.is_empty() {
            return Ok(());
        }
        Err(StoreError::OtherCheckpoint {
            path: self.path.clone(),
            differs: differs.join(", "),
        })
    }
}

/// Names what differs: `settings.max_splats (5000, now 6000)`.
fn differences(name: &str, before: &Value, now: &Value, found: &mut Vec<String>) {
    match (before, now) {
        (Value::Object(before), Value::Object(now)) => {
            for (key, value) in before {
                let name = match name {
                    "" => key.clone(),
                    _ => format!("{name}.{key}"),
                };
                differences(&name, value, now.get(key).unwrap_or(&Value::Null), found);
            }
        }
        _ if before == now => {}
        // A sum says nothing to anybody.
        _ if name == "photos" => found.push("photos or poses".to_owned()),
        _ if ["init", "luma", "taught"].contains(&name) => found.push(name.to_owned()),
        _ => found.push(format!("{name} ({before}, now {now})")),
    }
}

/// Events and rows of the log of a command that keeps checkpoints meanwhile.
pub(crate) struct Journal<'o> {
    observe: RefCell<&'o mut Observer<'o>>,
    log: RefCell<String>,
}

impl<'o> Journal<'o> {
    /// One that begins with some rows.
    pub fn new(log: String, observe: &'o mut Observer<'o>) -> Self {
        Self {
            observe: RefCell::new(observe),
            log: RefCell::new(log),
        }
    }

    pub fn tell(&self, event: Event) {
        self.observe.borrow_mut()(event);
    }

    pub fn row(&self, row: fmt::Arguments<'_>) {
        // Writing to a string cannot fail.
        let _ = writeln!(self.log.borrow_mut(), "{row}");
    }

    pub fn rows(&self) -> String {
        self.log.borrow().clone()
    }
}

/// Writes checkpoints of a command that has `started` so.
pub(crate) struct CheckpointFiles<'a, 'o, S> {
    path: PathBuf,
    header: Header<S>,
    options: &'a CheckpointOptions,
    journal: &'a Journal<'o>,
    begun: Instant,
    /// When the next is due.
    due: Option<Instant>,
    told: bool,
    /// When the one that is being made was asked for.
    asked: Option<Instant>,
    /// Iterations done at an interrupt, once its checkpoint is written.
    interrupted: Option<Result<usize, StoreError>>,
}

impl<'a, 'o, S: Serialize> CheckpointFiles<'a, 'o, S> {
    /// Checkpoints of the command that answers `question`, begun at `begun`.
    pub fn new(
        path: PathBuf,
        question: Value,
        started: S,
        options: &'a CheckpointOptions,
        journal: &'a Journal<'o>,
        begun: Instant,
    ) -> Self {
        options.interrupt.heeded.store(true, Ordering::SeqCst);
        Self {
            path,
            header: Header {
                version: VERSION,
                question,
                seconds: 0.0,
                log: String::new(),
                started,
            },
            options,
            journal,
            begun,
            due: options.every.map(|minutes| Instant::now() + wait(minutes)),
            told: false,
            asked: None,
            interrupted: None,
        }
    }

    /// Ends with the work.
    ///
    /// # Errors
    /// [`StoreError::Interrupted`], or why the last checkpoint was not written.
    pub fn close(mut self) -> Result<(), StoreError> {
        let Some(written) = self.interrupted.take() else {
            return Ok(());
        };
        Err(StoreError::Interrupted {
            iteration: written?,
            path: self.path.clone(),
        })
    }

    /// Nobody heeds an interrupt any more.
    pub fn heed_no_more(&self) {
        self.options.interrupt.heeded.store(false, Ordering::SeqCst);
    }

    /// Returns true if a checkpoint is due.
    pub fn is_due(&mut self) -> bool {
        let now = Instant::now();
        let is_due = self.options.interrupt.is_raised() || self.due.is_some_and(|due| due <= now);
        self.asked = is_due.then_some(now);
        is_due
    }

    /// Writes one of work that is so far; `false` where it is to end.
    pub fn write(&mut self, far: usize, sections: &[(String, Vec<u8>)]) -> bool {
        // What it takes to read the work back from the device belongs to it.
        let begun = self.asked.take().unwrap_or_else(Instant::now);
        self.header.seconds = self.begun.elapsed().as_secs_f64();
        self.header.log = self.journal.rows();
        // Plain structs with string keys: serializing them cannot fail.
        let header = serde_json::to_vec(&self.header).unwrap_or_default();
        let mut all = vec![("run", header.as_slice())];
        all.extend(sections.iter().map(|(name, bytes)| (&name[..], &bytes[..])));
        let written = files::write_by(&self.path, |to| sections::write(to, &all));
        if self.options.interrupt.is_raised() {
            self.interrupted = Some(written.map(|_| far));
            return false;
        }
        let least = begun.elapsed() * RARELY;
        let every = self.options.every;
        self.due = every.map(|minutes| Instant::now() + wait(minutes).max(least));
        match written {
            Ok(size) if !self.told => {
                self.told = true;
                self.journal.tell(Event::Note(format!(
                    "wrote {}, {:.1} MiB: resumed, the command continues from there",
                    self.path.display(),
                    size as f64 / f64::from(1 << 20)
                )));
            }
            Ok(_) => {}
            // Better none than no result.
            Err(error) => self
                .journal
                .tell(Event::Warning(format!("no checkpoint: {error}"))),
        }
        true
    }
}

impl<S> Drop for CheckpointFiles<'_, '_, S> {
    fn drop(&mut self) {
        self.options.interrupt.heeded.store(false, Ordering::SeqCst);
    }
}

fn wait(minutes: f64) -> Duration {
    Duration::try_from_secs_f64(60.0 * minutes).unwrap_or(Duration::MAX / 4)
}

/// Says that what was interrupted is given up, if there is one.
pub(crate) fn tell_given_up(path: &Path, observe: &mut Observer<'_>) {
    if path.exists() {
        observe(Event::Warning(format!(
            "{} is left of an interrupted command, which is dropped: resumed, it would continue",
            path.display()
        )));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_differs_is_named() {
        let of = |splats: u32, side: Value, photos: &str| {
            serde_json::json!({
                "photos": photos,
                "settings": {"max_splats": splats, "seed": 0},
                "load": {"max_side": side},
            })
        };
        let before = of(5, 320.into(), "ab");
        let found = |now: &Value| {
            let mut found = Vec::new();
            differences("", &before, now, &mut found);
            found
        };
        assert!(found(&before).is_empty());
        let now = of(6, Value::Null, "cd");
        let expected = [
            "load.max_side (320, now null)",
            "photos or poses",
            "settings.max_splats (5, now 6)",
        ];
        assert_eq!(found(&now), expected);
    }

    #[test]
    fn an_interrupt_is_taken_once_and_only_where_it_is_heeded() {
        let interrupt = Interrupt::default();
        assert!(!interrupt.raise());
        interrupt.heeded.store(true, Ordering::SeqCst);
        assert!(!interrupt.is_raised());
        assert!(interrupt.raise() && interrupt.is_raised());
        assert!(!interrupt.raise());
    }
}
