//! `prepare`: from a film or a folder of photos to what `fit` takes, by way of FFmpeg and COLMAP.
//!
//! Each step leaves its result in the output folder, or nothing: `frames/` and `film.json`,
//! `images/`, `masks/`, `stretched/`, `database.db`, `sparse/`. A step whose result was made from
//! the same before is skipped.

mod borders;
mod colmap;
mod color_tags;
mod database;
mod error;
mod ffmpeg;
mod film;
mod frame_times;
mod masks;
mod motion;
mod numbered;
mod options;
mod panorama;
mod photos;
mod poses;
pub(crate) mod pycolmap;
mod rotations;
mod scan;
mod sharp;
mod shots;
mod signal;
mod state;

use std::{
    cell::RefCell,
    fs,
    path::{self, Path, PathBuf},
};

use serde::Serialize;

pub use error::PrepareError;
pub(crate) use film::{FilmShots, film_shots, span};
pub use motion::{CameraMotion, Motion};
pub use options::{Cameras, Matching, PrepareOptions};
pub use poses::Poses;
pub(crate) use state::{digest, of as digest_of};

use crate::{
    capture::{CaptureError, Film, IMAGES, photo_header},
    programs::Pictures,
    store::files,
    tell::{Event, Observer, Stage, count, keeping},
};
use colmap::Colmap;
use ffmpeg::FilmSource;
use masks::Sources;
use options::{MASKS, SPARSE, STRETCHED};
use photos::Photos;
use state::{OutputState, Step, of};

/// More photos are not matched each with each: that takes hours on a processor.
const EXHAUSTIVE: usize = 200;

/// Result of `prepare`.
#[derive(Clone, Debug, Serialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Prepared {
    /// The folder, as it was named.
    pub folder: PathBuf,
    /// Content of `film.json`; `None` where photos are no frames.
    pub film: Option<Film>,
    /// From when to when each shot lasts, in seconds; empty if unknown.
    ///
    /// They are looked for in a film whose part is not named.
    pub shots: Vec<[f64; 2]>,
    /// Photos that COLMAP was given.
    pub photos: usize,
    /// Photos that have a mask.
    pub masked: usize,
    /// The COLMAP that found the poses.
    pub colmap: String,
    /// The camera's motion; `None` where no photos match, or more than 300.
    pub motion: Option<Motion>,
    /// Poses and points.
    pub poses: Poses,
    /// All that is doubtful.
    pub warnings: Vec<String>,
}

/// Makes of a film or a folder of photos what `fit` takes; what was made from the same before
/// stays.
///
/// # Errors
/// [`PrepareError`].
pub fn prepare(
    options: &PrepareOptions,
    observe: &mut Observer<'_>,
) -> Result<Prepared, PrepareError> {
    let warnings = RefCell::default();
    let observe = &mut keeping(&warnings, observe);
    let (input, pictures) = input_of(options, observe)?;
    let output = path::absolute(&options.output).map_err(files::at(&options.output))?;
    let is_film = pictures.is_some() || check_input(&options.input, &input)?;
    if let Some(pictures) = &pictures {
        check_apart(options, &pictures.folder, &output)?;
    } else if !is_film {
        check_apart(options, &input, &output)?;
        check_film_options(options)?;
    } else if options.frame_rate.is_some() {
        let reason =
            "is a film with a frame rate of its own; one can be given to numbered pictures";
        return Err(PrepareError::at(&options.input, reason));
    }
    check_masks(options)?;
    let source = match is_film {
        true => Some(film::probe(&input, pictures)?),
        false => None,
    };
    let lens = match &source {
        Some(source) => source.color_tags.lens(&options.lens, observe),
        None => options.lens.clone(),
    };
    let colmap = Colmap::find(&lens, options.install, &mut |line| {
        observe(Event::Note(line));
    })?;
    let mut state = OutputState::open(&output, &input, options)?;
    let made = make(
        &mut state,
        options,
        source.as_ref(),
        (&lens, &colmap),
        observe,
    );
    if made.is_err() {
        // The error is what is told.
        let _ = state.fail();
    }
    made.map(|made| Prepared {
        warnings: warnings.take(),
        ..made
    })
}

/// The input's path, absolute, and the numbered pictures that it names.
fn input_of(
    options: &PrepareOptions,
    observe: &mut Observer<'_>,
) -> Result<(PathBuf, Option<Pictures>), PrepareError> {
    let pictures = numbered::find(options, observe)?;
    let input = match &pictures {
        Some(Pictures { folder, names, .. }) => folder.join(names),
        None => fs::canonicalize(&options.input).map_err(files::at(&options.input))?,
    };
    Ok((input, pictures))
}

