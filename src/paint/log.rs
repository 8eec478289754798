//! Record of what was painted when: a line of JSON for each stroke.

use std::{
    io::{Read, Seek, SeekFrom, Write},
    path::{Path, PathBuf},
    time::{SystemTime, UNIX_EPOCH},
};

use serde::{Deserialize, Serialize};

use super::layer::Region;
use crate::{
    disk, input,
    store::{StoreError, files},
};

/// Colors of the palette at most.
const PALETTE: usize = 24;

/// What somebody did.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Act {
    /// Painted.
    Paint,
    /// Painted what the teachers want.
    Keep,
    /// Took paint away.
    Erase,
    /// Took back what was done last.
    Undo,
    /// Did again what was taken back.
    Redo,
}

/// A line of the log.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Entry {
    /// Seconds since 1970, UTC.
    pub time: u64,
    pub act: Act,
    /// sRGB of the paint.
    pub color: Option<[u8; 3]>,
    /// Parts of layers that changed; none of what is undone or done again.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub parts: Vec<Part>,
}

/// Part of a photo's layer that changed.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Part {
    /// The photo's name.
    pub photo: String,
    pub region: Region,
    /// What was there, as PNG in base64; `None` where nothing was.
    pub before: Option<String>,
}

/// `log.jsonl`.
#[derive(Debug)]
pub struct Log {
    path: PathBuf,
    /// Colors painted with, the last first.
    pub palette: Vec<[u8; 3]>,
    /// Changes that are not undone, in order.
    pub done: Vec<Vec<Part>>,
}

impl Log {
    /// The log at a path; lines that cannot be read, as a crash leaves them, are passed over.
    pub fn open(path: &Path) -> Self {
        let mut log = Self {
            path: path.to_owned(),
            palette: Vec::new(),
            done: Vec::new(),
        };
        let text = input::read_to_string(path).unwrap_or_default();
        let mut undone = Vec::new();
        let entries = text.lines().map(serde_json::from_str::<Entry>);
        for entry in entries.filter_map(Result::ok) {
            log.learn(&entry);
            match entry.act {
                Act::Undo => undone.extend(log.done.pop()),
                Act::Redo => log.done.extend(undone.pop()),
                _ => {
                    undone.clear();
                    log.done.push(entry.parts);
                }
            }
        }
        log
    }

    fn learn(&mut self, entry: &Entry) {
        let Some(color) = entry.color else { return };
        self.palette.retain(|known| *known != color);
        self.palette.insert(0, color);
        self.palette.truncate(PALETTE);
    }

    /// Adds a line, now.
    ///
    /// # Errors
    /// [`StoreError::File`] where it cannot be written.
    pub fn add(
        &mut self,
        act: Act,
        color: Option<[u8; 3]>,
        parts: Vec<Part>,
    ) -> Result<(), StoreError> {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        let entry = Entry {
            time: since.map_or(0, |since| since.as_secs()),
            act,
            color,
            parts,
        };
        // Plain structs: serializing them cannot fail.
        let line = serde_json::to_string(&entry).unwrap_or_default();
        let append = || {
            let mut file = disk::open_in_place(&self.path)?;
            let end = file.seek(SeekFrom::End(0))?;
            let mut last = [b'\n'];
            if end > 0 {
                file.seek(SeekFrom::End(-1))?;
                file.read_exact(&mut last)?;
            }
            disk::step()?;
            // Behind a line that was cut off begins a new one.
            let cut_off = if last == [b'\n'] { "" } else { "\n" };
            file.write_all(format!("{cut_off}{line}\n").as_bytes())
        };
        append().map_err(files::at(&self.path))?;
        self.learn(&entry);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn part(photo: &str) -> Vec<Part> {
        vec![Part {
            photo: photo.to_owned(),
            region: [0, 1, 2, 3],
            before: None,
        }]
    }

    #[test]
    fn the_palette_is_that_of_the_strokes_and_cut_off_lines_do_no_harm() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("log.jsonl");
        let mut log = Log::open(&path);
        for color in [Some([1, 2, 3]), Some([4, 5, 6]), None, Some([1, 2, 3])] {
            let act = color.map_or(Act::Erase, |_| Act::Paint);
            log.add(act, color, part("a.jpg")).unwrap();
        }
        let text = input::read_to_string(&path).unwrap();
        assert_eq!(text.lines().count(), 4);
        let first: Entry = serde_json::from_str(text.lines().next().unwrap()).unwrap();
        assert_eq!((first.act, first.parts), (Act::Paint, part("a.jpg")));
        std::fs::write(&path, text + "{\"time\": 17").unwrap();
        let mut again = Log::open(&path);
        assert_eq!(again.palette, [[1, 2, 3], [4, 5, 6]]);
        again.add(Act::Paint, Some([7; 3]), part("b.jpg")).unwrap();
        assert_eq!(Log::open(&path).palette, [[7; 3], [1, 2, 3], [4, 5, 6]]);
    }

    #[test]
    fn what_is_undone_is_not_among_what_is_done() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("log.jsonl");
        let mut log = Log::open(&path);
        for (act, photo) in [
            (Act::Paint, "a"),
            (Act::Keep, "b"),
            (Act::Undo, ""),
            (Act::Undo, ""),
            (Act::Redo, ""),
            (Act::Erase, "c"),
            (Act::Redo, ""),
        ] {
            let parts = if photo.is_empty() {
                Vec::new()
            } else {
                part(photo)
            };
            log.add(act, None, parts).unwrap();
        }
        assert_eq!(Log::open(&path).done, [part("a"), part("c")]);
    }
}
