//! The steps of `auto`, and what each result was made from.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use crate::store::{StoreError, files};

/// File with the digest of each result's inputs.
const KEPT: &str = "auto.json";

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Step {
    /// Frames and poses.
    Prepare,
    /// The gray scene.
    Fit,
    /// Its colors.
    Colorize,
    /// The photos in color.
    Frames,
    /// A file for viewers.
    Export,
    /// Measurements and their page.
    Eval,
}

impl Step {
    /// All, in order.
    pub const ALL: [Self; 6] = [
        Self::Prepare,
        Self::Fit,
        Self::Colorize,
        Self::Frames,
        Self::Export,
        Self::Eval,
    ];

    /// The command that does it.
    pub fn command(self) -> &'static str {
        match self {
            Self::Prepare => "prepare",
            Self::Fit => "fit",
            Self::Colorize => "colorize",
            Self::Frames => "frames",
            Self::Export => "export",
            Self::Eval => "eval",
        }
    }
}

/// Digests of the inputs by step; a step that has only begun has `begun` behind its name.
pub(super) struct StepRecords {
    path: PathBuf,
    made: BTreeMap<String, String>,
}

impl StepRecords {
    pub fn read(folder: &Path) -> Result<Self, StoreError> {
        let path = folder.join(KEPT);
        let text = crate::input::read_to_string(&path);
        // What cannot be read is made anew.
        let made = text.ok().and_then(|text| serde_json::from_str(&text).ok());
        Ok(Self {
            path,
            made: made.unwrap_or_default(),
        })
    }

    /// Returns true if a step is due: its results are missing, or had other inputs.
    pub fn due(&self, step: Step, from: &str, results: &[&Path]) -> bool {
        let same = self
            .made
            .get(step.command())
            .is_some_and(|made| made == from);
        !(same && results.iter().all(|result| result.exists()))
    }

    /// Returns true if a step was begun from the same inputs and not ended.
    pub fn begun(&self, step: Step, from: &str) -> bool {
        let begun = self.made.get(&begun(step));
        begun.is_some_and(|begun| begun == from)
    }

    pub fn begin(&mut self, step: Step, from: &str) -> Result<(), StoreError> {
        self.made.insert(begun(step), from.to_owned());
        self.write()
    }

    pub fn done(&mut self, step: Step, from: &str) -> Result<(), StoreError> {
        self.made.remove(&begun(step));
        self.made.insert(step.command().to_owned(), from.to_owned());
        self.write()
    }

    fn write(&self) -> Result<(), StoreError> {
        let text = serde_json::to_string_pretty(&self.made).unwrap_or_default();
        files::write(&self.path, (text + "\n").as_bytes())
    }
}

fn begun(step: Step) -> String {
    format!("{} begun", step.command())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_due_unless_its_result_was_made_from_the_same() {
        let folder = tempfile::tempdir().expect("a folder");
        let result = folder.path().join("luma.ply");
        let mut kept = StepRecords::read(folder.path()).expect("nothing yet");
        assert!(kept.due(Step::Fit, "a", &[&result]));
        kept.begin(Step::Fit, "a").expect("writable");
        let again = StepRecords::read(folder.path()).expect("readable");
        assert!(again.begun(Step::Fit, "a") && !again.begun(Step::Fit, "b"));
        assert!(!again.begun(Step::Colorize, "a"));
        kept.done(Step::Fit, "a").expect("writable");
        let kept = StepRecords::read(folder.path()).expect("readable");
        assert!(!kept.begun(Step::Fit, "a"));
        // The result is missing, there, and there from something else.
        assert!(kept.due(Step::Fit, "a", &[&result]));
        std::fs::write(&result, "").expect("writable");
        assert!(!kept.due(Step::Fit, "a", &[&result]));
        assert!(kept.due(Step::Fit, "b", &[&result]));
        std::fs::write(folder.path().join(KEPT), "damaged").expect("writable");
        let kept = StepRecords::read(folder.path()).expect("nothing is known");
        assert!(kept.due(Step::Fit, "a", &[&result]));
    }
}
