//! Shared access to a capture: its photos, and splats to start from.

use std::path::Path;

use glam::DVec3;

use super::SubjectError;
use crate::{
    capture::{Dataset, LoadOptions, Notice, Rejected},
    luma::TrialProgress,
    raster::RasterOptions,
    splats::{self, ReadSplats, Splats, WriteOptions},
    tell::{Event, Observer, Stage},
};

/// Opens a COLMAP folder; nothing is decoded but what [`Dataset::open`] has to.
pub(crate) fn open(
    colmap_dir: &Path,
    options: &LoadOptions,
    observe: &mut Observer<'_>,
) -> Result<Dataset, SubjectError> {
    Ok(Dataset::open(colmap_dir, options, &mut |notice| {
        observe(match notice {
            Notice::Doubt(doubt) => Event::Warning(doubt.to_owned()),
            Notice::LeftOut(Rejected { name, reason }) => {
                Event::Warning(format!("left out {name}: {reason}"))
            }
            Notice::Sampled { done, total, name } => {
                Event::progress(Stage::Survey, done, total, name)
            }
            Notice::Normalized([low, high]) => Event::Note(format!(
                "photos are normalized: {low:.6} becomes black, {high:.6} white (normalization can be turned off)"
            )),
        });
    })?)
}

pub(crate) fn of_trial(progress: &TrialProgress) -> Event {
    let message = match progress.effect {
        Some(effect) => format!("with {effect}"),
        None => "without effects in doubt".to_owned(),
    };
    Event::progress(Stage::Trial, progress.done, progress.total, message)
}

pub(crate) fn tell_not_finite(dataset: &Dataset, observe: &mut Observer<'_>) {
    let count = dataset.not_finite();
    if count > 0 {
        observe(Event::Warning(format!(
            "{count} pixels of the photos are not finite and do not count"
        )));
    }
}

/// Tells what was done to a splat file on reading, and what of it is not used.
pub(crate) fn tell_skipped(path: &Path, read: &ReadSplats, observe: &mut Observer<'_>) {
    let (path, skipped, surplus) = (path.display(), read.skipped, read.surplus);
    for note in &read.notes {
        observe(Event::Note(format!("{path}: {note}")));
    }
    for doubt in &read.doubts {
        observe(Event::Warning(format!("{path}: {doubt}")));
    }
    if skipped > 0 {
        observe(Event::Warning(format!(
            "{path}: skipped {skipped} Gaussians with values that are not finite or no rotation"
        )));
    }
    if surplus > 0 {
        observe(Event::Warning(format!(
            "{path}: {surplus} bytes follow the {} Gaussians that the header announces, and are not read: its count may be too small",
            read.splats.len() + skipped
        )));
    }
}

/// A splat file as a scene.
pub(crate) struct ReadScene {
    pub splats: Splats,
    /// Raster options from the file.
    pub drawn: RasterOptions,
    /// Offset subtracted from its centers according to its header, in world units.
    pub offset: DVec3,
}

/// Coordinate frame of Gaussians.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Frame {
    /// COLMAP's, less this, in world units.
    World(DVec3),
    /// Their run's, as its own files have them.
    Own,
}

/// Reads a splat file that has at least one Gaussian and moves it to a frame.
pub(crate) fn read_scene(
    path: &Path,
    frame: Frame,
    observe: &mut Observer<'_>,
) -> Result<ReadScene, SubjectError> {
    let read = splats::read_splats(path)?;
    tell_skipped(path, &read, observe);
    let mut splats = read.splats;
    if splats.is_empty() {
        return Err(SubjectError::NoSplats(path.to_owned()));
    }
    let by = match frame {
        Frame::World(offset) => read.offset - offset,
        Frame::Own => DVec3::ZERO,
    };
    if by != DVec3::ZERO {
        for mean in &mut splats.means {
            *mean = (DVec3::from(mean.map(f64::from)) + by).as_vec3().to_array();
        }
    }
    Ok(ReadScene {
        splats,
        drawn: RasterOptions {
            antialiased: read.antialiased,
            ..RasterOptions::default()
        },
        offset: read.offset,
    })
}

/// [`read_scene`] for whoever writes no such file.
pub(crate) fn read_splats(
    path: &Path,
    frame: Frame,
    observe: &mut Observer<'_>,
) -> Result<(Splats, RasterOptions), SubjectError> {
    let scene = read_scene(path, frame, observe)?;
    Ok((scene.splats, scene.drawn))
}

/// Write options of splats whose centers are COLMAP's less `offset`, in world units.
pub(crate) fn written_as(drawn: RasterOptions, offset: DVec3) -> WriteOptions {
    WriteOptions {
        generator: format!("gs-chroma {}", env!("CARGO_PKG_VERSION")),
        antialiased: drawn.antialiased,
        offset,
        ..WriteOptions::default()
    }
}
