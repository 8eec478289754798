//! Choice of the next point: the bases, every setting alone, then pairs of settings that alone are
//! on the front by now, the cheapest first.
//!
//! Everything follows from the points that are there and the seconds that are left, so
//! that a sweep that goes on asks for what one without a break would have asked for.

use super::knobs::{PRESET, Value};
use super::sweep::{Phase, PointStage, Setting, Tradeoff};

/// A point to run.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Task {
    /// Its name, which the settings determine.
    pub name: String,
    pub stage: PointStage,
    /// Phase of the sweep that wants it.
    pub phase: Phase,
    /// Settings that differ from the base.
    pub settings: Vec<Setting>,
    /// Wall seconds that it should take; `None` for a base, which runs anyway.
    pub expected: Option<f64>,
}

/// The base's name in each stage.
pub(super) fn base_name(stage: PointStage) -> &'static str {
    match stage {
        PointStage::Luma => "base",
        PointStage::Color => "color",
    }
}

/// The next point of a sweep, with a teacher in color too; none when all is done or nothing
/// that is left fits into its budget.
pub(super) fn next(values: &[Value], sweep: &Tradeoff, color: bool) -> Option<Task> {
    let stages = &PointStage::ALL[..1 + usize::from(color)];
    for &stage in stages {
        match sweep.base(stage) {
            None => {
                return Some(Task {
                    name: base_name(stage).to_owned(),
                    stage,
                    phase: Phase::Base,
                    settings: Vec::new(),
                    expected: None,
                });
            }
            // Neither the other stage nor any knob has anything to start from.
            Some(base) => base.outcome.as_ref()?,
        };
    }
    let singles = values
        .iter()
        .map(|value| (value.stage, vec![&value.setting]));
    let pairs = stages.iter().flat_map(|&stage| pairs(values, sweep, stage));
    cheapest(values, sweep, Phase::One, singles)
        .or_else(|| cheapest(values, sweep, Phase::Front, pairs))
}

/// The untried choice with the least expected time, if it fits the budget.
fn cheapest<'a>(
    values: &[Value],
    sweep: &Tradeoff,
    phase: Phase,
    choices: impl Iterator<Item = (PointStage, Vec<&'a Setting>)>,
) -> Option<Task> {
    let left = sweep.budget - sweep.spent();
    let tasks = choices.filter_map(|(stage, settings)| {
        let seconds = expected(values, sweep, stage, &settings)?;
        let name = name(&settings);
        let fits = seconds <= left && sweep.find(&name).is_none();
        fits.then(|| Task {
            name,
            stage,
            phase,
            settings: settings.into_iter().cloned().collect(),
            expected: Some(seconds),
        })
    });
    // Of several that take the same, `min_by` keeps the first.
    let seconds = |task: &Task| task.expected.unwrap_or(0.0);
    tasks.min_by(|a, b| seconds(a).total_cmp(&seconds(b)))
}

/// Pairs of settings that alone are on a stage's front.
fn pairs<'a>(
    values: &'a [Value],
    sweep: &Tradeoff,
    stage: PointStage,
) -> Vec<(PointStage, Vec<&'a Setting>)> {
    let front = sweep.best(stage);
    let on_front = |setting: &&Setting| {
        let name = name(&[*setting]);
        setting.knob != PRESET && front.iter().any(|point| point.name == name)
    };
    // In the table's order, which is the names'.
    let proven = values.iter().filter(|value| value.stage == stage);
    let proven: Vec<&Setting> = proven
        .map(|value| &value.setting)
        .filter(on_front)
        .collect();
    let mut pairs = Vec::new();
    for (place, &second) in proven.iter().enumerate() {
        let firsts = proven[..place].iter();
        for &first in firsts.filter(|first| first.knob != second.knob) {
            pairs.push((stage, vec![first, second]));
        }
    }
    pairs
}

/// The name of these settings: a folder's name on any system.
fn name(settings: &[&Setting]) -> String {
    let words: Vec<String> = (settings.iter())
        .map(|setting| format!("{}-{}", setting.knob, setting.value))
        .collect();
    words.join("+")
}

/// Wall seconds that a point with these settings should take: what the base took times the
/// factor of each, which is what it made of the time alone, or a guess before that is known.
fn expected(
    values: &[Value],
    sweep: &Tradeoff,
    stage: PointStage,
    settings: &[&Setting],
) -> Option<f64> {
    let base = sweep.base(stage)?;
    // Only the base, and whoever sees photos at another size, asks the teacher.
    let asks = settings
        .iter()
        .any(|setting| setting.knob == "teacher-size");
    let asking = base
        .outcome
        .as_ref()
        .map_or(0.0, |outcome| outcome.teacher_seconds);
    let took = base.took - if asks { 0.0 } else { asking };
    let factors = settings.iter().map(|&setting| {
        let alone = sweep.find(&name(&[setting]));
        let alone = alone.filter(|point| point.outcome.is_some());
        let guess = values.iter().find(|value| value.setting == *setting);
        let guess = guess.map_or(1.0, |value| value.time);
        alone.map_or(guess, |point| point.took / took.max(1e-9))
    });
    Some(took * factors.product::<f64>())
}

#[cfg(test)]
mod tests {
    use super::super::{
        fixtures,
        sweep::{Outcome, SweepPoint},
    };
    use super::*;

    /// A value with what it changes: the stage's time, and quality in dB or ΔE00.
    type Effect = (PointStage, &'static str, &'static str, f64, f64);

