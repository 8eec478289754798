//! One shot of a film: all its frames, and some of them for poses.

use std::{
    fs,
    path::{Path, PathBuf},
};

use super::{
    PrepareError,
    ffmpeg::{self, FilmSource, Part},
    options::{FILM, PrepareOptions},
    photos::link_all,
    scan::Scan,
    sharp,
    state::{OutputState, Step, digest, of},
};
use crate::{
    archive::Timecode,
    capture::{CaptureError, FRAMES, Film, IMAGES, Signal, in_order, photo_header},
    disk,
    programs::Pictures,
    store::files,
    tell::{Event, Observer, Stage, count},
};

/// Shots that are told in one line.
const TOLD_SHOTS: usize = 12;

/// Frames of shots shorter than this, in seconds, show too little motion to be taken by themselves
/// while there is a choice.
const SHORTEST: f64 = 0.5;

/// Says what a film is.
///
/// # Errors
/// [`PrepareError`]: FFmpeg is missing or too old, or the file is none.
pub(super) fn probe(input: &Path, pictures: Option<Pictures>) -> Result<FilmSource, PrepareError> {
    ffmpeg::check_version()?;
    FilmSource::probe(input, pictures)
}

/// Shots of a film.
#[derive(Clone, Debug)]
pub(crate) struct FilmShots {
    /// From when to when each lasts, in seconds.
    pub shots: Vec<[f64; 2]>,
    /// Duration of the film, in seconds.
    pub seconds: f64,
    /// Frames a second.
    pub frame_rate: [u32; 2],
}

impl FilmShots {
    /// A film whose shots are not looked for.
    ///
    /// # Errors
    /// [`PrepareError`]: FFmpeg is missing or too old, or the file is no film.
    pub fn probe(input: &Path) -> Result<Self, PrepareError> {
        let source = probe(input, None)?;
        Ok(Self {
            shots: Vec::new(),
            seconds: source.seconds,
            frame_rate: source.frame_rate,
        })
    }
}

/// Finds the shots of a film.
///
/// # Errors
/// [`PrepareError`]: FFmpeg is missing or too old, or the file is no film.
pub(crate) fn film_shots(
    input: &Path,
    observe: &mut Observer<'_>,
) -> Result<FilmShots, PrepareError> {
    let source = probe(input, None)?;
    let whole = Part {
        start: 0.0,
        seconds: None,
    };
    let total = source.seconds.ceil().max(1.0) as usize;
    let shots = source.shots(whole, false, &mut |seen| {
        count(observe, Stage::Cuts, seen as usize, total);
    })?;
    Ok(FilmShots {
        shots,
        seconds: source.seconds,
        frame_rate: source.frame_rate,
    })
}

/// Makes `frames/`, `film.json` and `images/`; the shots of the film, where they were looked for.
///
/// # Errors
/// [`PrepareError`].
pub(super) fn frames(
    state: &mut OutputState,
    options: &PrepareOptions,
    source: &FilmSource,
    observe: &mut Observer<'_>,
) -> Result<Vec<[f64; 2]>, PrepareError> {
    let same_film = match &source.pictures {
        None => of(&["film", &digest(&source.path)?]),
        Some(Pictures {
            folder,
            names,
            first,
            rate: [frames, seconds],
        }) => of(&[
            names,
            &format!("{first} {frames}/{seconds}"),
            &digest(folder)?,
        ]),
    };
    let time = |time: Option<f64>| time.map_or(String::new(), |time| time.to_string());
    let mut parts = vec![
        "frames".to_owned(),
        same_film.clone(),
        time(options.start),
        time(options.end),
    ];
    if let Some(shot) = options.shot {
        let span = options
            .known_shots
            .as_ref()
            .and_then(|known| known.get(shot - 1));
        parts.push(format!("shot {shot} {span:?}"));
    }
    let from = of(&parts);
    if !state.is_done(Step::Frames, &from) {
        for result in [FRAMES, FILM, IMAGES] {
            state.check_own(result)?;
        }
        let part = choose(state, options, source, &same_film, observe)?;
        extract(state, source, part, &from, observe)?;
    }
    choose_sharp(state, options, observe)?;
    Ok(state.shots(&same_film).unwrap_or_default().to_vec())
}

