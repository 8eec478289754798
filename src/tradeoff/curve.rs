//! Points along a run: what it had reached before its end, by its report and its log. They are
//! free.

use std::path::Path;

use super::{
    request::POINTS,
    sweep::{Outcome, SweepPoint},
};
use crate::{
    input,
    store::{RunFolder, StoreError},
};

/// Share of a run before which it has nothing to show.
const FROM: f64 = 1.0 / 16.0;

/// From point to point rounds grow by this factor, as iterations do from picture to picture.
const STEP: f64 = 1.4;

/// Held-out PSNR of luma wherever a picture was kept. Fewer views are watched than measured: by
/// how much these differ at the end they differ all along.
pub(super) fn of_luma(
    point: &SweepPoint,
    folder: &RunFolder,
) -> Result<Vec<SweepPoint>, StoreError> {
    let curve = folder.read_report()?.luma.curve;
    let (Some(end), Some(outcome)) = (curve.last(), &point.outcome) else {
        return Ok(Vec::new());
    };
    let shift = outcome.psnr.map(|psnr| psnr - end.psnr);
    let mut points: Vec<SweepPoint> = Vec::new();
    for look in &curve {
        let picture = folder.album(look.iteration);
        let early = (look.iteration as f64) < FROM * end.iteration as f64;
        if early || look == end || !picture.is_file() {
            continue;
        }
        let reached = Outcome {
            iterations: look.iteration,
            splats: look.splats,
            seconds: outcome.seconds - (end.seconds - look.seconds),
            psnr: shift.map(|shift| look.psnr + shift),
            ..Outcome::default()
        };
        let found = SweepPoint {
            picture: picture_of(folder, &picture),
            ..along(point, look.iteration, reached)
        };
        // One that went back to its best has been there before.
        points.retain(|point| point.name != found.name);
        points.push(found);
    }
    Ok(points)
}

/// Loss of color after some of its rounds.
pub(super) fn of_color(
    point: &SweepPoint,
    folder: &RunFolder,
) -> Result<Vec<SweepPoint>, StoreError> {
    let before = folder.read_report()?.luma.iterations;
    let log = input::read_to_string(&folder.log()).unwrap_or_default();
    let rounds = log.lines().filter_map(|line| {
        let figures = line.split(',').map_while(|cell| cell.parse().ok());
        let [iteration, loss, _, seconds] = *figures.collect::<Vec<f64>>() else {
            return None;
        };
        let round = iteration as usize;
        let round = round.checked_sub(before)?;
        (round > 0).then_some((round, loss, seconds))
    });
    let mut rounds: Vec<(usize, f64, f64)> = rounds.collect();
    let (Some((_, _, end)), Some(outcome)) = (rounds.pop(), &point.outcome) else {
        return Ok(Vec::new());
    };
    let mut points: Vec<SweepPoint> = Vec::new();
    for (round, loss, seconds) in rounds {
        let last = points.last().and_then(|point| point.after);
        if round as f64 >= STEP * last.unwrap_or(0) as f64 {
            let reached = Outcome {
                iterations: outcome.iterations,
                splats: outcome.splats,
                seconds: outcome.seconds - (end - seconds),
                loss: Some(loss),
                ..Outcome::default()
            };
            points.push(along(point, round, reached));
        }
    }
    Ok(points)
}

/// A point along another.
fn along(point: &SweepPoint, after: usize, reached: Outcome) -> SweepPoint {
    SweepPoint {
        name: format!("{}+after-{after}", point.name),
        after: Some(after),
        picture: None,
        commands: Vec::new(),
        took: 0.0,
        outcome: Some(reached),
        ..point.clone()
    }
}

/// A file of a point, below the sweep's folder; names are letters, digits, `.`, `+` and `-`.
pub(super) fn picture_of(folder: &RunFolder, file: &Path) -> Option<String> {
    let below = file.strip_prefix(folder.path().parent()?).ok()?;
    let parts = below.iter().map(|part| part.to_str());
    let parts: Option<Vec<&str>> = [Some(POINTS)].into_iter().chain(parts).collect();
    Some(parts?.join("/"))
}
