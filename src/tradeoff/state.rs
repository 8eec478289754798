//! `tradeoff.json`: what a sweep goes on from.

use std::{
    fs::{File, TryLockError},
    path::{Path, PathBuf},
};

use super::{
    request::{FILES, POINTS},
    sweep::{Phase, Subject, SweepPoint, TRADEOFF_VERSION, Tradeoff},
};
use crate::{
    disk::{self, trust},
    input,
    store::{StoreError, files},
};

/// Locked while a sweep runs, and left behind empty.
const LOCK: &str = "tradeoff.lock";

/// A sweep and its file.
pub(super) struct SweepState {
    /// Keeps a second sweep away; whatever ends the process frees it.
    _lock: File,
    /// File at fault.
    path: PathBuf,
    /// Content of the file.
    pub sweep: Tradeoff,
}

impl SweepState {
    /// The sweep of a folder, or a new one. A base that failed is tried again.
    ///
    /// # Errors
    /// [`StoreError::File`] when the folder holds a sweep of something else, or one that runs.
    pub fn open(folder: &Path, subject: Subject, budget: f64) -> Result<Self, StoreError> {
        let points = folder.join(POINTS);
        trust::check_inside(folder, &points).map_err(files::at(&points))?;
        let lock = lock(&folder.join(LOCK))?;
        let path = folder.join(FILES[1]);
        let mut sweep = match input::read_to_string(&path) {
            Ok(text) => read(&text, &subject).map_err(|reason| StoreError::file(&path, reason))?,
            Err(_) => Tradeoff {
                version: TRADEOFF_VERSION,
                program: env!("CARGO_PKG_VERSION").to_owned(),
                subject,
                device: None,
                budget,
                points: Vec::new(),
            },
        };
        sweep.budget = budget;
        (sweep.points).retain(|point| point.phase != Phase::Base || point.failed.is_none());
        Ok(Self {
            _lock: lock,
            path,
            sweep,
        })
    }

    /// Adds a point that has run.
    pub fn add(&mut self, point: SweepPoint, device: Option<String>) {
        self.sweep.points.push(point);
        self.sweep.device = device.or(self.sweep.device.take());
    }

    /// Writes the file beside and renames.
    pub fn write(&self) -> Result<(), StoreError> {
        files::write(&self.path, (self.sweep.to_json() + "\n").as_bytes())
    }
}

/// Locks a file, where the file system can.
fn lock(path: &Path) -> Result<File, StoreError> {
    let file = disk::open_in_place(path).map_err(files::at(path))?;
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(StoreError::file(
            path,
            "another sweep runs in this folder: wait for it, or choose another with -o",
        )),
        _ => Ok(file),
    }
}

/// A sweep of `subject`; else what is wrong and what to do.
fn read(text: &str, subject: &Subject) -> Result<Tradeoff, String> {
    const REMEDY: &str = "choose another folder with -o, or remove this one";
    let sweep: Tradeoff =
        serde_json::from_str(text).map_err(|error| format!("damaged ({error}): {REMEDY}"))?;
    if let Some(odd) = (sweep.points.iter()).find(|point| !trust::is_entry(&point.name)) {
        return Err(format!(
            "damaged (a point is called {:?}): {REMEDY}",
            odd.name
        ));
    }
    let there = &sweep.subject;
    let differs = [
        ("scene", there.scene != subject.scene),
        ("teacher", there.teacher != subject.teacher),
        ("set of options of fit", there.options != subject.options),
    ];
    match differs.iter().find(|(_, differs)| *differs) {
        Some((what, _)) => Err(format!("is a sweep with another {what}: {REMEDY}")),
        None if sweep.version != TRADEOFF_VERSION => Err(format!(
            "was written by gs-chroma {}: {REMEDY}",
            sweep.program
        )),
        None => Ok(sweep),
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{failed, luma, sweep};
    use super::*;

    #[test]
    fn a_sweep_goes_on_where_it_was() {
        let subject = sweep(Vec::new()).subject;
        let folder = tempfile::tempdir().expect("a folder");
        let open = |budget| SweepState::open(folder.path(), subject.clone(), budget);
        let mut state = open(60.0).expect("new");
        state.add(luma("base", 3.0, 24.0), Some("llvmpipe".to_owned()));
        state.add(failed("sh-degree-3", "no memory"), None);
        state.write().expect("written");
        let refusal = open(90.0).err().expect("refused").to_string();
        assert!(refusal.contains("another sweep runs"), "{refusal}");
        let before = state.sweep.points.clone();
        drop(state);
        let mut again = open(90.0).expect("the same");
        assert_eq!(again.sweep.points, before);
        assert_eq!(again.sweep.device.as_deref(), Some("llvmpipe"));
        assert_eq!((again.sweep.budget, again.sweep.spent()), (90.0, 4.0));
        // A base that failed is tried again.
        again.sweep.points[0].failed = Some("no memory".to_owned());
        again.write().expect("written");
        drop(again);
        assert_eq!(open(90.0).expect("the same").sweep.points, before[1..]);
    }

    #[test]
    fn another_subject_is_refused_with_a_remedy() {
        let subject = sweep(Vec::new()).subject;
        let folder = tempfile::tempdir().expect("a folder");
        SweepState::open(folder.path(), subject.clone(), 60.0)
            .and_then(|state| state.write())
            .expect("written");
        type Change = (&'static str, fn(&mut Subject));
        let changes: [Change; 3] = [
            ("scene", |s| s.scene.push('2')),
            ("teacher", |s| s.teacher = Some("/t".to_owned())),
            ("options", |s| s.options.clear()),
        ];
        for (what, change) in changes {
            let mut other = subject.clone();
            change(&mut other);
            let error = SweepState::open(folder.path(), other, 60.0)
                .err()
                .expect("refused");
            let error = error.to_string();
            assert!(error.contains(what) && error.contains("-o"), "{error}");
        }
        std::fs::write(folder.path().join(FILES[1]), "{").expect("written");
        let error = SweepState::open(folder.path(), subject, 60.0)
            .err()
            .expect("refused");
        assert!(error.to_string().contains("damaged"), "{error}");
    }
}
