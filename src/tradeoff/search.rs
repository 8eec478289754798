//! Which point comes next: first every knob alone, then combinations of what proved
//! itself, by successive halving (Jamieson and Talwalkar, AISTATS 2016).
//!
//! Everything follows from the points that are there and the seconds that are left, so
//! that a sweep that goes on asks for what one without a break would have asked for.

use super::report::{Measure, Phase, Point, PointStage, Setting};
use super::{
    knobs::{BASELINE_OF_COLOR, BASELINE_OF_LUMA, PRESET},
    space::{Space, Task, Value, base_name, expected, find, name},
};

/// Share of the budget that bases and single knobs may take before combinations have had
/// their turn.
const SHARE_OF_SINGLES: f64 = 0.6;

/// Iterations of a combination's runs, over the base's: with half as many left at each
/// rung, all rungs take the same time.
const RUNGS: [f64; 4] = [0.25, 0.5, 1.0, 2.0];

/// Combinations on the first rung.
const FIRST_RUNG: usize = 8;

/// Values that are combined: the best of those that proved themselves.
const COMBINED: usize = 5;

/// Knobs turned at once.
const AT_ONCE: usize = 3;

/// The next point of a sweep whose points may take `budget` wall seconds together; none
/// when all is done or nothing that is left fits.
pub(super) fn next(space: &Space, points: &[Point], budget: f64) -> Option<Task> {
    let stages = match space.color {
        true => &[PointStage::Luma, PointStage::Color][..],
        false => &[PointStage::Luma],
    };
    for &stage in stages {
        match find(points, base_name(stage)) {
            None => return Some(task(space, points, stage, Phase::Base, &[])),
            // Neither the other stage nor any knob has anything to start from.
            Some(base) if base.outcome.is_none() => return None,
            Some(_) => {}
        }
    }
    let spent = |counts: fn(&Point) -> bool| -> f64 {
        (points.iter().filter(|point| counts(point)))
            .map(|point| point.took)
            .sum()
    };
    let left = budget - spent(|_| true);
    let fits = |task: &Task| task.expected.is_some_and(|seconds| seconds <= left);
    let for_singles = SHARE_OF_SINGLES * budget - spent(|point| point.phase != Phase::Front);
    let single = cheapest_single(space, points).filter(fits);
    if let Some(task) = &single
        && task.expected <= Some(for_singles)
    {
        return single;
    }
    let combined = stages.iter().find_map(|&stage| match stage {
        PointStage::Luma => halving(space, points, &fits),
        PointStage::Color => combinations(space, points, stage, 2)
            .into_iter()
            .filter_map(|settings| new(space, points, stage, &settings))
            .find(fits),
    });
    combined.or(single)
}

/// The single knob's value that has not been tried and should take least.
fn cheapest_single(space: &Space, points: &[Point]) -> Option<Task> {
    let tasks = space.values.iter().filter_map(|value| {
        let settings = [value.setting()];
        let known = find(points, &name(value.stage, &settings)).is_some();
        (!known).then(|| task(space, points, value.stage, Phase::One, &settings))
    });
    // Of several that take the same, `min_by` keeps the first; without a base of its stage
    // a value has nothing to be compared with.
    let tasks = tasks.filter(|task| task.expected.is_some());
    tasks.min_by(|a, b| {
        let seconds = |task: &Task| task.expected.unwrap_or(0.0);
        seconds(a).total_cmp(&seconds(b))
    })
}

/// The next run of the halving of luma's combinations.
fn halving(space: &Space, points: &[Point], fits: &dyn Fn(&Task) -> bool) -> Option<Task> {
    let stage = PointStage::Luma;
    let mut candidates = combinations(space, points, stage, 1);
    for (rung, share) in RUNGS.into_iter().enumerate() {
        let iterations = ((space.iterations as f64 * share).round() as usize).max(1);
        let at_rung = |settings: &[Setting]| -> Vec<Setting> {
            let mut settings = settings.to_vec();
            if iterations != space.iterations {
                let knob = BASELINE_OF_LUMA.to_owned();
                let value = iterations.to_string();
                settings.push(Setting { knob, value });
            }
            settings
        };
        candidates.truncate((FIRST_RUNG >> rung).max(1));
        let open = (candidates.iter())
            .filter_map(|settings| new(space, points, stage, &at_rung(settings)));
        if let Some(task) = open.into_iter().find(fits) {
            return Some(task);
        }
        // What failed or did not fit is out; the others are ranked by this rung.
        let mut ranked: Vec<(f64, Vec<Setting>)> = (candidates.into_iter())
            .filter_map(|settings| {
                let point = find(points, &name(stage, &at_rung(&settings)))?;
                Some((gain(points, point)?, settings))
            })
            .collect();
        ranked.sort_by(|a, b| b.0.total_cmp(&a.0));
        candidates = ranked.into_iter().map(|(_, settings)| settings).collect();
    }
    None
}

