//! Files that no command writes over: photos, masks, hints, films, scenes that were named, and a
//! run's own files, which commands replace together or not at all.

use std::{
    collections::HashMap,
    fs,
    path::{Path, PathBuf},
};

use serde_json::Value;

use super::{RunFolder, entries::ENTRIES};
use crate::{
    capture::{self, FRAMES, Film, MaskSource},
    disk::{
        self,
        trust::{FileId, Originals},
    },
    input,
    report::Report,
};

/// Files and folders that are looked at for one path: a record of somebody else may name the
/// root of all.
const MOST: usize = 100_000;

/// Originals of a command, each by its file.
#[derive(Default)]
pub(crate) struct OriginalFiles(HashMap<FileId, &'static str>);

impl OriginalFiles {
    /// Adds a file, or the files below a folder, at most [`MOST`] in all. Missing paths add
    /// nothing, nor do folders that cannot be read. Numbered pictures are those of their folder.
    pub fn with(mut self, path: &Path, kind: &'static str) -> Self {
        let is_pattern = path.to_string_lossy().contains('%') && !path.exists();
        let path = if is_pattern {
            disk::folder_of(path)
        } else {
            path
        };
        let mut waiting = vec![path.to_owned()];
        let mut left = MOST;
        while let (Some(path), 1..) = (waiting.pop(), left) {
            left -= 1;
            if path.is_dir() {
                let entries = fs::read_dir(&path).into_iter().flatten().flatten();
                // A linked folder may lead in a circle.
                let entries = entries.map(|entry| entry.path());
                waiting.extend(entries.filter(|path| !(path.is_symlink() && path.is_dir())));
            } else if let Some(id) = FileId::of(&path) {
                self.0.entry(id).or_insert(kind);
            }
        }
        self
    }

    /// Adds several, see [`Self::with`].
    pub fn with_all<'a>(
        self,
        paths: impl IntoIterator<Item = &'a PathBuf>,
        kind: &'static str,
    ) -> Self {
        paths
            .into_iter()
            .fold(self, |kept, path| kept.with(path, kind))
    }

    /// Adds photos, masks, model and film of a COLMAP folder, and what it was prepared from.
    pub fn with_capture(self, root: &Path, masks: Option<&MaskSource>) -> Self {
        let mut kept = self
            .with_all(&capture::originals(root), "a photo or a file of its poses")
            .with(&root.join(FRAMES), "a frame of the film")
            .with(&root.join("masks"), "a mask");
        if let Some(MaskSource::Folder(folder)) = masks {
            kept = kept.with(folder, "a mask");
        }
        if let Ok(Some(film)) = Film::read(root) {
            kept = kept.with(&film.source, "the film that the photos come from");
        }
        let record = root.join("prepare.json");
        let record = input::read(&record).ok();
        let record = record.and_then(|text| serde_json::from_slice::<Value>(&text).ok());
        let source = record.as_ref().and_then(|record| record["input"].as_str());
        match source {
            Some(source) => kept.with(Path::new(source), "an original"),
            None => kept,
        }
    }

    /// Adds what a run was made from, its teachers and hints, and its own files.
    pub fn with_run(self, folder: &RunFolder, report: &Report) -> Self {
        let root = Path::new(&report.capture.path);
        let mut kept = self.with_capture(root, Some(&report.capture.load.masks));
        if let Some(chroma) = &report.chroma {
            let teachers = chroma.teachers.iter();
            let teachers = teachers.filter_map(|teacher| teacher.path.as_ref());
            let others = chroma.hint_folder.iter().chain(teachers);
            for path in others {
                kept = kept.with(Path::new(path), "a file of a teacher or a hint");
            }
        }
        // Checkpoints are written where they are.
        let own = ENTRIES
            .into_iter()
            .filter(|name| !name.starts_with("checkpoint"));
        own.fold(kept, |kept, name| {
            kept.with(&folder.path().join(name), "a file of the run")
        })
    }

    /// Keeps them as long as what is given back lives.
    pub fn keep(self) -> Originals {
        Originals::keep(self.0)
    }
}
