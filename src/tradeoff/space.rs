//! What a sweep may try.

use super::report::{Phase, Point, PointStage, Setting};

/// A knob's value.
#[derive(Clone, Debug)]
pub(super) struct Value {
    /// Name of the setting, as for `--knobs`.
    pub knob: &'static str,
    /// Value of the setting, as on the command line.
    pub value: String,
    /// The stage it belongs to.
    pub stage: PointStage,
    /// The stage's time with it over the base's, as long as nothing was measured.
    pub time: f64,
    /// Knobs that cannot be turned with it.
    pub conflicts: &'static [&'static str],
}

impl Value {
    /// As a point has it.
    pub fn setting(&self) -> Setting {
        Setting {
            knob: self.knob.to_owned(),
            value: self.value.clone(),
        }
    }

    /// Whether both may be set.
    pub fn goes_with(&self, other: &Self) -> bool {
        self.knob != other.knob && !self.conflicts.contains(&other.knob)
    }
}

/// Everything a sweep may try.
#[derive(Clone, Debug, Default)]
pub(super) struct Space {
    /// All values of all knobs.
    pub values: Vec<Value>,
    /// Iterations of the base.
    pub iterations: usize,
    /// Whether there is a teacher.
    pub color: bool,
}

/// A point to run.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Task {
    /// Its name, which the settings determine.
    pub name: String,
    /// Its stage.
    pub stage: PointStage,
    /// Phase of the sweep that wants it.
    pub phase: Phase,
    /// What differs from the base.
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

/// The name of these settings of a stage: a folder's name on any system.
pub(super) fn name(stage: PointStage, settings: &[Setting]) -> String {
    let words = settings
        .iter()
        .map(|setting| format!("{}-{}", setting.knob, setting.value));
    let name = words.collect::<Vec<_>>().join("+");
    if name.is_empty() {
        base_name(stage).to_owned()
    } else {
        name
    }
}

/// The point of that name.
pub(super) fn find<'a>(points: &'a [Point], name: &str) -> Option<&'a Point> {
    points.iter().find(|point| point.name == name)
}

/// Wall seconds that a point with these settings should take: what the base took, its
/// stage's part of it times the factor of each setting. A factor is what turning that
/// knob alone made of the time, or a guess where that is not known.
pub(super) fn expected(
    space: &Space,
    points: &[Point],
    stage: PointStage,
    settings: &[Setting],
) -> Option<f64> {
    let base = find(points, base_name(stage))?;
    let own = stage_seconds(base)?;
    let factors = settings
        .iter()
        .map(|setting| factor(space, points, stage, own, setting));
    // Only the base, and whoever sees photos at another size, asks the teacher.
    let asks = settings
        .iter()
        .any(|setting| setting.knob == "teacher-size");
    let saved = match (stage, &base.outcome) {
        (PointStage::Color, Some(outcome)) if !asks => outcome.seconds.teacher,
        _ => 0.0,
    };
    Some((base.took - own - saved).max(0.0) + own * factors.product::<f64>())
}

fn factor(space: &Space, points: &[Point], stage: PointStage, base: f64, turned: &Setting) -> f64 {
    let alone = name(stage, std::slice::from_ref(turned));
    if let Some(seconds) = find(points, &alone).and_then(stage_seconds) {
        return seconds / base.max(1e-9);
    }
    let known = |value: &&Value| value.knob == turned.knob && value.value == turned.value;
    let guess = space.values.iter().find(known).map(|value| value.time);
    guess.unwrap_or_else(|| {
        // A rung's number of iterations, which need not be among the values.
        let count: f64 = turned.value.parse().unwrap_or(space.iterations as f64);
        count / space.iterations.max(1) as f64
    })
}

/// The seconds of a point that its knobs change.
fn stage_seconds(point: &Point) -> Option<f64> {
    let seconds = point.outcome.as_ref()?.seconds;
    Some(match point.stage {
        PointStage::Luma => seconds.train,
        PointStage::Color => seconds.distill,
    })
}
