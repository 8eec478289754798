//! `prepare.json`: what was made of what, so that nothing is made twice and nothing removed that
//! somebody else has put there.

use std::{
    collections::BTreeMap,
    fs::{self, File, TryLockError},
    io,
    path::{Path, PathBuf},
    time::UNIX_EPOCH,
};

use serde::{Deserialize, Serialize};

use super::{
    PrepareError,
    options::{DATABASE, FILM, MASKS, PrepareOptions, SPARSE, STRETCHED},
};
use crate::{
    capture::{FRAMES, IMAGES, names::visit_files},
    disk,
    hash::Hasher,
    input,
    store::files,
};

/// The file, in the output folder.
const FILE: &str = "prepare.json";

/// Locked while it is worked on, and left behind empty.
const LOCK: &str = "prepare.lock";

/// Prefix of folders whose content is still incomplete.
const DRAFT: &str = ".prepare-";

/// All that a step can have made: what else the file names is none of it.
const RESULTS: [&str; 7] = [FRAMES, FILM, IMAGES, MASKS, STRETCHED, DATABASE, SPARSE];

const VERSION: u32 = 1;

/// Record of the last run, the content of `prepare.json`.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct Record {
    version: u32,
    /// The program's version.
    program: String,
    /// The film or folder, absolute.
    input: PathBuf,
    /// The options of the last time.
    options: PrepareOptions,
    /// Steps done so far.
    steps: BTreeMap<Step, Done>,
    /// The shots of the whole film, in seconds, and what they were found in.
    shots: Option<(String, Vec<[f64; 2]>)>,
    /// True if the last run ended with an error, not by an interrupt.
    #[serde(default)]
    failed: bool,
}

impl Record {
    /// True if there are poses, or may be once it goes on.
    fn has_worth(&self) -> bool {
        !self.failed || self.steps.contains_key(&Step::Poses)
    }

    /// Refuses results that no step makes.
    fn check(self) -> Result<Self, String> {
        let mut names = self.steps.values().flat_map(|done| done.results.keys());
        match names.find(|name| !RESULTS.contains(&name.as_str())) {
            Some(name) => Err(format!("{name:?} is nothing that a step makes")),
            None => Ok(self),
        }
    }
}

/// A step that was done, or is about to be.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
struct Done {
    /// Digest of the step's inputs; empty where it was only begun.
    from: String,
    /// Digests of its results by their names in the output folder.
    results: BTreeMap<String, String>,
}

/// A step whose results are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Step {
    Frames,
    Images,
    Masks,
    Stretched,
    Features,
    Matches,
    Poses,
}

/// An output folder that this process works in.
pub(super) struct OutputState {
    folder: PathBuf,
    record: Record,
    /// Keeps a second process away; whatever ends this one frees it.
    _lock: Option<File>,
}

impl OutputState {
    /// Takes an output folder: a new one, an empty one, or one that was prepared from the same
    /// input; with `force` from any. What a process has left half-done is removed.
    ///
    /// # Errors
    /// [`PrepareError::NotOurs`], [`PrepareError::OtherInput`], and those of the system.
    pub fn open(
        folder: &Path,
        input: &Path,
        options: &PrepareOptions,
    ) -> Result<Self, PrepareError> {
        let path = folder.join(FILE);
        let record = match input::read_to_string(&path) {
            Ok(text) => {
                let record = serde_json::from_str::<Record>(&text).map_err(|e| e.to_string());
                let record = record.and_then(Record::check);
                let damaged = |error| format!("damaged ({error}); choose another folder with -o");
                Some(record.map_err(|error| PrepareError::at(&path, damaged(error)))?)
            }
            Err(error) if error.kind() == io::ErrorKind::NotFound => None,
            Err(error) => return Err(files::at(&path)(error).into()),
        };
        let other = record.as_ref().is_some_and(|record| record.input != input);
        match &record {
            None => check_empty(folder, input)?,
            Some(record) if record.version != VERSION => {
                let reason = format!(
                    "was written by gs-chroma {}; choose another folder with -o",
                    record.program
                );
                return Err(PrepareError::at(&path, reason));
            }
            // What failed before it had poses is worth nothing for another input.
            Some(record) if other && !options.force && record.has_worth() => {
                return Err(PrepareError::OtherInput {
                    folder: folder.into(),
                    input: record.input.clone(),
                });
            }
            Some(_) => {}
        }
        files::make_folder(folder)?;
        let lock = lock(&folder.join(LOCK))?;
        let mut state = Self {
            folder: folder.into(),
            record: Record {
                version: VERSION,
                program: env!("CARGO_PKG_VERSION").to_owned(),
                input: input.into(),
                options: options.clone(),
                steps: BTreeMap::new(),
                shots: None,
                failed: false,
            },
            _lock: lock,
        };
        state.remove_drafts()?;
        if let Some(record) = record {
            state.record.steps = record.steps;
            state.record.shots = record.shots;
        }
        if options.force || other {
            state.begin_anew()?;
        }
        state.write()?;
        Ok(state)
    }

