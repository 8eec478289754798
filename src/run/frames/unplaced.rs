//! Photos without a pose: their colors come from the photos before and after.

use std::{num::NonZero, thread};

use super::{
    changes::{self, FrameSources},
    out::FrameOutput,
    painter::Painter,
    shots::Shot,
};
use crate::{
    capture::{CaptureError, Original, in_order},
    frames::{Between, Canvas, Colored, ColoredPhoto, Strokes, WeightedColors, blend, finish},
    run::RunError,
    tell::{Event, Observer},
};

/// A share of a photo without a pose that has to be known from its neighbors; else the teacher
/// is asked.
const CARRIED: f64 = 0.9;

/// Ranges of photos that are named.
const TOLD_RANGES: usize = 12;

/// Known share of a photo below which most of its colors are the teacher's.
const LITTLE: f64 = 0.5;

/// A photo whose colors are known.
pub(super) struct Known {
    pub canvas: Canvas,
    pub ab: Vec<[f32; 2]>,
    /// With strokes over them, where there are some.
    pub shown: Option<Vec<[f32; 2]>>,
}

impl Known {
    pub fn shown(&self) -> &[[f32; 2]] {
        self.shown.as_deref().unwrap_or(&self.ab)
    }

    pub fn as_carried(&self, shown: bool) -> ColoredPhoto<'_> {
        ColoredPhoto {
            canvas: &self.canvas,
            ab: if shown { self.shown() } else { &self.ab },
        }
    }
}

/// A photo without a pose.
pub(super) struct Unknown<'a> {
    /// Its place among all.
    pub index: usize,
    pub shot: &'a Shot,
    pub canvas: Canvas,
    pub strokes: Option<&'a Strokes>,
    /// None where there are too many to be kept.
    pub original: Option<Original>,
}

/// Known photos before and after some without a pose.
pub(super) struct Bracket<'a> {
    pub before: Option<&'a Known>,
    pub after: Option<&'a Known>,
}

/// A photo that was colored from others.
pub(super) struct Carried {
    pub sources: FrameSources,
    /// True if its colors are more the teacher's than its neighbors'.
    pub taught: bool,
}

/// Steps from each photo to the next; `None` where their shapes differ.
pub(super) type Steps = Vec<Option<Between>>;

pub(super) fn way(first: &Canvas, open: &[Unknown<'_>], last: Option<&Canvas>) -> Steps {
    let inner = open.iter().map(|unknown| &unknown.canvas);
    chain(std::iter::once(first).chain(inner).chain(last))
}

pub(super) fn chain<'a>(photos: impl Iterator<Item = &'a Canvas>) -> Steps {
    let photos: Vec<&Canvas> = photos.collect();
    let pairs: Vec<[&Canvas; 2]> = photos.windows(2).map(|pair| [pair[0], pair[1]]).collect();
    let mut steps = Vec::with_capacity(pairs.len());
    let compared: Result<(), std::convert::Infallible> = in_order(
        &pairs,
        |[first, second]| Between::of(first, second),
        |_, step| {
            steps.push(step);
            Ok(())
        },
    );
    match compared {
        Ok(()) => steps,
    }
}

/// All of some steps; none where one is missing, or there is none.
pub(super) fn whole(steps: &[Option<Between>]) -> Option<Vec<&Between>> {
    let steps: Option<Vec<&Between>> = steps.iter().map(Option::as_ref).collect();
    steps.filter(|steps| !steps.is_empty())
}

