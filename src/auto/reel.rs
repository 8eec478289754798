//! A whole film: each of its shots a scene of its own, and one film of all in color.
//!
//! `shots/001/` and so on hold what [`auto`](super::auto) makes of each shot. `shots.json` says
//! from when to when shots last; whoever corrects it and calls the same command again has only
//! those made anew that have changed.

use std::{path::Path, time::Instant};

use serde::{Deserialize, Serialize};
use serde_json::json;

use super::{
    AutoError, AutoEvent, AutoOptions, Step, StepRecords, Teller, auto,
    outcome::{Fallback, Outcome, Reel, ReelShot},
    page, teacher_digest,
};
use crate::{
    capture::Film,
    luma::LumaError,
    prepare::{
        FilmShots, PrepareError, PrepareOptions, digest, digest_of, film_shots, prepare_frames,
        span,
    },
    run::{PlainFramesOptions, RunError, frames_without_scene},
    store::{
        StoreError, files,
        film::{FilmWriter, Piece, Purpose},
        folder::SHOTS_OF_AUTO,
        originals,
    },
    subject::SubjectError,
    tell::Event,
};

/// File of the shots' times.
const SHOTS: &str = "shots.json";

/// Part of a frame by which times of frames may differ.
const SLACK: f64 = 0.5;

/// Content of [`SHOTS`].
#[derive(Serialize, Deserialize)]
struct Times {
    /// Digest of the film.
    film: String,
    shots: Vec<[f64; 2]>,
}

/// A part of the film: a shot, or what lies between two.
struct Part {
    span: [f64; 2],
    is_blank: bool,
}

/// The shots of a film that has more than one, unless a shot or a time is named; `None` if there
/// is nothing to go through.
///
/// # Errors
/// [`AutoError`]: the film cannot be read, or `shots.json` is damaged.
pub fn shots_of(
    options: &AutoOptions,
    tell: &mut Teller<'_>,
) -> Result<Option<FilmShots>, AutoError> {
    let PrepareOptions {
        input, start, shot, ..
    } = &options.prepare;
    // Numbered pictures are no file.
    if !input.is_file() || start.is_some() || shot.is_some() {
        return Ok(None);
    }
    let path = options.output.join(SHOTS);
    let film = digest(input)?;
    if let Some(times) = read_times(&path)?.filter(|times| times.film == film) {
        // Whoever joined all shots to one means that one.
        return Ok(Some(FilmShots {
            shots: times.shots,
            ..FilmShots::probe(input)?
        }));
    }
    tell(AutoEvent::Begins(Step::Prepare, Vec::new()));
    let found = film_shots(input, &mut |event| tell(AutoEvent::Event(event)))?;
    if found.shots.len() < 2 {
        return Ok(None);
    }
    files::make_folder(&options.output)?;
    let times = Times {
        film,
        shots: found.shots.clone(),
    };
    let text = serde_json::to_string_pretty(&times).unwrap_or_default();
    files::write(&path, (text + "\n").as_bytes())?;
    Ok(Some(found))
}

fn read_times(path: &Path) -> Result<Option<Times>, AutoError> {
    if !path.is_file() {
        return Ok(None);
    }
    let text = crate::input::read_to_string(path).map_err(files::at(path))?;
    let times: Times = serde_json::from_str(&text)
        .map_err(|error| StoreError::file(path, format!("{error}; correct it, or remove it")))?;
    let mut end = 0.0;
    for &[from, to] in &times.shots {
        if from + 1e-6 < end || from >= to {
            let reason = format!("the shot from {from} to {to} ends too early, or overlaps");
            return Err(StoreError::file(path, reason).into());
        }
        end = to;
    }
    Ok(Some(times))
}

