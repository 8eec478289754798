//! One film of several, one behind the other.

use std::{fmt::Write, path::PathBuf};

use super::{FilmWriter, Sound, in_container};
use crate::{
    capture::Film,
    disk,
    programs::{FFMPEG, Program},
    store::{StoreError, files},
    tell::{Event, Observer},
};

/// A film, and for how many seconds it is shown.
pub(crate) struct Piece {
    pub path: PathBuf,
    pub seconds: f64,
}

impl FilmWriter {
    /// Joins films that were written alike, without coding them again, under the sound of `film`.
    ///
    /// # Errors
    /// [`StoreError`] where ffmpeg fails, or the film cannot be written.
    pub fn join(
        self,
        pieces: &[Piece],
        film: &Film,
        observe: &mut Observer<'_>,
    ) -> Result<(), StoreError> {
        let mut list = String::from("ffconcat version 1.0\n");
        for piece in pieces {
            let path = std::path::absolute(&piece.path).map_err(files::at(&piece.path))?;
            let quoted = path.display().to_string().replace('\'', r"'\''");
            let _ = write!(
                list,
                "file 'file:{quoted}'\nduration {:.6}\n",
                piece.seconds
            );
        }
        let folder = disk::create_folder("gs-chroma-", &std::env::temp_dir());
        let folder = folder.map_err(files::at(&std::env::temp_dir()))?;
        let named = folder.path().join("list.txt");
        files::write(&named, list.as_bytes())?;
        let draft = disk::create(&self.path).map_err(files::at(&self.path))?;
        let ffmpeg = Program::new(FFMPEG)
            .args(["-hide_banner", "-nostats", "-loglevel", "error", "-y"])
            .args(["-f", "concat", "-safe", "0", "-protocol_whitelist", "file"])
            .option("-i", named)
            .args(["-map", "0:v:0", "-c", "copy"]);
        let joined = in_container(ffmpeg, self.container())
            .arg(draft.path())
            .ask();
        joined.map_err(|error| self.failed(&error))?;
        let mut tell = |line| observe(Event::Warning(line));
        let sounding = Sound::of(film, self.container(), false, &mut tell).and_then(|sound| {
            let another = || disk::create(&self.path).map_err(|error| error.to_string());
            sound.under(draft.path(), self.container(), &another, &mut tell)
        });
        let whole = sounding.unwrap_or(draft);
        whole.persist(&self.path).map_err(files::at(&self.path))
    }
}
