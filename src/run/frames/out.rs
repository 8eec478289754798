//! Output of colored photos: a folder or a film.

use std::path::{Path, PathBuf};

use super::shots::Shot;
use crate::{
    archive::{NumberedName, Timecode},
    capture::Film,
    frames::Colored,
    run::RunError,
    store::{
        Codec, StoreError, files,
        film::{FilmWriter, Purpose},
        formats::FrameFacts,
        is_film,
    },
    tell::Observer,
};

/// Output of colored photos.
pub(super) enum FrameOutput {
    Folder {
        path: PathBuf,
        codec: Codec,
        /// Of the first frame.
        facts: FrameFacts,
    },
    Film(Box<FilmWriter>),
}

impl FrameOutput {
    pub fn open(
        output: &Path,
        codec: Codec,
        rate: [u32; 2],
        film: Option<&Film>,
        shots: &[Shot],
        observe: &mut Observer<'_>,
    ) -> Result<Self, StoreError> {
        let timecode = film.and_then(timecode_of);
        if !is_film(output) {
            files::make_pictures_folder(output)?;
            for shot in shots {
                if let Some(folder) = output.join(&shot.output).parent() {
                    files::make_folder(folder)?;
                }
            }
            let signal = film.and_then(|film| film.signal.as_ref());
            return Ok(Self::Folder {
                path: output.to_owned(),
                codec,
                facts: FrameFacts {
                    timecode,
                    rate: film.map(|film| film.frame_rate),
                    dpx_transfer: signal.and_then(|signal| signal.dpx_transfer),
                },
            });
        }
        files::make_folder_of(output)?;
        let timecode = timecode.map(|code| code.at_rate(rate));
        let writer = FilmWriter::new(output, rate, Purpose::Editing)?;
        let writer = writer.coded(codec, timecode).like(film, observe);
        Ok(Self::Film(Box::new(writer)))
    }

    pub fn write(&mut self, shot: &Shot, colored: Colored) -> Result<(), RunError> {
        let written = match self {
            Self::Folder { path, codec, facts } => {
                let timecode = facts.timecode.map(|code| code.after(shot.index as u64));
                let facts = FrameFacts { timecode, ..*facts };
                files::write_colored(&path.join(&shot.output), colored, *codec, facts)
            }
            Self::Film(film) => {
                (0..shot.repeats).try_for_each(|_| film.write_colored(&shot.name, &colored))
            }
        };
        Ok(written?)
    }

    pub fn finish(self, observe: &mut Observer<'_>) -> Result<(), StoreError> {
        match self {
            Self::Folder { .. } => Ok(()),
            Self::Film(film) => film.finish(observe),
        }
    }
}

/// Time code of a film's first frame; none where the frames' times vary.
pub(super) fn timecode_of(film: &Film) -> Option<Timecode> {
    let text = film.signal.as_ref()?.timecode.as_ref()?;
    let code = Timecode::parse(text, film.frame_rate)?;
    film.times.is_none().then_some(code)
}

/// Names the pictures for their codec; those of numbered pictures as these were.
pub(super) fn name(shots: &mut [Shot], codec: Codec, film: Option<&Film>) {
    let extension = codec.extension();
    let signal = film.and_then(|film| film.signal.as_ref());
    let numbered = signal.and_then(|signal| {
        let name = NumberedName::parse(signal.names.as_ref()?)?;
        Some((name.with_extension(extension), signal.first))
    });
    for shot in shots {
        shot.output = match &numbered {
            Some((name, first)) => name.name(first + shot.index as u64),
            None => {
                let stem = shot.output.strip_suffix("png").unwrap_or(&shot.output);
                format!("{stem}{extension}")
            }
        };
    }
}