    /// Path of a file of the capture, which need not exist.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    /// Returns true if a step was done from the same inputs and its results are there.
    pub fn is_done(&self, step: Step, from: &str) -> bool {
        self.record.steps.get(&step).is_some_and(|done| {
            let mut results = done.results.keys();
            done.from == from && results.all(|result| is_there(&self.path(result)))
        })
    }

    /// Returns true if a step was ever done, from any inputs.
    pub fn was_done(&self, step: Step) -> bool {
        let done = self.record.steps.get(&step);
        done.is_some_and(|done| !done.from.is_empty())
    }

    /// Forgets that a step was done, whose results are about to be replaced.
    pub fn forget(&mut self, step: Step) {
        if let Some(done) = self.record.steps.get_mut(&step) {
            done.from.clear();
        }
    }

    /// Puts what a step has made into its place, each by its name there, removes what the step
    /// had made before, and says what it was made from.
    ///
    /// # Errors
    /// [`PrepareError::Changed`] where somebody has changed what would be replaced, and the
    /// system's.
    pub fn place(
        &mut self,
        step: Step,
        from: &str,
        made: &[(PathBuf, &str)],
    ) -> Result<(), PrepareError> {
        let before = self.record.steps.get(&step);
        let before = before.map_or(Vec::new(), |done| done.results.keys().cloned().collect());
        let new = made.iter().map(|(_, result)| (*result).to_owned());
        self.take_away(before.into_iter().chain(new))?;
        let mut done = Done::default();
        for (made, result) in made {
            done.results.insert((*result).to_owned(), digest(made)?);
        }
        // Known before it is there, so that it is never taken for somebody else's.
        self.record.steps.insert(step, done);
        self.write()?;
        for (made, result) in made {
            let path = self.path(result);
            disk::rename(made, &path).map_err(files::at(&path))?;
        }
        if let Some(done) = self.record.steps.get_mut(&step) {
            done.from = from.to_owned();
        }
        self.write()
    }

    /// Refuses to go on where a result that will be replaced was changed: better now than after
    /// hours of work.
    ///
    /// # Errors
    /// [`PrepareError::Changed`], and the system's.
    pub fn check_own(&self, result: &str) -> Result<(), PrepareError> {
        let path = self.path(result);
        let mut steps = self.record.steps.values();
        let own = steps.find_map(|done| done.results.get(result));
        let is_own =
            |own: &String| !path.is_symlink() && digest(&path).is_ok_and(|now| now == *own);
        match path.symlink_metadata().is_ok() && !own.is_some_and(is_own) {
            true => Err(PrepareError::Changed { path }),
            false => Ok(()),
        }
    }

    /// Removes results, if they are as they were made.
    fn take_away(&mut self, results: impl Iterator<Item = String>) -> Result<(), PrepareError> {
        for result in results {
            self.check_own(&result)?;
            let path = self.path(&result);
            if is_there(&path) {
                // In one step, so that nothing is left of it that looks whole.
                let aside = disk::create_folder(DRAFT, &self.folder).map_err(files::at(&path))?;
                disk::rename(&path, &aside.path().join("old")).map_err(files::at(&path))?;
            }
            for done in self.record.steps.values_mut() {
                done.results.remove(&result);
            }
        }
        Ok(())
    }

    /// Forgets all steps and removes their results.
    fn begin_anew(&mut self) -> Result<(), PrepareError> {
        let steps = self.record.steps.values();
        let results: Vec<String> = steps
            .flat_map(|done| done.results.keys().cloned())
            .collect();
        results
            .iter()
            .try_for_each(|result| self.check_own(result))?;
        self.take_away(results.into_iter())?;
        self.record.steps.clear();
        self.record.shots = None;
        Ok(())
    }