/// Colors photos without a pose by those before and after, and writes them. `steps` lead from
/// the one before, if there is one, over all of them to the one after, if there is one. Gives
/// where the colors of each come from.
pub(super) fn carry(
    painter: &mut Painter<'_>,
    open: &[Unknown<'_>],
    steps: &Steps,
    ends: &Bracket<'_>,
    out: &mut FrameOutput,
) -> Result<Vec<Carried>, RunError> {
    let mut carried = Vec::with_capacity(open.len());
    // Of several the slow part is done at once, and as many wait as there are threads.
    let threads = thread::available_parallelism().map_or(1, NonZero::get);
    for (part, some) in open.chunks(threads).enumerate() {
        let mut known = Vec::with_capacity(some.len());
        for (k, unknown) in some.iter().enumerate() {
            let canvas = &unknown.canvas;
            let i = part * threads + k;
            // With nothing before, the first step leads from the first of them to the second.
            let first = usize::from(ends.before.is_some());
            let (before, after) = steps.split_at((i + first).min(steps.len()));
            let of = |known: Option<&Known>, way: &[Option<Between>], backwards: bool| {
                let way = whole(way)?;
                Some(known?.as_carried(true).along(&way, backwards, canvas))
            };
            let nearness = (i + 1) as f32 / (open.len() + 1) as f32;
            let seen = joined(
                canvas.len(),
                [
                    (of(ends.before, before, false), 1.0 - nearness),
                    (of(ends.after, after, true), nearness),
                ],
            );
            let answer = match seen.share() < CARRIED {
                true => painter.answer(&unknown.shot.name, None, canvas)?,
                false => None,
            };
            carried.push(Carried {
                sources: FrameSources {
                    index: unknown.index,
                    pose: false,
                    shares: changes::unplaced(seen.share(), answer.is_some(), unknown.strokes),
                },
                taught: answer.is_some() && seen.share() < LITTLE,
            });
            known.push((unknown, seen, answer));
        }
        let (loader, range) = (painter.dataset.loader(), painter.range);
        in_order(
            &known,
            |(unknown, seen, answer)| {
                let canvas = &unknown.canvas;
                let ab = blend(canvas, seen, answer.as_deref(), None);
                let ab = match unknown.strokes {
                    Some(strokes) => {
                        strokes.over(canvas, &WeightedColors::nothing(canvas.len()), &ab)
                    }
                    None => ab,
                };
                match &unknown.original {
                    Some(original) => Ok(finish(original, canvas, ab)),
                    None => {
                        let original = loader.unplaced(&unknown.shot.path, range)?;
                        Ok(finish(&original, canvas, ab))
                    }
                }
            },
            |(unknown, ..), colored: Result<Colored, CaptureError>| {
                out.write(unknown.shot, colored?)
            },
        )?;
    }
    Ok(carried)
}

/// Tells which photos without a pose have whose colors, as [`carry`] gives them.
pub(super) fn tell(carried: &[Carried], shots: &[Shot], observe: &mut Observer<'_>) {
    for by_teacher in [false, true] {
        let chosen = carried.iter().filter(|photo| photo.taught == by_teacher);
        let photos: Vec<usize> = chosen.map(|photo| photo.sources.index).collect();
        if photos.is_empty() {
            continue;
        }
        let photos = in_ranges(&photos, shots);
        observe(match by_teacher {
            false => Event::Note(format!(
                "colored by their neighbors, without a pose: {photos}"
            )),
            true => Event::Warning(format!(
                "colored by the teacher alone, without a pose and unlike their neighbors: {photos}"
            )),
        });
    }
}

/// Photos in words: those that follow each other as one range.
fn in_ranges(photos: &[usize], shots: &[Shot]) -> String {
    let ranges: Vec<&[usize]> = photos.chunk_by(|a, b| a + 1 == *b).collect();
    let words = ranges.iter().take(TOLD_RANGES).map(|range| {
        let [first, last] = [range[0], range[range.len() - 1]].map(|i| &shots[i].name);
        match range.len() {
            1 => first.clone(),
            count => format!("{first} to {last} ({count})"),
        }
    });
    let mut words: Vec<String> = words.collect();
    if ranges.len() > TOLD_RANGES {
        words.push(format!("{} more", ranges.len() - TOLD_RANGES));
    }
    words.join(", ")
}

/// Weighted mean of the colors carried from both sides.
fn joined(pixels: usize, sides: [(Option<WeightedColors>, f32); 2]) -> WeightedColors {
    let mut all = WeightedColors::nothing(pixels);
    let mut total = vec![0.0; pixels];
    for (side, share) in sides {
        let Some(side) = side else { continue };
        for (i, total) in total.iter_mut().enumerate() {
            let weight = share * side.weight[i];
            *total += weight;
            for k in 0..2 {
                all.ab[i][k] += weight * side.ab[i][k];
            }
            all.weight[i] = all.weight[i].max(side.weight[i]);
        }
    }
    for (ab, total) in all.ab.iter_mut().zip(total) {
        if total > 0.0 {
            *ab = ab.map(|value| value / total);
        }
    }
    all
}
