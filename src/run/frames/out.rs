//! Output of colored photos: a folder or a film.

use std::path::{Path, PathBuf};

use super::shots::Shot;
use crate::{
    capture::Film,
    frames::Colored,
    run::RunError,
    store::{
        StoreError, files,
        film::{FilmWriter, Purpose, is_film},
    },
    tell::Observer,
};

/// Output of colored photos.
pub(super) enum FrameOutput {
    Folder(PathBuf),
    Film(Box<FilmWriter>),
}

impl FrameOutput {
    pub fn open(
        output: &Path,
        rate: [u32; 2],
        film: Option<&Film>,
        shots: &[Shot],
        observe: &mut Observer<'_>,
    ) -> Result<Self, StoreError> {
        if !is_film(output) {
            files::make_pictures_folder(output)?;
            for shot in shots {
                if let Some(folder) = output.join(&shot.output).parent() {
                    files::make_folder(folder)?;
                }
            }
            return Ok(Self::Folder(output.to_owned()));
        }
        files::make_folder_of(output)?;
        let writer = FilmWriter::new(output, rate, Purpose::Editing)?;
        Ok(Self::Film(Box::new(writer.sounding_like(film, observe))))
    }

    pub fn write(&mut self, shot: &Shot, colored: Colored) -> Result<(), RunError> {
        let written = match self {
            Self::Folder(folder) => files::write_colored(&folder.join(&shot.output), colored),
            Self::Film(film) => {
                (0..shot.repeats).try_for_each(|_| film.write_colored(&shot.name, &colored))
            }
        };
        Ok(written?)
    }

    pub fn finish(self, observe: &mut Observer<'_>) -> Result<(), StoreError> {
        match self {
            Self::Folder(_) => Ok(()),
            Self::Film(film) => film.finish(observe),
        }
    }
}
