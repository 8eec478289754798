//! The film of the path on the page of `eval`.

use std::{fs, path::Path};

use image::RgbImage;

use crate::{
    programs::ProgramError,
    report::{Flight, PathScore},
    store::{
        StoreError,
        film::{FilmWriter, Purpose},
    },
    tell::{Event, Observer},
};

/// Frames a second: slow enough to see what changes between two of them.
const RATE: u32 = 12;

/// Its file.
const FILM: &str = "flight.mp4";

/// Becomes a film where one can be made.
pub(super) struct FlightOutput {
    writer: Option<FilmWriter>,
    /// Error of the film's writer.
    failed: Option<String>,
}

impl FlightOutput {
    /// In the folder of a page.
    pub fn begin(page: &Path) -> Self {
        // Where nothing makes films, the page says so.
        let (writer, failed) = match FilmWriter::new(&page.join(FILM), [RATE, 1], Purpose::Viewing)
        {
            Ok(writer) => (Some(writer), None),
            Err(ProgramError::Missing { .. }) => (None, None),
            Err(error) => (None, Some(error.to_string())),
        };
        Self { writer, failed }
    }

    pub fn add(&mut self, name: &str, frame: &RgbImage) {
        if let Some(mut writer) = self.writer.take() {
            match writer.write(name, frame) {
                Ok(()) => self.writer = Some(writer),
                Err(error) => self.failed = Some(reason(error)),
            }
        }
    }

    /// Finishes the path's part of the page in this folder: a film if one could be made, else its
    /// frames.
    pub fn end(mut self, page: &Path, path: &PathScore, observe: &mut Observer<'_>) -> Flight {
        let made = self.writer.take().is_some_and(|writer| {
            let ended = writer.finish(observe);
            self.failed = ended.err().map(reason);
            self.failed.is_none() && page.join(FILM).is_file()
        });
        if let Some(reason) = self.failed {
            observe(Event::Warning(format!("no film of the path: {reason}")));
        }
        let film = made.then(|| FILM.to_owned());
        let bytes_of = |name: &str| fs::metadata(page.join(name)).map_or(0, |file| file.len());
        let of_frames = || (0..path.frames).map(|k| bytes_of(&format!("frame-{k:04}.png")));
        Flight {
            frames: path.frames,
            size: path.size,
            rate: RATE,
            bytes: match &film {
                Some(film) => bytes_of(film),
                None => of_frames().sum(),
            },
            film,
        }
    }
}

/// Reason of an error, without the path of the temporary file.
fn reason(error: StoreError) -> String {
    match error {
        StoreError::File { reason, .. } => reason,
        other => other.to_string(),
    }
}
