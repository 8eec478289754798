//! Checkpoints in the run folder: an interrupted training goes on from the last.

use std::{
    cell::RefCell,
    path::{Path, PathBuf},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{
    super::{Event, Observer, Preset, RunError, RunFolder, files, preset::Work},
    FitOptions, Init,
    budget::Budget,
};
use crate::{
    capture::LoadOptions,
    gpu::Gpu,
    hash, input,
    luma::{Checkpoint, Keeper, LumaSettings},
    sections,
};

/// Layout of the file; raised when another program could not go on from it.
const VERSION: u32 = 1;

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

/// How a training that is interrupted can go on.
#[derive(Clone, Debug)]
pub struct CheckpointOptions {
    /// Whether to go on from the checkpoint in the run folder.
    pub resume: bool,
    /// Minutes between two; `None`: none is made but when interrupted.
    pub every: Option<f64>,
    /// Who may interrupt it.
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

/// What of a run is known before its photos are.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Header {
    version: u32,
    /// What it was asked for and given, to be compared by name.
    question: Value,
    preset: Preset,
    settings: LumaSettings,
    max_side: Option<u32>,
    /// Seconds that an iteration was expected to take.
    each: f64,
    /// Seconds of the run so far, all of them.
    seconds: f64,
    /// Rows of the log.
    log: String,
}

/// A checkpoint that was found.
pub(super) struct Found {
    path: PathBuf,
    header: Header,
    pub checkpoint: Checkpoint,
}

impl Found {
    /// The checkpoint to go on from; none where there never was one.
    ///
    /// # Errors
    /// [`RunError::File`] where it is damaged or of another layout,
    /// [`RunError::NothingToResume`] where a run ended as it should.
    pub fn in_folder(
        folder: &RunFolder,
        observe: &mut Observer<'_>,
    ) -> Result<Option<Self>, RunError> {
        let path = folder.checkpoint();
        if !path.exists() {
            if folder.report().exists() {
                return Err(RunError::NothingToResume(folder.path().to_owned()));
            }
            observe(Event::Note(format!(
                "{} does not exist: training begins anew",
                path.display()
            )));
            return Ok(None);
        }
        let damaged = |reason: &str| RunError::File {
            path: path.clone(),
            reason: format!("{reason}: remove it, and train anew"),
        };
        let bytes = input::read(&path).map_err(files::at(&path))?;
        let sections = sections::read(&bytes).ok_or_else(|| damaged("is damaged"))?;
        let header = sections.get("run").map(Vec::as_slice).unwrap_or_default();
        let version = serde_json::from_slice::<Value>(header).ok();
        if version.is_none_or(|header| header["version"] != VERSION) {
            return Err(damaged("is one of another version of gs-chroma"));
        }
        let header = serde_json::from_slice(header).ok();
        let found = header.zip(Checkpoint::from_sections(&sections));
        let (header, checkpoint) = found.ok_or_else(|| damaged("is damaged"))?;
        Ok(Some(Self {
            path,
            header,
            checkpoint,
        }))
    }

    /// The work that the run has begun.
    pub fn budget(&self) -> Budget {
        Budget {
            preset: self.header.preset,
            work: Work {
                settings: self.header.settings.clone(),
                max_side: self.header.max_side,
            },
            each: self.header.each,
        }
    }

    /// When a run that goes on now would have begun.
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
    /// [`RunError::OtherCheckpoint`] where it is one of something else.
    pub fn check(&self, question: &Value) -> Result<(), RunError> {
        let mut differs = Vec::new();
        differences("", &self.header.question, question, &mut differs);
        if differs.is_empty() {
            return Ok(());
        }
        Err(RunError::OtherCheckpoint {
            path: self.path.clone(),
            differs: differs.join(", "),
        })
    }
}

/// What a run is asked for and given.
///
/// # Errors
/// [`RunError::File`] of the Gaussians to start from.
pub(super) fn question(
    options: &FitOptions,
    budget: &Budget,
    load: &LoadOptions,
    gpu: &Gpu,
    photos: &str,
) -> Result<Value, RunError> {
    let init = options.init.as_ref().map(Init::path).map(|path| {
        let sha256 = input::open(&path).and_then(hash::of_file);
        sha256.map_err(files::at(&path))
    });
    Ok(serde_json::json!({
        "program": env!("CARGO_PKG_VERSION"),
        "device": gpu.describe(),
        "photos": photos,
        "preset": budget.preset,
        "settings": budget.work.settings,
        "load": load,
        "effects": format!("{:?}", options.overrules),
        "goal": options.goal,
        "measure-side": options.measure_side,
        "init": init.transpose()?,
    }))
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
        _ if name == "photos" || name == "init" => found.push(name.to_owned()),
        _ => found.push(format!("{name} ({before}, now {now})")),
    }
}