    /// An empty folder beside the results, for one that is not whole yet.
    ///
    /// # Errors
    /// The system's.
    pub fn draft(&self) -> Result<disk::DraftFolder, PrepareError> {
        Ok(disk::create_folder(DRAFT, &self.folder).map_err(files::at(&self.folder))?)
    }

    /// Keeps in mind that it ended with an error.
    ///
    /// # Errors
    /// The system's.
    pub fn fail(&mut self) -> Result<(), PrepareError> {
        self.record.failed = true;
        self.write()
    }

    /// The shots of the whole film, if they were found in the same film.
    pub fn shots(&self, from: &str) -> Option<&[[f64; 2]]> {
        let (known, shots) = self.record.shots.as_ref()?;
        (known == from).then_some(shots)
    }

    /// Keeps the shots of the whole film.
    ///
    /// # Errors
    /// The system's.
    pub fn keep_shots(&mut self, from: String, shots: Vec<[f64; 2]>) -> Result<(), PrepareError> {
        self.record.shots = Some((from, shots));
        self.write()
    }

    fn write(&self) -> Result<(), PrepareError> {
        let path = self.path(FILE);
        let mut text = serde_json::to_vec_pretty(&self.record)
            .map_err(|error| PrepareError::at(&path, error.to_string()))?;
        text.push(b'\n');
        Ok(files::write(&path, &text)?)
    }

    fn remove_drafts(&self) -> Result<(), PrepareError> {
        let entries = fs::read_dir(&self.folder).map_err(files::at(&self.folder))?;
        for entry in entries.flatten() {
            if entry.file_name().to_string_lossy().starts_with(DRAFT) {
                disk::remove(&entry.path()).map_err(files::at(&entry.path()))?;
            }
        }
        Ok(())
    }
}

/// True if a result exists and is no symbolic link.
fn is_there(path: &Path) -> bool {
    path.exists() && !path.is_symlink()
}

/// Refuses a folder that holds more than the input itself.
fn check_empty(folder: &Path, input: &Path) -> Result<(), PrepareError> {
    if !folder.is_dir() {
        return Ok(());
    }
    let entries = fs::read_dir(folder).map_err(files::at(folder))?;
    for entry in entries.flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        let begun = name.starts_with(DRAFT) || name.starts_with(".tmp");
        let known = files::OF_SYSTEMS.contains(&&*name) || name == LOCK || begun;
        if !(known || input.starts_with(entry.path())) {
            return Err(PrepareError::NotOurs {
                folder: folder.into(),
                other: name,
            });
        }
    }
    Ok(())
}

/// Locks a file; there is no lock where the file system knows none.
fn lock(path: &Path) -> Result<Option<File>, PrepareError> {
    let file = disk::open_in_place(path).map_err(files::at(path))?;
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::Error(_)) => Ok(None),
        Err(TryLockError::WouldBlock) => Err(PrepareError::at(
            path,
            "another process prepares this folder: wait for it, or choose another with -o",
        )),
    }
}

/// Names, sizes and times of a file or of all files below a folder, in a few digits.
///
/// # Errors
/// If one cannot be asked for them.
pub(crate) fn digest(path: &Path) -> Result<String, PrepareError> {
    let mut found = BTreeMap::new();
    if path.is_dir() {
        visit_files(path, &mut |name, file| {
            found.insert(name, file);
        })
        .map_err(|(path, error)| files::at(&path)(error))?;
    } else {
        found.insert(String::new(), path.to_path_buf());
    }
    let mut parts = Vec::new();
    for (name, file) in found {
        let metadata = fs::metadata(&file).map_err(files::at(&file))?;
        let modified = metadata.modified().ok();
        let since = modified.and_then(|time| time.duration_since(UNIX_EPOCH).ok());
        parts.push(name);
        parts.push(metadata.len().to_string());
        parts.push(since.map_or(0, |since| since.as_nanos()).to_string());
    }
    Ok(of(&parts))
}

/// Some words in a few digits.
pub(crate) fn of<S: AsRef<str>>(words: &[S]) -> String {
    let mut hasher = Hasher::default();
    for word in words {
        hasher.update(word.as_ref().as_bytes());
        // So that no two lists of words are one.
        hasher.update(&[0]);
    }
    let mut digits = hasher.finish();
    digits.truncate(16);
    digits
}