/// The part of the film that is asked for, or its longest shot.
fn choose(
    state: &mut OutputState,
    options: &PrepareOptions,
    source: &FilmSource,
    same_film: &str,
    observe: &mut Observer<'_>,
) -> Result<Part, PrepareError> {
    let no_film = |reason: String| PrepareError::at(&options.input, reason);
    let start = options.start.unwrap_or(0.0);
    if source.seconds > 0.0 && start >= source.seconds {
        return Err(no_film(format!(
            "ends after {}, before the start; give an earlier one",
            clock(source.seconds)
        )));
    }
    let asked = Part {
        start,
        seconds: options.end.map(|end| end - start),
    };
    let seconds = asked.seconds.unwrap_or(source.seconds - start);
    let total = seconds.ceil().max(1.0) as usize;
    let chosen = options.start.is_some() || options.end.is_some();
    let shots = match (&options.known_shots, state.shots(same_film)) {
        (Some(known), _) => known.clone(),
        (None, Some(known)) if !chosen => known.to_vec(),
        _ => {
            let only_first = chosen && options.end.is_none();
            let found = source.shots(asked, only_first, &mut |seen| {
                count(observe, Stage::Cuts, seen as usize, total);
            })?;
            if !chosen {
                state.keep_shots(same_film.to_owned(), found.clone())?;
            }
            found
        }
    };
    let length = |shot: &[f64; 2]| shot[1] - shot[0];
    // Half a frame earlier than the first frame, and half a frame before the one after the last,
    // so that rounding decides nothing.
    let half = 0.5 / source.rate();
    let exactly = |[from, to]: [f64; 2]| Part {
        start: (from - half).max(0.0),
        seconds: Some(to - from - if from < half { half } else { 0.0 }),
    };
    if let Some(number) = options.shot {
        let count = shots.len();
        let Some(&shot) = shots.get(number - 1) else {
            return Err(no_film(format!("has {count} shots, and no shot {number}")));
        };
        let span = span(shot);
        observe(Event::Note(format!(
            "using shot {number} of {count}, {span}"
        )));
        return Ok(exactly(shot));
    }
    let Some(longest) = shots
        .iter()
        .max_by(|a, b| length(a).total_cmp(&length(b)).then(b[0].total_cmp(&a[0])))
    else {
        return Err(no_film(
            "shows nothing there: no frame, or only black ones".to_owned(),
        ));
    };
    if !chosen {
        if shots.len() > 1 {
            observe(Event::Note(format!(
                "{} shots; using the longest, {}; choose another by its number or start: {}",
                shots.len(),
                span(*longest),
                list(&shots)
            )));
        }
        return Ok(exactly(*longest));
    }
    if options.end.is_some() {
        if let [_, later @ ..] = &shots[..]
            && !later.is_empty()
        {
            observe(Event::Warning(format!(
                "the chosen part has a cut at {}; a scene needs a single shot",
                later
                    .iter()
                    .map(|shot| clock(shot[0]))
                    .collect::<Vec<_>>()
                    .join(", ")
            )));
        }
        return Ok(asked);
    }
    let first = shots
        .iter()
        .find(|shot| length(shot) >= SHORTEST)
        .unwrap_or(longest);
    observe(Event::Note(format!("using the shot from {}", span(*first))));
    Ok(exactly(*first))
}