/// Goes through all shots and joins them. A shot whose scene cannot be found has the fallback.
///
/// # Errors
/// [`AutoError`]: an interruption, a missing program, or what no other shot would do better.
pub fn reel(
    options: &AutoOptions,
    fallback: Fallback,
    film: &FilmShots,
    tell: &mut Teller<'_>,
) -> Result<Reel, AutoError> {
    let _originals = originals::OriginalFiles::default()
        .with(&options.prepare.input, "an original")
        .keep();
    if options
        .codec
        .is_some_and(|codec| codec.film_extension().is_none())
    {
        let reason = "several shots are joined to a film, not to pictures; choose one shot, or a codec of films";
        return Err(StoreError::file(&options.output, reason).into());
    }
    let parts = parts(film);
    let spans: Vec<[f64; 2]> = parts.iter().map(|part| part.span).collect();
    let each: Vec<AutoOptions> = (1..=parts.len())
        .map(|number| {
            let output = options
                .output
                .join(SHOTS_OF_AUTO)
                .join(format!("{number:03}"));
            AutoOptions {
                prepare: PrepareOptions {
                    output: output.join("house"),
                    shot: Some(number),
                    known_shots: Some(spans.clone()),
                    ..options.prepare.clone()
                },
                output,
                ..options.clone()
            }
        })
        .collect();
    // All frames first: their rate is that of the film in color.
    let mut films = Vec::with_capacity(parts.len());
    for (options, part) in each.iter().zip(&parts) {
        tell(AutoEvent::Shot(
            films.len() + 1,
            parts.len(),
            span(part.span),
        ));
        files::make_folder(&options.output)?;
        prepare_frames(&options.prepare, &mut |event| tell(AutoEvent::Event(event)))?;
        let gone = || StoreError::file(&options.prepare.output, "has no frames");
        let film = Film::read(&options.prepare.output).map_err(RunError::from)?;
        films.push(film.ok_or_else(gone)?);
    }
    let per_second = |film: &Film| f64::from(film.frame_rate[0]) / f64::from(film.frame_rate[1]);
    let fastest = films
        .iter()
        .max_by(|a, b| per_second(a).total_cmp(&per_second(b)));
    let rate = fastest.map_or(film.frame_rate, |film| film.frame_rate);
    let mut made = Reel {
        colored: options.film(),
        page: options.output.join("index.html"),
        times: options.output.join(SHOTS),
        shots: Vec::with_capacity(parts.len()),
    };
    page::write(&made, &spans, &options.prepare.input)?;
    for (number, (options, part)) in each.into_iter().zip(&parts).enumerate() {
        tell(AutoEvent::Shot(number + 1, parts.len(), span(part.span)));
        let options = AutoOptions {
            frame_rate: Some(rate),
            ..options
        };
        made.shots.push(one(&options, fallback, part, tell)?);
        page::write(&made, &spans, &options.prepare.input)?;
    }
    let pieces = made.shots.iter().zip(&films).map(|(shot, film)| {
        let frames: usize = film.repeats(rate).iter().sum();
        Piece {
            path: shot.colored.clone(),
            seconds: frames as f64 * f64::from(rate[1]) / f64::from(rate[0]),
        }
    });
    let pieces: Vec<Piece> = pieces.collect();
    let whole = Film {
        start: 0.0,
        seconds: film.seconds,
        frame_rate: rate,
        frames: Vec::new(),
        times: None,
        ..films.swap_remove(0)
    };
    let writer =
        FilmWriter::new(&made.colored, rate, Purpose::Editing).map_err(StoreError::from)?;
    writer.join(&pieces, &whole, &mut |event| tell(AutoEvent::Event(event)))?;
    Ok(made)
}

/// The whole film in parts: its shots, and what lies before, between and behind them.
fn parts(film: &FilmShots) -> Vec<Part> {
    let frame = f64::from(film.frame_rate[1]) / f64::from(film.frame_rate[0]);
    let mut parts = Vec::new();
    let mut end = 0.0;
    let blank = |from: f64, to: f64| {
        (to - from > SLACK * frame).then_some(Part {
            span: [from, to],
            is_blank: true,
        })
    };
    for &[from, to] in &film.shots {
        parts.extend(blank(end, from));
        parts.push(Part {
            span: [from, to],
            is_blank: false,
        });
        end = to;
    }
    parts.extend(blank(end, film.seconds));
    parts
}

/// Makes one part.
fn one(
    options: &AutoOptions,
    fallback: Fallback,
    part: &Part,
    tell: &mut Teller<'_>,
) -> Result<ReelShot, AutoError> {
    let begun = Instant::now();
    let mut warnings = Vec::new();
    let mut keeping = |event: AutoEvent| {
        if let AutoEvent::Event(Event::Warning(line)) = &event {
            warnings.push(line.clone());
        }
        tell(event);
    };
    let result = match part.is_blank {
        true => None,
        false => Some(auto(options, &mut keeping)),
    };
    let colored = options.film();
    let (outcome, camera) = match result {
        Some(Ok(results)) => {
            let camera = results.camera;
            (Outcome::Scene(Box::new(results)), camera)
        }
        Some(Err(error)) if !is_of_the_shot(&error) => return Err(error),
        Some(Err(error)) => {
            let reason = error.to_string();
            let has = match fallback {
                Fallback::Gray => "its frames stay gray",
                Fallback::Teacher => "it takes the teacher's colors, steadied",
            };
            keeping(AutoEvent::Event(Event::Warning(format!(
                "the shot {} has no scene, and {has}: {reason}",
                span(part.span)
            ))));
            without_scene(options, fallback, &colored, &mut keeping)?;
            (
                Outcome::Fallback {
                    colors: fallback,
                    reason,
                },
                None,
            )
        }
        None => {
            without_scene(options, Fallback::Gray, &colored, &mut keeping)?;
            (Outcome::Blank, None)
        }
    };
    let shot = ReelShot {
        span: part.span,
        outcome,
        camera,
        colored,
        seconds: begun.elapsed().as_secs_f64(),
        warnings,
    };
    page::picture(&shot, &options.output);
    Ok(shot)
}

