//! Hints on photos, for what the scene does not show: found, and carried to the photos around.

use std::{collections::BTreeMap, path::Path};

use super::{Painter, shots::Shot};
use crate::{
    chroma::teacher::HintFolder,
    frames::{Between, Canvas, Strokes, WeightedColors},
    run::RunError,
    tell::{Event, Observer, Stage},
};

/// So many photos before and after one that is painted take its strokes, unless another is
/// painted: what is known of all of them waits in memory, 3 bytes a pixel.
const REACH: usize = 200;

/// A share of a photo that is worth going on with.
const LEAST: f64 = 0.002;

/// Strokes of each photo, its own or carried from a painted one.
#[derive(Default)]
pub(super) struct Painted(BTreeMap<usize, Strokes>);

/// A photo at working size with what the scene covers of it.
struct CoveredPhoto {
    canvas: Canvas,
    believed: WeightedColors,
}

impl Painted {
    /// Reads the hints and carries them on; `grow` is whether a stroke colors what it lies on.
    pub fn find(
        folder: &Path,
        grow: bool,
        shots: &[Shot],
        painter: &mut Painter<'_>,
        observe: &mut Observer<'_>,
    ) -> Result<Self, RunError> {
        let mut hints = HintFolder::open(folder)?;
        hints.know(&painter.dataset.capture);
        let mut own = BTreeMap::new();
        let mut done = 0;
        let mut tell = |done: usize, name: &str| {
            observe(Event::progress(Stage::Strokes, done, 0, name));
        };
        for (i, shot) in shots.iter().enumerate() {
            if !hints.covers(shot.name.as_str())? {
                continue;
            }
            tell(done, &shot.name);
            done += 1;
            let seen = CoveredPhoto::of(shot, painter)?;
            if shot.views.is_empty() {
                hints.know_photo(&shot.name, &shot.path, seen.canvas.stance);
            }
            let query = seen.canvas.query(&shot.name);
            if let Some(paint) = hints.load(query, seen.canvas.gray_image())? {
                let strokes = Strokes::of(&seen.canvas, &seen.believed, &paint, grow);
                if strokes.share() > 0.0 {
                    own.insert(i, (seen, strokes));
                }
            }
        }
        if done == 0 {
            return Err(RunError::TeacherCoversNothing {
                teacher: folder.to_owned(),
                example: shots
                    .first()
                    .map_or(String::new(), |shot| shot.name.clone()),
            });
        }
        let mut sides: [BTreeMap<usize, (usize, Strokes)>; 2] = Default::default();
        // Paint that counts where it is, and nowhere else, stays there.
        for (&start, (seen, strokes)) in own.iter().filter(|_| grow) {
            for (side, found) in sides.iter_mut().enumerate() {
                let end = match side {
                    0 => own
                        .range(start + 1..)
                        .next()
                        .map_or(shots.len(), |(&i, _)| i),
                    _ => own.range(..start).next_back().map_or(0, |(&i, _)| i + 1),
                };
                let way: Vec<usize> = match side {
                    0 => (start + 1..end).take(REACH).collect(),
                    _ => (end..start).rev().take(REACH).collect(),
                };
                let from = (seen, strokes);
                let carried = carry(from, side == 1, &way, shots, painter, &mut |name: &str| {
                    tell(done, name);
                    done += 1;
                })?;
                found.extend(
                    carried
                        .into_iter()
                        .map(|(i, strokes)| (i, (start, strokes))),
                );
            }
        }
        let [before, after] = sides;
        let mut all: BTreeMap<usize, Strokes> = BTreeMap::new();
        for (&i, (start, strokes)) in &before {
            let both = after.get(&i).map(|(end, other)| {
                let nearness = (i - start) as f32 / (end - start) as f32;
                Strokes::between(strokes, other, nearness)
            });
            all.insert(i, both.unwrap_or_else(|| strokes.clone()));
        }
        for (i, (_, strokes)) in after {
            all.entry(i).or_insert(strokes);
        }
        all.extend(own.into_iter().map(|(i, (_, strokes))| (i, strokes)));
        Ok(Self(all))
    }

    /// The strokes on a photo.
    pub fn on(&self, shot: usize) -> Option<&Strokes> {
        self.0.get(&shot)
    }
}

impl CoveredPhoto {
    fn of(shot: &Shot, painter: &mut Painter<'_>) -> Result<Self, RunError> {
        let original = painter.original(shot)?;
        if shot.views.is_empty() {
            let canvas = Canvas::of(&original, painter.side(&original));
            let believed = WeightedColors::nothing(canvas.len());
            return Ok(Self { canvas, believed });
        }
        let canvas = painter.canvas(shot, &original);
        let believed = painter.seen(shot, &canvas)?;
        Ok(Self { canvas, believed })
    }
}

/// Carries strokes from a photo along others, as far as there is something of them: those with a
/// pose keep them, and those between, which take their colors from these, are but followed.
fn carry(
    (first, strokes): (&CoveredPhoto, &Strokes),
    backwards: bool,
    way: &[usize],
    shots: &[Shot],
    painter: &mut Painter<'_>,
    tell: &mut dyn FnMut(&str),
) -> Result<Vec<(usize, Strokes)>, RunError> {
    let mut found: Vec<(usize, Strokes)> = Vec::new();
    // The last photo that has strokes, where it is not the first; the last of all; and the steps
    // from one to the other, in the photos' order.
    let mut from: Option<CoveredPhoto> = None;
    let mut last: Option<Canvas> = None;
    let mut steps: Vec<Between> = Vec::new();
    for &i in way {
        let shot = &shots[i];
        tell(&shot.name);
        let seen = match CoveredPhoto::of(shot, painter) {
            Ok(seen) => seen,
            // What cannot be read and has no pose is left out.
            Err(_) if shot.views.is_empty() => continue,
            Err(error) => return Err(error),
        };
        let start = from.as_ref().unwrap_or(first);
        let before = last.as_ref().unwrap_or(&start.canvas);
        let step = match backwards {
            false => Between::of(before, &seen.canvas),
            true => Between::of(&seen.canvas, before),
        };
        let Some(step) = step else { break };
        match backwards {
            false => steps.push(step),
            true => steps.insert(0, step),
        }
        if shot.views.is_empty() {
            last = Some(seen.canvas);
            continue;
        }
        let on_start = found.last().map_or(strokes, |(_, strokes)| strokes);
        let steps_there: Vec<&Between> = steps.iter().collect();
        let to = (&seen.canvas, &seen.believed);
        let carried = on_start.carried(&start.canvas, &steps_there, backwards, to);
        if carried.share() < LEAST {
            break;
        }
        found.push((i, carried));
        steps.clear();
        last = None;
        from = Some(seen);
    }
    Ok(found)
}