/// Keeps checkpoints in the run folder.
pub(super) struct FolderKeeper<'a> {
    path: PathBuf,
    header: Header,
    options: &'a CheckpointOptions,
    log: &'a RefCell<String>,
    tell: &'a dyn Fn(Event),
    begun: Instant,
    /// When the next is due.
    due: Option<Instant>,
    told: bool,
    /// What was written when it was interrupted.
    pub interrupted: Option<Result<usize, RunError>>,
}

impl<'a> FolderKeeper<'a> {
    /// A keeper for the run that answers `question`, begun at `begun`.
    pub fn new(
        folder: &RunFolder,
        question: Value,
        budget: &Budget,
        options: &'a CheckpointOptions,
        log: &'a RefCell<String>,
        tell: &'a dyn Fn(Event),
        begun: Instant,
    ) -> Self {
        options.interrupt.heeded.store(true, Ordering::SeqCst);
        Self {
            path: folder.checkpoint(),
            header: Header {
                version: VERSION,
                question,
                preset: budget.preset,
                settings: budget.work.settings.clone(),
                max_side: budget.work.max_side,
                each: budget.each,
                seconds: 0.0,
                log: String::new(),
            },
            options,
            log,
            tell,
            begun,
            due: options.every.map(|minutes| Instant::now() + wait(minutes)),
            told: false,
            interrupted: None,
        }
    }

    fn write(&mut self, checkpoint: &Checkpoint) -> Result<u64, RunError> {
        self.header.seconds = self.begun.elapsed().as_secs_f64();
        self.header.log.clone_from(&self.log.borrow());
        // Plain structs with string keys: serializing them cannot fail.
        let header = serde_json::to_vec(&self.header).unwrap_or_default();
        let training = checkpoint.to_sections();
        let mut all = vec![("run", header.as_slice())];
        all.extend(training.iter().map(|(name, bytes)| (&name[..], &bytes[..])));
        files::write_by(&self.path, |to| sections::write(to, &all))
    }
}

impl Keeper for FolderKeeper<'_> {
    fn wants(&mut self, _: usize) -> bool {
        self.options.interrupt.is_raised() || self.due.is_some_and(|due| due <= Instant::now())
    }

    fn keep(&mut self, checkpoint: Checkpoint) -> bool {
        let begun = Instant::now();
        let written = self.write(&checkpoint);
        if self.options.interrupt.is_raised() {
            self.interrupted = Some(written.map(|_| checkpoint.iteration()));
            return false;
        }
        let least = begun.elapsed() * RARELY;
        let every = self.options.every;
        self.due = every.map(|minutes| Instant::now() + wait(minutes).max(least));
        match written {
            Ok(size) if !self.told => {
                self.told = true;
                (self.tell)(Event::Note(format!(
                    "wrote {}, {:.1} MiB: --resume goes on from there",
                    self.path.display(),
                    size as f64 / f64::from(1 << 20)
                )));
            }
            Ok(_) => {}
            // Better none than no training.
            Err(error) => (self.tell)(Event::Warning(format!("no checkpoint: {error}"))),
        }
        true
    }
}

impl Drop for FolderKeeper<'_> {
    fn drop(&mut self) {
        self.options.interrupt.heeded.store(false, Ordering::SeqCst);
    }
}

fn wait(minutes: f64) -> Duration {
    Duration::try_from_secs_f64(60.0 * minutes).unwrap_or(Duration::MAX / 4)
}

/// Says that an interrupted training is given up, if there is one.
pub(super) fn tell_given_up(path: &Path, observe: &mut Observer<'_>) {
    if path.exists() {
        observe(Event::Warning(format!(
            "{} is left of an interrupted training, which is given up: --resume would go on with it",
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
            "photos",
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