/// Makes only the frames of a film's shot: `frames/`, `film.json` and `images/`.
///
/// # Errors
/// [`PrepareError`].
pub(crate) fn prepare_frames(
    options: &PrepareOptions,
    observe: &mut Observer<'_>,
) -> Result<(), PrepareError> {
    let (input, pictures) = input_of(options, observe)?;
    let output = path::absolute(&options.output).map_err(files::at(&options.output))?;
    let source = film::probe(&input, pictures)?;
    let mut state = OutputState::open(&output, &input, options)?;
    film::frames(&mut state, options, &source, observe).map(drop)
}

/// Does every step whose result is not there.
fn make(
    state: &mut OutputState,
    options: &PrepareOptions,
    source: Option<&FilmSource>,
    (lens, colmap): (&str, &Colmap),
    observe: &mut Observer<'_>,
) -> Result<Prepared, PrepareError> {
    let is_film = source.is_some();
    let mut shots = Vec::new();
    match source {
        Some(source) => shots = film::frames(state, options, source, observe)?,
        None => link_photos(state, options, observe)?,
    }
    let images = state.path(IMAGES);
    let photos = Photos::of(&images)?;
    if photos.headers.len() < 2 {
        return Err(PrepareError::TooFew {
            input: options.input.clone(),
            found: photos.headers.len(),
        });
    }
    let masked = make_masks(state, options, &photos, observe)?;
    let seen = stretch(state, &photos, observe)?;
    let matching = matching(options, is_film, &photos, observe);
    let task = poses::Task {
        photos: &photos,
        seen: &seen,
        masks: (masked > 0).then(|| state.path(MASKS)),
        cameras: cameras(options, is_film, &photos),
        lens,
        matching,
        motion: options.camera,
        is_film,
    };
    let (motion, poses) = task.find(state, colmap, observe)?;
    Ok(Prepared {
        folder: options.output.clone(),
        film: Film::read(&state.path("."))?,
        shots,
        photos: photos.headers.len(),
        masked,
        colmap: colmap.name(),
        motion,
        poses,
        warnings: Vec::new(),
    })
}

/// Returns true if the input is a film, false if it is a folder.
fn check_input(named: &Path, input: &Path) -> Result<bool, PrepareError> {
    if input.to_str().is_none() {
        let reason = "its path is no UTF-8; rename it";
        return Err(PrepareError::at(named, reason));
    }
    if input.is_dir() {
        return Ok(false);
    }
    // A pipe or a device is refused.
    crate::input::open(input).map_err(files::at(named))?;
    match photo_header(input) {
        Ok(_) => Err(PrepareError::at(
            named,
            "is a photo; name the folder that holds it and others",
        )),
        Err(_) => Ok(true),
    }
}

/// Refuses to write among the photos.
fn check_apart(options: &PrepareOptions, input: &Path, output: &Path) -> Result<(), PrepareError> {
    let output = fs::canonicalize(output).unwrap_or_else(|_| output.into());
    let own = [IMAGES, MASKS, STRETCHED, SPARSE].map(|name| output.join(name));
    if output.starts_with(input) || own.iter().any(|own| input.starts_with(own)) {
        let reason = format!(
            "would be mixed with the photos of {}; name a folder beside it with -o",
            options.input.display()
        );
        return Err(PrepareError::at(&options.output, reason));
    }
    Ok(())
}

/// Refuses for photos what is said about films.
fn check_film_options(options: &PrepareOptions) -> Result<(), PrepareError> {
    let rate = options.frame_rate.map(|[frames, _]| frames as usize);
    let of_shot = options.start.or(options.end).or(options.per_second);
    match of_shot.is_some() || options.shot.or(rate).is_some() {
        true => Err(PrepareError::at(
            &options.input,
            "is a folder of photos; start, end, shot and frames a second are for films",
        )),
        false => Ok(()),
    }
}

/// Refuses masks that are not there: better now than after hours of work.
fn check_masks(options: &PrepareOptions) -> Result<(), PrepareError> {
    if let Some(mask) = &options.mask {
        crate::input::open(mask).map_err(files::at(mask))?;
    }
    match &options.masks {
        Some(dir) if !dir.is_dir() => {
            let dir = dir.clone();
            Err(CaptureError::NoMaskFolder { dir }.into())
        }
        _ => Ok(()),
    }
}

/// Puts a folder's photos into `images/`.
fn link_photos(
    state: &mut OutputState,
    options: &PrepareOptions,
    observe: &mut Observer<'_>,
) -> Result<(), PrepareError> {
    let input = &fs::canonicalize(&options.input).map_err(files::at(&options.input))?;
    let from = of(&["photos", &digest(input)?]);
    if state.is_done(Step::Images, &from) {
        return Ok(());
    }
    state.check_own(IMAGES)?;
    let photos = Photos::of(input)?;
    if let [(first, reason), ..] = &photos.others[..] {
        observe(Event::Warning(format!(
            "left out {} of {} files that are no photos, such as {first}: {reason}",
            photos.others.len(),
            photos.others.len() + photos.headers.len(),
        )));
    }
    let draft = state.draft()?;
    let images = draft.path().join(IMAGES);
    crate::disk::make_folder(&images).map_err(files::at(&images))?;
    photos::link_all(photos.headers.keys().map(String::as_str), input, &images)?;
    state.place(Step::Images, &from, &[(images, IMAGES)])
}

