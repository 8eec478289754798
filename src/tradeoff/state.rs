//! `tradeoff.json`: what a sweep goes on from.

use std::path::{Path, PathBuf};

use super::{
    request::{FILES, POINTS},
    sweep::{Subject, SweepPoint, TRADEOFF_VERSION, Tradeoff},
};
use crate::{
    disk::trust,
    input,
    store::{StoreError, files, lock::RunLock},
};

/// A sweep and its file.
pub(super) struct SweepState {
    /// Keeps a second sweep away.
    _lock: RunLock,
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
    pub fn open(folder: &Path, subject: Subject, budget: Option<f64>) -> Result<Self, StoreError> {
        let points = folder.join(POINTS);
        trust::check_inside(folder, &points).map_err(files::at(&points))?;
        let lock = RunLock::take(folder)?;
        let path = folder.join(FILES[0]);
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
        (sweep.points).retain(|point| !point.is_base() || point.failed.is_none());
        Ok(Self {
            _lock: lock,
            path,
            sweep,
        })
    }

    /// Adds a point that has run, and those on its way.
    pub fn add(&mut self, points: Vec<SweepPoint>, device: Option<String>) {
        self.sweep.points.extend(points);
        self.sweep.device = device.or(self.sweep.device.take());
    }

    /// Writes the file beside and renames.
    pub fn write(&self) -> Result<(), StoreError> {
        files::write(&self.path, (self.sweep.to_json() + "\n").as_bytes())
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
    match sweep.version == TRADEOFF_VERSION {
        false => Err(format!(
            "was written by gs-chroma {}: {REMEDY}",
            sweep.program
        )),
        true if sweep.subject == *subject => Ok(sweep),
        true => Err(format!(
            "is a sweep of another scene, teacher or set of options of fit: {REMEDY}"
        )),
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
        let mut state = open(None).expect("new");
        state.add(vec![luma("base", 3.0, 24.0)], Some("llvmpipe".to_owned()));
        let odd = SweepPoint {
            settings: luma("rounds-3", 1.0, 1.0).settings,
            ..failed("rounds-3", "no memory")
        };
        state.add(vec![odd], None);
        assert_eq!((state.sweep.limit(), state.sweep.spent()), (12.0, 4.0));
        state.write().expect("written");
        let refusal = open(None).err().expect("refused").to_string();
        assert!(refusal.contains("is writing into it"), "{refusal}");
        let before = state.sweep.points.clone();
        drop(state);
        let mut again = open(Some(90.0)).expect("the same");
        assert_eq!(again.sweep.points, before);
        assert_eq!(again.sweep.device.as_deref(), Some("llvmpipe"));
        assert_eq!(again.sweep.limit(), 90.0);
        // A base that failed is tried again.
        again.sweep.points[0].failed = Some("no memory".to_owned());
        again.write().expect("written");
        drop(again);
        assert_eq!(open(None).expect("the same").sweep.points, before[1..]);
    }

    #[test]
    fn another_subject_is_refused_with_a_remedy() {
        let subject = sweep(Vec::new()).subject;
        let folder = tempfile::tempdir().expect("a folder");
        SweepState::open(folder.path(), subject.clone(), None)
            .and_then(|state| state.write())
            .expect("written");
        let changes: [fn(&mut Subject); 3] = [
            |s| s.scene.push('2'),
            |s| s.teacher = Some("/t".to_owned()),
            |s| s.options.clear(),
        ];
        let refused = |subject: Subject| {
            let opened = SweepState::open(folder.path(), subject, None);
            opened.err().expect("refused").to_string()
        };
        for change in changes {
            let mut other = subject.clone();
            change(&mut other);
            let error = refused(other);
            assert!(error.contains("another scene, teacher"), "{error}");
        }
        std::fs::write(folder.path().join(FILES[0]), "{").expect("written");
        let error = refused(subject);
        assert!(error.contains("damaged") && error.contains("-o"), "{error}");
    }
}