/// Returns true if the shot has too little for a scene, or contradicts itself; a device, a teacher
/// or a disk that fails would fail for every shot.
fn is_of_the_shot(error: &AutoError) -> bool {
    match error {
        AutoError::Prepare(error) => matches!(
            error,
            PrepareError::TooFew { .. } | PrepareError::NoPoses { .. }
        ),
        AutoError::Run(error) => matches!(
            error,
            RunError::Subject(SubjectError::Capture(_) | SubjectError::Unsound(_))
                | RunError::Luma(LumaError::NoViews)
                | RunError::TeacherCoversNothing { .. }
        ),
        AutoError::Store(_) => false,
    }
}

/// Writes a shot without a scene, unless that is done.
fn without_scene(
    options: &AutoOptions,
    fallback: Fallback,
    colored: &Path,
    tell: &mut Teller<'_>,
) -> Result<(), AutoError> {
    let teacher = match fallback {
        Fallback::Gray => None,
        Fallback::Teacher => Some((options.teacher.clone(), options.teacher_settings.clone())),
    };
    let capture = options.prepare.output.clone();
    let from = digest_of(&[
        "no scene",
        &digest(&capture.join(crate::capture::FRAMES))?,
        &json!([
            fallback,
            options.frame_rate,
            options.codec,
            options.fit.load,
            options.teacher,
            options.teacher_settings
        ])
        .to_string(),
        &teacher_digest(&options.teacher)?,
    ]);
    let mut kept = StepRecords::read(&options.output)?;
    if !kept.due(Step::Frames, &from, &[colored]) {
        tell(AutoEvent::Skips(Step::Frames));
        return Ok(());
    }
    tell(AutoEvent::Begins(Step::Frames, Vec::new()));
    let asked = PlainFramesOptions {
        capture,
        load: options.fit.load.clone(),
        teacher,
        output: colored.to_owned(),
        codec: options.codec,
        frame_rate: options.frame_rate,
    };
    frames_without_scene(&asked, &mut |event| tell(AutoEvent::Event(event)))?;
    kept.done(Step::Frames, &from)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn film(shots: &[[f64; 2]], seconds: f64) -> FilmShots {
        FilmShots {
            shots: shots.to_vec(),
            seconds,
            frame_rate: [25, 1],
        }
    }

    #[test]
    fn parts_are_the_whole_film() {
        let spans = |film| -> Vec<([f64; 2], bool)> {
            parts(&film)
                .iter()
                .map(|part| (part.span, part.is_blank))
                .collect()
        };
        assert_eq!(
            spans(film(&[[0.0, 2.0], [2.0, 3.0]], 3.001)),
            [([0.0, 2.0], false), ([2.0, 3.0], false)]
        );
        assert_eq!(
            spans(film(&[[0.2, 2.0], [2.4, 3.0]], 4.0)),
            [
                ([0.0, 0.2], true),
                ([0.2, 2.0], false),
                ([2.0, 2.4], true),
                ([2.4, 3.0], false),
                ([3.0, 4.0], true)
            ]
        );
    }

    #[test]
    fn times_that_overlap_are_refused() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(SHOTS);
        assert!(matches!(read_times(&path), Ok(None)));
        let write = |text: &str| fs::write(&path, text).expect("writable");
        write(r#"{"film": "a", "shots": [[0, 2], [2, 3]]}"#);
        assert!(matches!(read_times(&path), Ok(Some(times)) if times.shots.len() == 2));
        for damaged in [
            r#"{"film": "a", "shots": [[0, 2], [1, 3]]}"#,
            r#"{"film": "a", "shots": [[3, 2]]}"#,
            "{",
        ] {
            write(damaged);
            assert!(read_times(&path).is_err(), "{damaged}");
        }
    }
}