/// The combinations of at least so many values that proved themselves alone, the most
/// promising first.
fn combinations(
    space: &Space,
    points: &[Point],
    stage: PointStage,
    at_least: usize,
) -> Vec<Vec<Setting>> {
    let mut proven: Vec<(f64, &Value)> = (space.values.iter())
        .filter(|value| value.stage == stage && ![baseline(stage), PRESET].contains(&value.knob))
        .filter_map(|value| {
            let point = find(points, &name(stage, &[value.setting()]))?;
            let gain = gain(points, point)?;
            (gain > -near(stage)).then_some((gain, value))
        })
        .collect();
    proven.sort_by(|a, b| b.0.total_cmp(&a.0));
    proven.truncate(COMBINED);
    // In the table's order, which is the names'.
    let place = |value: &Value| (space.values.iter()).position(|v| std::ptr::eq(v, value));
    proven.sort_by_key(|(_, value)| place(value));
    let mut found: Vec<(f64, Vec<Setting>)> = (1_u32..1 << proven.len())
        .filter(|set| (at_least..=AT_ONCE).contains(&(set.count_ones() as usize)))
        .filter_map(|set| {
            let chosen: Vec<_> = (proven.iter().enumerate())
                .filter(|(bit, _)| set >> bit & 1 == 1)
                .map(|(_, proven)| proven)
                .collect();
            let clash = chosen.iter().enumerate().any(|(i, (_, value))| {
                (chosen[..i].iter()).any(|(_, other)| !value.goes_with(other))
            });
            let gain = chosen.iter().map(|(gain, _)| gain).sum();
            let settings = chosen.iter().map(|(_, value)| value.setting()).collect();
            (!clash).then_some((gain, settings))
        })
        .collect();
    found.sort_by(|a, b| b.0.total_cmp(&a.0));
    found.truncate(FIRST_RUNG);
    found.into_iter().map(|(_, settings)| settings).collect()
}

/// How much better a point is than what the same seconds buy by turning the stage's
/// baseline alone, in dB of PSNR or in ΔE00.
fn gain(points: &[Point], point: &Point) -> Option<f64> {
    let measure = decisive(point.stage);
    let mut curve: Vec<[f64; 2]> = (points.iter())
        .filter(|p| p.stage == point.stage)
        .filter(|p| p.settings.iter().all(|s| s.knob == baseline(p.stage)))
        .filter_map(|p| Some([p.seconds()?.ln(), p.merit(measure)?]))
        .collect();
    curve.sort_by(|a, b| a[0].total_cmp(&b[0]));
    Some(point.merit(measure)? - on_curve(&curve, point.seconds()?.ln())?)
}

/// A value between places in ascending order; beyond the first along the first piece,
/// since less time is never for free, and beyond the last the last.
fn on_curve(curve: &[[f64; 2]], x: f64) -> Option<f64> {
    let last = curve.last()?;
    let piece = curve.windows(2).find(|pair| x < pair[1][0]);
    Some(match piece {
        Some([a, b]) => a[1] + (x - a[0]) * (b[1] - a[1]) / (b[0] - a[0]).max(1e-9),
        _ => last[1],
    })
}

/// What decides about a stage's points while it is searched. Where photos are gray,
/// nothing does for colors, and single knobs are all that is tried.
fn decisive(stage: PointStage) -> Measure {
    Measure::of(stage)[0]
}

fn baseline(stage: PointStage) -> &'static str {
    match stage {
        PointStage::Luma => BASELINE_OF_LUMA,
        PointStage::Color => BASELINE_OF_COLOR,
    }
}

/// A value that lies so little below the baseline's curve may still help others: below
/// what anybody sees, in dB and in ΔE00.
fn near(stage: PointStage) -> f64 {
    match stage {
        PointStage::Luma => 0.1,
        PointStage::Color => 0.05,
    }
}

/// A point of phase 2, unless it is there already.
fn new(space: &Space, points: &[Point], stage: PointStage, settings: &[Setting]) -> Option<Task> {
    let known = find(points, &name(stage, settings)).is_some();
    (!known).then(|| task(space, points, stage, Phase::Front, settings))
}

fn task(
    space: &Space,
    points: &[Point],
    stage: PointStage,
    phase: Phase,
    settings: &[Setting],
) -> Task {
    let base = phase == Phase::Base;
    Task {
        name: name(stage, settings),
        stage,
        phase,
        settings: settings.to_vec(),
        expected: (!base)
            .then(|| expected(space, points, stage, settings))
            .flatten(),
    }
}