/// Writes all frames of a part.
fn extract(
    state: &mut OutputState,
    source: &FilmSource,
    part: Part,
    from: &str,
    observe: &mut Observer<'_>,
) -> Result<(), PrepareError> {
    let colors = source.color_tags.filters(observe)?;
    if let Some(1 | 3) = source.signal.dpx_transfer {
        observe(Event::Note(
            "the pictures are logarithmic: their values stay as they are, and gray comes back with the same"
                .to_owned(),
        ));
    }
    let scan = match &source.pictures {
        Some(_) => Scan::Progressive,
        None => source.scan(part)?,
    };
    match scan {
        Scan::Progressive => {}
        Scan::Interlaced => observe(Event::Note(
            "the film is interlaced: deinterlacing with bwdif".to_owned(),
        )),
        Scan::Telecined => observe(Event::Note(
            "the film was converted from 24 to 30 frames a second: removing repeated fields"
                .to_owned(),
        )),
    }
    let frame_rate = scan.rate(source.frame_rate);
    let rate = f64::from(frame_rate[0]) / f64::from(frame_rate[1]);
    let seconds = part.seconds.unwrap_or(source.seconds - part.start);
    let expected = (seconds * rate).round().max(1.0) as usize;
    let draft = state.draft()?;
    let frames = draft.path().join(FRAMES);
    disk::make_folder(&frames).map_err(files::at(&frames))?;
    source.extract(part, (scan, &colors), &frames, &mut |written| {
        count(observe, Stage::Frames, written, expected);
    })?;
    let names = names_in(&frames)?;
    let Some(first) = names.first() else {
        let reason = "has no frame there; choose another part";
        return Err(PrepareError::at(&source.path, reason));
    };
    let header = photo_header(&frames.join(first))?;
    let times = match scan {
        // Other frames than the file has.
        Scan::Telecined => Vec::new(),
        _ => source.times(part, names.len())?,
    };
    if times.len() > names.len() {
        observe(Event::Warning(format!(
            "only {} of {} frames could be read; copy the film into another container first (ffmpeg -i FILM -c copy copy.mkv)",
            names.len(),
            times.len()
        )));
    }
    // That of the first frame, where half a frame earlier was asked for.
    let first = times.first().copied();
    let first = first.unwrap_or_else(|| first_frame(part.start, source.rate()));
    let varied = match scan {
        Scan::Progressive if times.len() == names.len() => source.uneven(&times),
        _ => None,
    };
    let mut film = Film {
        source: source.path.clone(),
        start: ((source.late + first) * 1e6).round().max(0.0) / 1e6,
        seconds: names.len() as f64 / rate,
        frame_rate,
        audio: source.audio,
        size: header.size,
        frames: names,
        times: None,
        signal: Some(signal_from(source, first, frame_rate)),
    };
    if let (Some(fast), Some(last)) = (varied, times.last()) {
        observe(Event::Note(format!(
            "the film's frames are not evenly spaced: a film made of them has {:.0} a second, with repeats",
            f64::from(fast[0]) / f64::from(fast[1])
        )));
        let end = part.seconds.map_or(source.seconds, |s| part.start + s);
        film.seconds = end.max(last + 1.0 / rate) - first;
        film.frame_rate = fast;
        film.times = Some(times.iter().map(|time| time - first).collect());
    }
    film.write(draft.path())
        .map_err(files::at(&draft.path().join(FILM)))?;
    let made = [(frames, FRAMES), (draft.path().join(FILM), FILM)];
    state.place(Step::Frames, from, &made)
}

/// The signal of a shot that begins so many seconds after the film's zero, its frames at a rate.
fn signal_from(source: &FilmSource, begin: f64, rate: [u32; 2]) -> Signal {
    let frames = (begin * source.rate()).round().max(0.0) as u64;
    let mut signal = source.signal.clone();
    let begins = signal.timecode.as_deref();
    let code = begins.and_then(|text| Timecode::parse(text, source.frame_rate));
    signal.timecode = code.map(|code| code.after(frames).at_rate(rate).to_string());
    if signal.names.is_some() {
        signal.first += frames;
    }
    signal
}

/// When the first frame at `start` or later is shown; a rounding error is no frame.
fn first_frame(start: f64, rate: f64) -> f64 {
    (start * rate - 1e-6).ceil().max(0.0) / rate
}

/// The frames' names, in order.
fn names_in(frames: &Path) -> Result<Vec<String>, PrepareError> {
    let entries = fs::read_dir(frames).map_err(files::at(frames))?;
    let mut names: Vec<String> = entries
        .flatten()
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    // After a million frames names are longer.
    names.sort_by(|a, b| a.len().cmp(&b.len()).then(a.cmp(b)));
    Ok(names)
}

