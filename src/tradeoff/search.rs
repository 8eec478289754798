//! Choice of the next point: the bases, then what should tell most for its seconds.
//!
//! Everything follows from the points that are there and the seconds that are left, so
//! that a sweep that goes on asks for what one without a break would have asked for.

use super::{
    knobs::Value,
    sweep::{PointStage, Setting, Tradeoff},
};

/// Share of what a value tells that smaller photos tell: the sign.
const SIGN: f64 = 0.5;

/// Share that is left where another value has told in which direction quality goes.
const KNOWN: f64 = 0.25;

/// A point to run.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Task {
    /// Its name, which the settings determine.
    pub name: String,
    pub stage: PointStage,
    /// Settings that differ from the base.
    pub settings: Vec<Setting>,
    /// Wall seconds that it should take; `None` for a base, which runs anyway.
    pub expected: Option<f64>,
    /// Range of what it may show, in dB.
    pub information: f64,
}

impl Task {
    /// Information per expected second.
    fn rate(&self) -> f64 {
        self.information / self.expected.unwrap_or_default().max(1e-9)
    }
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
    for stage in &PointStage::ALL[..1 + usize::from(color)] {
        match sweep.base(*stage) {
            None => {
                return Some(Task {
                    name: base_name(*stage).to_owned(),
                    stage: *stage,
                    settings: Vec::new(),
                    expected: None,
                    information: 0.0,
                });
            }
            // Neither the other stage nor any knob has anything to start from.
            Some(base) => base.outcome.as_ref()?,
        };
    }
    let tasks = values.iter().filter_map(|value| task(value, values, sweep));
    most_telling(tasks, sweep.limit() - sweep.spent())
}

/// The one with the most information per second of those that take no longer than `left`; of
/// equal ones the first.
fn most_telling(tasks: impl Iterator<Item = Task>, left: f64) -> Option<Task> {
    let fitting = tasks.filter(|task| task.information > 0.0 && task.expected <= Some(left));
    // `max_by` would take the last.
    fitting.min_by(|a, b| b.rate().total_cmp(&a.rate()))
}

/// What trying a value would tell and take; `None` if it has been tried or what it is compared
/// with has not.
fn task(value: &Value, values: &[Value], sweep: &Tradeoff) -> Option<Task> {
    let name = name(&value.settings);
    let with = match value.small {
        true => sweep.small()?,
        false => sweep.base(value.knob.stage)?,
    };
    let outcome = with.outcome.as_ref()?;
    // Only the base, and whoever sees photos at another size, asks the teacher.
    let asks = value.knob.name == "teacher-size";
    let asking = if asks { 0.0 } else { outcome.teacher_seconds };
    let known = values.iter().filter(|other| {
        let point = sweep.find(&self::name(&other.settings));
        other.knob.name == value.knob.name && point.is_some_and(|point| point.outcome.is_some())
    });
    let known: Vec<&Value> = known.collect();
    let same_way = |other: &&Value| (other.doublings < 0.0) == (value.doublings < 0.0);
    let told = known.iter().any(same_way).then_some(KNOWN);
    let share = told.unwrap_or(1.0) * if value.small { SIGN } else { 1.0 };
    // A value farther away than a doubling tells little more; full photos tell about smaller ones.
    let alike = known.iter().filter(|other| value.small || !other.small);
    let news = alike
        .map(|other| (other.doublings - value.doublings).abs())
        .fold(value.doublings.abs().min(1.0), f64::min);
    sweep.find(&name).is_none().then(|| Task {
        name,
        stage: value.knob.stage,
        settings: value.settings.clone(),
        expected: Some((with.took - asking) * value.time()),
        information: share * value.knob.spread * news,
    })
}

/// The name of these settings: a folder's name on any system.
fn name(settings: &[Setting]) -> String {
    let words: Vec<String> = (settings.iter())
        .map(|setting| format!("{}-{}", setting.knob, setting.value))
        .collect();
    words.join("+")
}

#[cfg(test)]
mod tests {
    use super::super::{
        fixtures,
        knobs::KNOBS,
        sweep::{Outcome, SweepPoint},
    };
    use super::*;