    const EFFECTS: [Effect; 8] = [
        (PointStage::Luma, "iterations", "350", 0.5, -1.0),
        (PointStage::Luma, "iterations", "1400", 2.0, 1.0),
        (PointStage::Luma, "preset", "paper", 1.9, 0.9),
        (PointStage::Luma, "max-splats", "500", 0.6, -0.1),
        (PointStage::Luma, "sh-degree", "3", 2.5, -0.5),
        (PointStage::Color, "rounds", "2", 0.5, 0.5),
        (PointStage::Color, "chroma-degree", "1", 1.2, -0.2),
        (PointStage::Color, "teacher-size", "128", 0.8, 0.4),
    ];

    fn values() -> Vec<Value> {
        let value = |&(stage, knob, value, time, _): &Effect| Value {
            stage,
            time,
            setting: Setting {
                knob: knob.to_owned(),
                value: value.to_owned(),
            },
        };
        EFFECTS.iter().map(value).collect()
    }

    /// Simulated result of a task.
    fn run(task: &Task) -> SweepPoint {
        let (mut seconds, mut quality) = (40.0, 0.0);
        for setting in &task.settings {
            let known = EFFECTS
                .iter()
                .find(|e| e.1 == setting.knob && e.2 == setting.value);
            let (_, _, _, time, change) = known.expect("a value");
            (seconds, quality) = (seconds * time, quality + change);
        }
        let color = task.stage == PointStage::Color;
        SweepPoint {
            name: task.name.clone(),
            stage: task.stage,
            phase: task.phase,
            settings: task.settings.clone(),
            took: seconds,
            failed: None,
            outcome: Some(Outcome {
                seconds,
                psnr: (!color).then_some(24.0 + quality),
                delta_e: color.then_some(10.0 + quality),
                ..Outcome::default()
            }),
            ..fixtures::failed("", "")
        }
    }

    /// A whole sweep from points that are there.
    fn swept(points: Vec<SweepPoint>, budget: f64) -> Tradeoff {
        let mut sweep = fixtures::sweep(points);
        sweep.budget = budget;
        while let Some(task) = next(&values(), &sweep, true) {
            assert!(sweep.find(&task.name).is_none(), "{task:?} again");
            sweep.points.push(run(&task));
        }
        sweep
    }

    fn names(sweep: &Tradeoff) -> Vec<&str> {
        sweep.points.iter().map(|point| &point.name[..]).collect()
    }

    const PLENTY: f64 = 1e5;

    /// `teacher-size` leaves the front when rounds and degree together beat it.
    #[test]
    fn bases_singles_then_pairs_of_the_front_each_cheapest_first() {
        assert_eq!(
            names(&swept(Vec::new(), PLENTY)),
            [
                "base",
                "color",
                "iterations-350",
                "rounds-2",
                "max-splats-500",
                "teacher-size-128",
                "chroma-degree-1",
                "preset-paper",
                "iterations-1400",
                "sh-degree-3",
                "iterations-350+max-splats-500",
                "rounds-2+teacher-size-128",
                "rounds-2+chroma-degree-1",
                "iterations-1400+max-splats-500",
            ]
        );
    }

    #[test]
    fn the_budget_is_kept_and_the_bases_run_anyway() {
        for budget in [1.0, 100.0, 200.0, 450.0, 2000.0] {
            let sweep = swept(Vec::new(), budget);
            assert!(
                sweep.spent() <= budget.max(80.0),
                "{} of {budget}",
                sweep.spent()
            );
            // The model's times are as expected, so that what is left is less than the
            // cheapest point.
            assert!(sweep.points.len() > 2 || budget < 100.0);
        }
    }

    /// Stopped after any point, a sweep asks for the same points as without a break.
    #[test]
    fn a_sweep_that_goes_on_asks_for_the_same() {
        let whole = swept(Vec::new(), 600.0);
        for stop in 0..whole.points.len() {
            let resumed = swept(whole.points[..stop].to_vec(), 600.0);
            assert_eq!(names(&resumed), names(&whole), "after {stop}");
        }
    }

    #[test]
    fn what_failed_is_not_asked_again_and_nothing_follows_a_base_that_did() {
        let mut sweep = swept(Vec::new(), PLENTY);
        let count = sweep.points.len();
        for point in &mut sweep.points[2..] {
            point.outcome = None;
        }
        assert_eq!(next(&values(), &sweep, true), None);
        assert_eq!(sweep.points.len(), count);
        sweep.points.truncate(1);
        sweep.points[0].outcome = None;
        assert_eq!(next(&values(), &sweep, true), None);
    }

    /// Times that were measured replace guesses; the teacher's answers are there.
    #[test]
    fn expectations_learn() {
        let mut sweep = swept(Vec::new(), 150.0);
        if let Some(outcome) = &mut sweep.points[1].outcome {
            outcome.teacher_seconds = 10.0;
        }
        let values = values();
        let seconds = |sweep: &Tradeoff, at: usize| {
            let value = &values[at];
            expected(&values, sweep, value.stage, &[&value.setting]).expect("a base")
        };
        assert_eq!(seconds(&sweep, 1), 80.0);
        assert_eq!([seconds(&sweep, 6), seconds(&sweep, 7)], [36.0, 32.0]);
        sweep
            .points
            .push(fixtures::luma("iterations-1400", 60.0, 25.0));
        assert!((seconds(&sweep, 1) - 60.0).abs() < 1e-9);
    }
}
