//! Other programs' results that `eval` measures beside the scene.

use std::{path::PathBuf, sync::Arc};

use super::RunError;
use crate::{
    capture::{Camera, Dataset},
    eval::{Source, frames_in},
    gpu::Gpu,
    raster::{Raster, RasterOptions},
    report::Method,
    splats::{Splats, is_splat_file},
    subject::{
        foreign::drawn_like_photos,
        scene::{Frame, read_splats},
    },
    tell::Observer,
};

/// Result of another program.
pub(super) enum Against {
    /// Splats of its own, of this file, and what draws them.
    Splats(PathBuf, Box<Splats>, RasterOptions),
    /// Files of the path's frames, in its order.
    Frames(Vec<PathBuf>),
}

impl Against {
    /// Opens all that are named: splat files, and folders of the frames of a path.
    ///
    /// # Errors
    /// [`RunError::NameTaken`], and those of files that do not fit.
    pub fn open_all(
        named: &[(String, PathBuf)],
        dataset: &Dataset,
        path: &[Camera],
        observe: &mut Observer<'_>,
    ) -> Result<Vec<(Method, Self)>, RunError> {
        let mut opened: Vec<(Method, Self)> = Vec::new();
        for (name, from) in named {
            // File names may not tell upper case from lower.
            let is_taken = |(other, _): &(Method, Self)| other.name().eq_ignore_ascii_case(name);
            let method = Method::other(name).filter(|_| !opened.iter().any(is_taken));
            let method = method.ok_or_else(|| RunError::NameTaken(name.clone()))?;
            let read = if !is_splat_file(from)? && from.is_dir() {
                Self::Frames(frames_in(from, path)?)
            } else {
                let frame = Frame::World(dataset.capture.offset);
                let (splats, drawn) = read_splats(from, frame, observe)?;
                Self::Splats(from.clone(), Box::new(splats), drawn)
            };
            opened.push((method, read));
        }
        Ok(opened)
    }

    /// The source of its pictures; splats are drawn as they match the photos best.
    pub fn source(
        &self,
        gpu: &Gpu,
        dataset: &Dataset,
        observe: &mut Observer<'_>,
    ) -> Result<Source<'_>, RunError> {
        Ok(match self {
            Self::Frames(files) => Source::Frames(files),
            Self::Splats(file, splats, said) => {
                let luma = splats.to_luma();
                let drawn = drawn_like_photos(gpu, dataset, (file, &luma), *said, observe)?;
                Source::Splats(splats, Arc::new(Raster::with(gpu, drawn)))
            }
        })
    }
}
