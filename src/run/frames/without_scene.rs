//! Frames of a shot that has no scene: gray, or in the teacher's colors.

use std::path::PathBuf;

use super::{out::FrameOutput, shots::Shot};
use crate::{
    capture::{CaptureError, FRAMES, Film, LoadOptions, Loader, Normalize},
    chroma::teacher::{AbImage, TeacherSettings},
    frames::{Canvas, Steadied, finish},
    run::{
        RunError,
        teach::{TeachOptions, Teachers},
    },
    store::Codec,
    tell::{Event, Observer, Stage},
};

/// Longer side in pixels at which the teacher colors frames.
const SIDE: u32 = 512;

/// Options of [`frames_without_scene`].
pub(crate) struct PlainFramesOptions {
    /// Folder of the shot, with `film.json` and `frames/`.
    pub capture: PathBuf,
    /// Channel and tone of the frames.
    pub load: LoadOptions,
    /// The teacher; the frames stay gray without one.
    pub teacher: Option<(PathBuf, TeacherSettings)>,
    /// A folder for pictures, or a film by its extension.
    pub output: PathBuf,
    /// Codec of the film or the pictures; by default by the output's extension and the source.
    pub codec: Option<Codec>,
    /// Frames a second of a film.
    pub frame_rate: Option<[u32; 2]>,
}

/// Writes the frames of a shot whose scene could not be found, and says how many there are. The
/// teacher's colors are steadied along the optical flow.
///
/// # Errors
/// [`RunError`] of the frames, the teacher and the output.
pub(crate) fn frames_without_scene(
    options: &PlainFramesOptions,
    observe: &mut Observer<'_>,
) -> Result<usize, RunError> {
    let film = Film::read(&options.capture)?.ok_or_else(|| CaptureError::Read {
        path: options.capture.join("film.json"),
        source: std::io::ErrorKind::NotFound.into(),
    })?;
    let rate = options.frame_rate.unwrap_or(film.frame_rate);
    let codec = Codec::of(&options.output, options.codec, film.signal.as_ref())?;
    let shots: Vec<Shot> = (film.frames.iter().zip(film.repeats(rate)).enumerate())
        .map(|(index, (name, repeats))| Shot {
            index,
            name: name.clone(),
            path: options.capture.join(FRAMES).join(name),
            views: 0..0,
            output: name.clone(),
            repeats,
        })
        .collect();
    let mut teachers = match &options.teacher {
        Some((path, settings)) => {
            let teach = TeachOptions {
                teachers: vec![(path.clone(), 1.0)],
                settings: settings.clone(),
                ..TeachOptions::default()
            };
            Some(Teachers::open(&teach, &options.capture, None)?)
        }
        None => None,
    };
    let loader = Loader::new(options.load.clone());
    let to = &options.output;
    let mut out = FrameOutput::open(to, codec, rate, Some(&film), &shots, observe)?;
    let mut steadied = Steadied::default();
    for (i, shot) in shots.iter().enumerate() {
        observe(Event::progress(
            Stage::Coloring,
            i,
            shots.len(),
            &*shot.name,
        ));
        let original = loader.unplaced(&shot.path, Normalize::Off)?;
        let canvas = Canvas::of(&original, SIDE);
        let answer = match &mut teachers {
            Some(teachers) => teachers.color(canvas.query(&shot.name), canvas.gray_image())?,
            None => None,
        };
        let answer = answer.map(|AbImage { ab, .. }| ab);
        let Some(answer) = answer else {
            let gray = vec![[0.0; 2]; canvas.len()];
            out.write(shot, finish(&original, &canvas, gray))?;
            continue;
        };
        let (canvas, colors) = steadied.next(canvas, answer);
        out.write(shot, finish(&original, canvas, colors.clone()))?;
    }
    observe(Event::progress(
        Stage::Coloring,
        shots.len(),
        shots.len(),
        "",
    ));
    out.finish(observe)?;
    Ok(shots.len())
}