    /// Knobs with a value and how many times its work doubles.
    const VALUES: [(&str, &str, f64); 8] = [
        ("iterations", "1400", 1.0),
        ("max-splats", "500", -1.0),
        ("max-splats", "small", -1.0),
        ("max-splats", "250", -2.0),
        ("max-side", "160", -2.0),
        ("chroma-degree", "1", 2.0),
        ("rounds", "2", -1.0),
        ("teacher-size", "128", -2.0),
    ];

    fn values() -> Vec<Value> {
        let setting = |knob: &str, value: &str| Setting {
            knob: knob.to_owned(),
            value: value.to_owned(),
        };
        let value = |&(knob, value, doublings): &(&str, &str, f64)| {
            let mut settings = vec![setting(knob, value)];
            // With fewer Gaussians, and what is tried there.
            settings.extend((knob == "max-side").then(|| setting("max-splats", "9")));
            let small = value == "small";
            if small {
                settings.insert(0, setting("max-side", "160"));
            }
            Value {
                knob: KNOBS.iter().find(|k| k.name == knob).expect("a knob"),
                settings,
                small,
                doublings,
            }
        };
        VALUES.iter().map(value).collect()
    }

    /// Result of a task that takes as long as it should, of a base 40 seconds.
    fn run(task: &Task) -> SweepPoint {
        SweepPoint {
            stage: task.stage,
            settings: task.settings.clone(),
            took: task.expected.unwrap_or(40.0),
            failed: None,
            outcome: Some(Outcome::default()),
            ..fixtures::failed(&task.name, "")
        }
    }

    /// A whole sweep from points that are there.
    fn swept(points: Vec<SweepPoint>, budget: Option<f64>) -> Tradeoff {
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

    #[test]
    fn most_information_per_second_goes_first_if_it_fits() {
        let task = |name: &str, information, seconds| Task {
            name: name.to_owned(),
            stage: PointStage::Luma,
            settings: Vec::new(),
            expected: Some(seconds),
            information,
        };
        let mut left = vec![
            task("dear", 9.0, 100.0),
            task("cheap", 0.1, 1.0),
            task("telling", 3.0, 20.0),
            task("as telling", 3.0, 20.0),
            task("nothing", 0.0, 0.1),
        ];
        for expected in ["telling", "as telling", "cheap"] {
            let next = most_telling(left.clone().into_iter(), 50.0).expect("a task");
            assert_eq!(next.name, expected);
            left.retain(|task| task.name != next.name);
        }
        assert_eq!(most_telling(left.into_iter(), 50.0), None);
    }

    /// The sign of `max-splats` comes from smaller photos, once these are known; other values tell
    /// less then. The budget is four times the bases'.
    #[test]
    fn bases_then_what_tells_most_for_its_seconds() {
        let order = [
            "base",
            "color",
            "max-side-160+max-splats-9",
            "max-side-160+max-splats-small",
            "chroma-degree-1",
            "iterations-1400",
            "rounds-2",
            "teacher-size-128",
            "max-splats-250",
            "max-splats-500",
        ];
        assert_eq!(names(&swept(Vec::new(), Some(1e5))), order);
        let sweep = swept(Vec::new(), None);
        assert_eq!(sweep.limit(), 320.0);
        assert!(sweep.spent() <= 320.0 && sweep.points.len() > 7);
        for budget in [1.0, 100.0, 200.0] {
            let spent = swept(Vec::new(), Some(budget)).spent();
            assert!(spent <= budget.max(80.0), "{spent} of {budget}");
        }
    }

    /// Stopped after any point, a sweep asks for the same points as without a break.
    #[test]
    fn a_sweep_that_goes_on_asks_for_the_same() {
        let whole = swept(Vec::new(), Some(300.0));
        for stop in 0..whole.points.len() {
            let resumed = swept(whole.points[..stop].to_vec(), Some(300.0));
            assert_eq!(names(&resumed), names(&whole), "after {stop}");
        }
    }

    #[test]
    fn what_failed_is_not_asked_again_and_nothing_follows_a_base_that_did() {
        let mut sweep = swept(Vec::new(), Some(1e5));
        for point in &mut sweep.points[2..] {
            point.outcome = None;
        }
        assert_eq!(next(&values(), &sweep, true), None);
        sweep.points.truncate(1);
        sweep.points[0].outcome = None;
        assert_eq!(next(&values(), &sweep, true), None);
    }
}