/// Links the sharpest frames of each time step to `images/`.
fn choose_sharp(
    state: &mut OutputState,
    options: &PrepareOptions,
    observe: &mut Observer<'_>,
) -> Result<(), PrepareError> {
    let frames = state.path(FRAMES);
    let asked = options.per_second;
    let asked = asked.map_or(String::new(), |rate| rate.to_string());
    let from = of(&["images", &digest(&frames)?, &asked]);
    if state.is_done(Step::Images, &from) {
        return Ok(());
    }
    state.check_own(IMAGES)?;
    let film = Film::read(&state.path("."))?;
    let gone = || PrepareError::at(&state.path(FILM), "is gone; prepare another folder");
    let film = film.ok_or_else(gone)?;
    let [numerator, denominator] = film.frame_rate.map(f64::from);
    let rate = numerator / denominator;
    let usual = || sharp::usual_rate(film.seconds);
    let per_second = options.per_second.unwrap_or_else(usual);
    let chosen: Vec<&String> = if per_second >= rate {
        film.frames.iter().collect()
    } else {
        let paths: Vec<PathBuf> = film.frames.iter().map(|name| frames.join(name)).collect();
        let mut sharpness = Vec::with_capacity(paths.len());
        in_order(
            &paths,
            |path| sharp::sharpness(path),
            |_, found| {
                sharpness.push(found?);
                if sharpness.len() % 8 == 0 {
                    count(observe, Stage::Sharpness, sharpness.len(), paths.len());
                }
                Ok::<_, CaptureError>(())
            },
        )?;
        let chosen = sharp::sharpest(&sharpness, rate, per_second).into_iter();
        chosen.map(|frame| &film.frames[frame]).collect()
    };
    observe(Event::Note(format!(
        "using {} of {} frames for poses, {:.1} a second",
        chosen.len(),
        film.frames.len(),
        chosen.len() as f64 / film.seconds
    )));
    let draft = state.draft()?;
    let images = draft.path().join(IMAGES);
    link_all(chosen.into_iter().map(String::as_str), &frames, &images)?;
    state.place(Step::Images, &from, &[(images, IMAGES)])
}

/// A time as it is read: `1:05.00`, never later than it is, so that the frame there is in what
/// begins at it, and not in what ends at it.
fn clock(seconds: f64) -> String {
    let hundredths = (100.0 * seconds).floor() as u64;
    let (minutes, rest) = (hundredths / 6000, hundredths % 6000);
    let rest = format!("{:02}.{:02}", rest / 100, rest % 100);
    match minutes {
        0..60 => format!("{minutes}:{rest}"),
        _ => format!("{}:{:02}:{rest}", minutes / 60, minutes % 60),
    }
}

pub fn span([from, to]: [f64; 2]) -> String {
    format!("{} to {}", clock(from), clock(to))
}

/// The longest shots in the order of the film, with their numbers.
fn list(shots: &[[f64; 2]]) -> String {
    let mut longest: Vec<(usize, [f64; 2])> = shots.iter().copied().enumerate().collect();
    longest.sort_by(|(_, a), (_, b)| (b[1] - b[0]).total_cmp(&(a[1] - a[0])));
    let left_out = longest.len().saturating_sub(TOLD_SHOTS);
    longest.truncate(TOLD_SHOTS);
    longest.sort_by_key(|&(place, _)| place);
    let numbered = |(place, shot)| format!("{}: {}", place + 1, span(shot));
    let mut told: Vec<String> = longest.into_iter().map(numbered).collect();
    if left_out > 0 {
        told.push(format!("and {left_out} shorter ones"));
    }
    told.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_told_as_they_are_read() {
        assert_eq!(clock(0.0), "0:00.00");
        assert_eq!(clock(65.0417), "1:05.04");
        assert_eq!(clock(59.999), "0:59.99");
        assert_eq!(clock(3723.5), "1:02:03.50");
    }

    #[test]
    fn the_longest_shots_are_listed() {
        assert_eq!(
            list(&[[0.0, 2.0], [2.0, 9.5]]),
            "1: 0:00.00 to 0:02.00, 2: 0:02.00 to 0:09.50"
        );
        let many: Vec<[f64; 2]> = (0..20)
            .map(|n| [f64::from(n), f64::from(n) + 0.1 * f64::from(n)])
            .collect();
        let told = list(&many);
        assert!(
            told.ends_with("and 8 shorter ones") && !told.contains("0:07.00"),
            "{told}"
        );
    }
}
