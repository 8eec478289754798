//! A run's folder.

use std::{
    fs,
    path::{Path, PathBuf},
    time::SystemTime,
};

use serde::{Deserialize, Serialize};

use super::{
    commit,
    entries::{PAINT, TEACHER, check_links},
    files,
    fingerprint::hashed,
    lock::{RunLock, finish_what_is_left},
};
use crate::{
    input,
    report::Report,
    splats::{ShField, npy},
    store::StoreError,
};

/// The run in a folder of `auto`'s results.
pub(crate) const OF_AUTO: &str = "run";

/// Results of a film of several shots, below those of the whole: a folder for each shot.
pub(crate) const SHOTS_OF_AUTO: &str = "shots";

/// Default parent folder of runs.
const RUNS: &str = "runs";

/// The runs of a film's shots in a folder of `auto`'s results, in order.
fn runs_of_shots(folder: &Path) -> Vec<PathBuf> {
    let shots = fs::read_dir(folder.join(SHOTS_OF_AUTO));
    let shots = shots.into_iter().flatten().flatten();
    let runs = shots.map(|shot| shot.path().join(OF_AUTO));
    let mut runs: Vec<PathBuf> = runs
        .filter(|run| RunFolder::at(run).report().is_file())
        .collect();
    runs.sort();
    runs
}

/// The folder of one run; docs/run-folder.md lists what lies in it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RunFolder(PathBuf);

impl RunFolder {
    /// The folder at `path`.
    pub fn at(path: &Path) -> Self {
        Self(path.to_owned())
    }

    /// `runs/<name of the COLMAP folder>`.
    pub fn for_capture(colmap_dir: &Path) -> Self {
        let resolved = fs::canonicalize(colmap_dir).unwrap_or_else(|_| colmap_dir.to_owned());
        let name = resolved.file_name().unwrap_or("scene".as_ref());
        Self(Path::new(RUNS).join(name))
    }

    /// The run at `path`, or that of `auto`'s results there; the newest where none is named.
    ///
    /// # Errors
    /// [`StoreError::SeveralRuns`] of the results of several shots.
    pub fn find(path: Option<&Path>) -> Result<Self, StoreError> {
        let Some(path) = path else {
            return Self::newest();
        };
        let (named, below) = (Self::at(path), Self::at(&path.join(OF_AUTO)));
        match () {
            () if named.report().exists() => Ok(named),
            () if below.report().is_file() => Ok(below),
            () => match runs_of_shots(path) {
                runs if runs.is_empty() => Ok(named),
                runs => Err(StoreError::SeveralRuns {
                    folder: path.to_owned(),
                    runs,
                }),
            },
        }
    }

    /// The run under `runs/` whose report is newest.
    pub fn newest() -> Result<Self, StoreError> {
        let written = |path: &Path| -> Option<SystemTime> {
            fs::metadata(Self::at(path).report()).ok()?.modified().ok()
        };
        fs::read_dir(RUNS)
            .map_err(|_| StoreError::NoRun)?
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter_map(|path| Some((written(&path)?, path)))
            .max()
            .map(|(_, path)| Self(path))
            .ok_or(StoreError::NoRun)
    }

    /// The folder itself.
    pub fn path(&self) -> &Path {
        &self.0
    }

    /// Geometry and luma.
    pub fn luma(&self) -> PathBuf {
        self.0.join("luma.ply")
    }

    /// The colored scene.
    pub fn color(&self) -> PathBuf {
        self.0.join("color.ply")
    }

    /// The native a/b harmonics of the colored scene.
    pub fn chroma(&self) -> PathBuf {
        self.0.join("chroma.npy")
    }

    /// Results of `eval`.
    pub fn evaluation(&self) -> PathBuf {
        self.0.join("eval.json")
    }

    /// The page of `eval` with its pictures.
    pub fn evaluation_page(&self) -> PathBuf {
        self.0.join("eval")
    }

    /// Path of `report.json`.
    pub fn report(&self) -> PathBuf {
        self.0.join("report.json")
    }

    /// Checkpoint of an interrupted training.
    pub fn checkpoint(&self) -> PathBuf {
        self.0.join("checkpoint")
    }

    /// Checkpoint of an interrupted coloring.
    pub fn color_checkpoint(&self) -> PathBuf {
        self.0.join("checkpoint-color")
    }

    /// Path of `log.csv`.
    pub fn log(&self) -> PathBuf {
        self.0.join("log.csv")
    }

    /// The teacher's cached answers.
    pub fn teacher(&self) -> PathBuf {
        self.0.join(TEACHER)
    }

    /// Folder of what was painted on the photos.
    pub fn paint(&self) -> PathBuf {
        self.0.join(PAINT)
    }

    /// The painted strokes, named like the photos.
    pub fn hints(&self) -> PathBuf {
        self.paint().join("hints")
    }

    /// The strokes on a photo.
    pub fn hint(&self, photo: &str) -> PathBuf {
        self.hints().join(format!("{photo}.png"))
    }

    /// Record of what was painted when.
    pub fn paint_log(&self) -> PathBuf {
        self.paint().join("log.jsonl")
    }

    /// Photo, luma, teacher and color side by side.
    pub fn contact_sheet(&self) -> PathBuf {
        self.0.join("contact-sheet.png")
    }

