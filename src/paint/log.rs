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
    /// The photo's name.
    pub photo: String,
    pub act: Act,
    /// sRGB of the paint.
    pub color: Option<[u8; 3]>,
    /// Part of the layer that changed.
    pub region: Region,
}

/// `log.jsonl`.
#[derive(Debug)]
pub struct Log {
    path: PathBuf,
    /// Colors painted with, the last first.
    pub palette: Vec<[u8; 3]>,
}

impl Log {
    /// The log at a path; lines that cannot be read, as a crash leaves them, are passed over.
    pub fn open(path: &Path) -> Self {
        let mut log = Self {
            path: path.to_owned(),
            palette: Vec::new(),
        };
        let text = input::read_to_string(path).unwrap_or_default();
        for entry in text
            .lines()
            .filter_map(|line| serde_json::from_str(line).ok())
        {
            log.learn(&entry);
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
        photo: &str,
        color: Option<[u8; 3]>,
        region: Region,
    ) -> Result<(), StoreError> {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        let entry = Entry {
            time: since.map_or(0, |since| since.as_secs()),
            photo: photo.to_owned(),
            act,
            color,
            region,
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

    #[test]
    fn the_palette_is_that_of_the_strokes_and_cut_off_lines_do_no_harm() {
        let place = tempfile::tempdir().unwrap();
        let path = place.path().join("log.jsonl");
        let mut log = Log::open(&path);
        for color in [Some([1, 2, 3]), Some([4, 5, 6]), None, Some([1, 2, 3])] {
            let act = color.map_or(Act::Erase, |_| Act::Paint);
            log.add(act, "a.jpg", color, [0, 1, 2, 3]).unwrap();
        }
        let text = input::read_to_string(&path).unwrap();
        assert_eq!(text.lines().count(), 4);
        let first: Entry = serde_json::from_str(text.lines().next().unwrap()).unwrap();
        assert_eq!((first.act, first.region), (Act::Paint, [0, 1, 2, 3]));
        std::fs::write(&path, text + "{\"time\": 17").unwrap();
        let mut again = Log::open(&path);
        assert_eq!(again.palette, [[1, 2, 3], [4, 5, 6]]);
        again
            .add(Act::Paint, "b.jpg", Some([7; 3]), [0; 4])
            .unwrap();
        assert_eq!(Log::open(&path).palette, [[7; 3], [1, 2, 3], [4, 5, 6]]);
    }
}