/// Makes `masks/` where there is anything to mask; how many photos have one.
fn make_masks(
    state: &mut OutputState,
    options: &PrepareOptions,
    photos: &Photos,
    observe: &mut Observer<'_>,
) -> Result<usize, PrepareError> {
    let of_option = |path: &Option<PathBuf>| match path {
        Some(path) => digest(path),
        None => Ok(String::new()),
    };
    let images = state.path(IMAGES);
    let from = of(&[
        "masks",
        &digest(&images)?,
        &of_option(&options.mask)?,
        &of_option(&options.masks)?,
    ]);
    let folder = state.path(MASKS);
    // What the user has painted stays, unless other masks are named.
    let asked = options.mask.is_some() || options.masks.is_some();
    let painted = !asked && state.check_own(MASKS).is_err();
    if !(painted || state.is_done(Step::Masks, &from)) {
        state.check_own(MASKS)?;
        let borders = masks::borders(photos, &images, &mut |done, total| {
            count(observe, Stage::Masks, done, total);
        })?;
        if let Some(borders::Frame {
            left,
            right,
            top,
            bottom,
        }) = borders
        {
            observe(Event::Note(format!(
                "black borders are masked: left {left}, right {right}, top {top}, bottom {bottom} pixels"
            )));
        }
        let named = (options.masks.as_deref()).map(|dir| masks::named(dir, photos));
        let sources = Sources {
            borders,
            one: options.mask.clone(),
            each: named.transpose()?,
        };
        let draft = state.draft()?;
        let masks = draft.path().join(MASKS);
        crate::disk::make_folder(&masks).map_err(files::at(&masks))?;
        let made = sources.write(photos, &images, &masks, &mut |done, total| {
            count(observe, Stage::Masks, done, total);
        })?;
        if made.strays > 0 {
            observe(Event::Warning(format!(
                "{} masks belong to no photo; name them 0001.png.png for 0001.png",
                made.strays
            )));
        }
        match made.masked {
            0 => state.place(Step::Masks, &from, &[])?,
            _ => state.place(Step::Masks, &from, &[(masks, MASKS)])?,
        }
    }
    let names = photos.headers.keys();
    let masked = names.filter(|name| folder.join(format!("{name}.png")).is_file());
    Ok(masked.count())
}

/// The folder of what COLMAP looks at: the photos, or copies of 8 bits that fill their range.
fn stretch(
    state: &mut OutputState,
    photos: &Photos,
    observe: &mut Observer<'_>,
) -> Result<PathBuf, PrepareError> {
    let images = state.path(IMAGES);
    let from = of(&["stretched", &digest(&images)?]);
    let folder = state.path(STRETCHED);
    if !state.is_done(Step::Stretched, &from) {
        state.check_own(STRETCHED)?;
        match photos.stretch(&images)? {
            None => state.place(Step::Stretched, &from, &[])?,
            Some(range) => {
                let draft = state.draft()?;
                let made = draft.path().join(STRETCHED);
                photos::stretch_all(photos, &images, &made, range, &mut |done| {
                    count(observe, Stage::Photos, done, photos.headers.len());
                })?;
                state.place(Step::Stretched, &from, &[(made, STRETCHED)])?;
            }
        }
    }
    Ok(if folder.is_dir() { folder } else { images })
}

/// Pairs of photos to match.
fn matching(
    options: &PrepareOptions,
    is_film: bool,
    photos: &Photos,
    observe: &mut Observer<'_>,
) -> Matching {
    let many = photos.headers.len() > EXHAUSTIVE;
    match options.matching {
        Some(matching) => matching,
        None if is_film => Matching::Sequential,
        None if many => {
            observe(Event::Note(format!(
                "more than {EXHAUSTIVE} photos: matching neighbors by name; exhaustive matching takes all pairs"
            )));
            Matching::Sequential
        }
        None => Matching::Exhaustive,
    }
}

/// Photos that share a camera: where the sizes in a folder differ, each has its own.
fn cameras(options: &PrepareOptions, is_film: bool, photos: &Photos) -> Cameras {
    let of_one_size = photos.folders().values().all(|sizes| sizes.len() == 1);
    match options.cameras {
        Some(cameras) => cameras,
        None if is_film => Cameras::One,
        None if of_one_size => Cameras::Folder,
        None => Cameras::Photo,
    }
}