    /// Picture of a view after so many iterations, where these are kept.
    pub fn album(&self, iteration: usize) -> PathBuf {
        self.0.join("album").join(format!("{iteration}.png"))
    }

    /// Makes the folder, see [`files::make_own_folder`].
    ///
    /// # Errors
    /// [`StoreError::File`] where it holds what belongs to no run.
    pub(crate) fn make(&self) -> Result<(), StoreError> {
        let begun = [".lock", "report.json", "checkpoint", "block.json"];
        // Who colors meanwhile may have begun before; a sweep's point has the last.
        let may = [TEACHER, "stderr.txt"];
        files::make_own_folder(&self.0, &begun, &may)
    }

    /// Takes the lock of a run that is there, and reads its report.
    pub(crate) fn lock(&self) -> Result<(RunLock, Report), StoreError> {
        // Only what is a run is locked; what its report says is read once nobody writes it.
        self.read_report()?;
        let lock = RunLock::take(&self.0)?;
        Ok((lock, self.read_report()?))
    }

    /// Lets nobody write into a run that is there as long as it is read, and reads its report.
    pub(crate) fn lock_to_read(&self) -> Result<(Option<RunLock>, Report), StoreError> {
        self.read_report()?;
        let lock = RunLock::shared(&self.0)?;
        Ok((lock, self.read_report()?))
    }

    /// Reads the report of a run whose files it describes.
    pub fn read_report(&self) -> Result<Report, StoreError> {
        let report = self.parse_report()?;
        self.check_files(&report)?;
        Ok(report)
    }

    /// Reads the report, whatever lies beside it.
    ///
    /// # Errors
    /// [`StoreError::File`] when there is none or it is damaged, and as [`check_links`].
    pub(crate) fn parse_report(&self) -> Result<Report, StoreError> {
        check_links(&self.0)?;
        finish_what_is_left(&self.0)?;
        let path = self.report();
        if self.0.is_file() {
            return Err(StoreError::file(
                &self.0,
                "is a file; name a run folder, as `gs-chroma fit` makes them",
            ));
        }
        let text = input::read_to_string(&path).map_err(|error| {
            StoreError::file(
                &path,
                format!("{error}: a run folder has a report; make one with `gs-chroma fit`"),
            )
        })?;
        serde_json::from_str(&text).map_err(|error| {
            StoreError::file(
                &path,
                format!("damaged ({error}): run `gs-chroma fit` again"),
            )
        })
    }

    /// Refuses scenes of another run in this one: those that its report does not describe.
    ///
    /// # Errors
    /// [`StoreError::OtherFile`], [`StoreError::InUse`], and [`StoreError::File`] where one cannot be
    /// read.
    pub(crate) fn check_files(&self, report: &Report) -> Result<(), StoreError> {
        // Reports of former versions describe none.
        if report.files.is_empty() {
            return Ok(());
        }
        let all = [self.luma(), self.color(), self.chroma()];
        for path in all.into_iter().filter(|path| path.exists()) {
            let known = report.files.iter().find(|file| path.ends_with(&file.name));
            let is_same = match known {
                None => false,
                Some(known) => {
                    let now = hashed(&path, Some([&known.stamp, &known.sha256]));
                    now.map_err(files::at(&path))?[1] == known.sha256
                }
            };
            match is_same {
                true => {}
                // Somebody is replacing them.
                false if commit::left(&self.0)?.is_some() => {
                    return Err(StoreError::InUse {
                        folder: self.0.clone(),
                        holder: "another process is writing into it".to_owned(),
                    });
                }
                false => return Err(StoreError::OtherFile(path)),
            }
        }
        Ok(())
    }

    /// Reads the native chroma of `count` Gaussians, CIELAB a and b; none where
    /// the run has no such file.
    ///
    /// # Errors
    /// [`StoreError::File`] when it is damaged or belongs to other Gaussians.
    pub fn read_chroma(&self, count: usize) -> Result<Option<ShField>, StoreError> {
        let path = self.chroma();
        if !path.exists() {
            return Ok(None);
        }
        let bytes = input::read(&path).map_err(files::at(&path))?;
        let field = npy::decode(&bytes, count, 2).map_err(|reason| {
            StoreError::file(&path, format!("{reason}: run `gs-chroma colorize` again"))
        })?;
        Ok(Some(field))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_of_auto_stand_for_their_run() {
        let place = tempfile::tempdir().expect("a folder");
        let out = place.path().join("out");
        let report = |run: &Path| {
            fs::create_dir_all(run).expect("a folder");
            fs::write(run.join("report.json"), "{}").expect("writable");
        };
        let found = || RunFolder::find(Some(&out));
        assert!(matches!(found(), Ok(run) if run.path() == out));
        // A shot without a scene has no run.
        fs::create_dir_all(out.join("shots/001")).expect("a folder");
        assert!(matches!(found(), Ok(run) if run.path() == out));
        let shots = ["003", "002"].map(|shot| out.join("shots").join(shot).join("run"));
        shots.iter().for_each(|run| report(run));
        let [third, second] = shots;
        let listed = [second, third];
        assert!(matches!(found(), Err(StoreError::SeveralRuns { runs, .. }) if runs == listed));
        report(&out.join("run"));
        assert!(matches!(found(), Ok(run) if run.path() == out.join("run")));
        report(&out);
        assert!(matches!(found(), Ok(run) if run.path() == out));
    }
}
