//! Knobs of a sweep, and their range around the base.

use super::sweep::{PointStage, Setting};
use crate::report::{ChromaReport, Report};

/// Smaller photos, on which signs are found first, have half the side and a quarter of the
/// Gaussians, but no fewer pixels along a side than this.
const SMALL_SIDE: f64 = 100.0;

/// Their knobs.
const MAX_SIDE: &str = "max-side";
const MAX_SPLATS: &str = "max-splats";

/// An option of `fit` or `colorize` that trades quality for time by a count of something.
pub(super) struct Knob {
    /// Name in tables and for `--knobs`.
    pub name: &'static str,
    /// The stage whose time and quality it changes.
    pub stage: PointStage,
    option: &'static str,
    /// The base's count; 0 without.
    count: fn(&Base) -> f64,
    /// Least and largest count.
    range: fn(&Base) -> [f64; 2],
    /// Counts to try over the base's. Fewer iterations are on the base's curve.
    factors: &'static [f64],
    /// What the option's value is less than the count.
    less: f64,
    /// Power of the count that the work goes by: 2 for a picture's side.
    power: f64,
    /// Share of the stage's time that goes by this work.
    share: f64,
    /// Range of what twice the work changed, in dB of luma's error or of that between views.
    pub spread: f64,
}

/// A value of a knob.
#[derive(Clone)]
pub(super) struct Value {
    pub knob: &'static Knob,
    /// As a point has them.
    pub settings: Vec<Setting>,
    /// True if it is compared with the base's settings on smaller photos.
    pub small: bool,
    /// How many times the work doubles from what it is compared with.
    pub doublings: f64,
}

impl Value {
    /// Expected time over that of what it is compared with.
    pub fn time(&self) -> f64 {
        let time = 1.0 - self.knob.share + self.knob.share * self.doublings.exp2();
        // Smaller photos have as much fewer Gaussians.
        let both = self.settings.len() > 1 && !self.small;
        if both { time * time } else { time }
    }
}

/// The base, around which knobs are turned.
pub(super) struct Base {
    /// Its report; that of the colored base, once there is one.
    pub report: Report,
    /// Longer side of the largest photo, in pixels.
    pub largest_side: u32,
}

impl Base {
    /// Longer side at which photos are seen, in pixels.
    pub fn side(&self) -> u32 {
        let limit = self.report.capture.load.max_side;
        limit.map_or(self.largest_side, |side| side.min(self.largest_side))
    }

    /// Most Gaussians that make a difference: a cap that is not reached does nothing when it is
    /// raised.
    fn most_splats(&self) -> f64 {
        let luma = &self.report.luma;
        let reached = luma.splats as f64 > 0.9 * luma.settings.max_splats as f64;
        if reached {
            f64::MAX
        } else {
            luma.splats as f64
        }
    }

    fn color(&self, count: impl Fn(&ChromaReport) -> Option<f64>) -> f64 {
        self.report.chroma.as_ref().and_then(count).unwrap_or(0.0)
    }
}

/// What most knobs have in common.
const PLAIN: Knob = Knob {
    name: "",
    stage: PointStage::Luma,
    option: "",
    count: |_| 0.0,
    range: |_| [1.0, f64::MAX],
    factors: &[],
    less: 0.0,
    power: 1.0,
    share: 0.0,
    spread: 0.0,
};

/// Harmonics up to a degree are counted along a side of their square.
const DEGREES: fn(&Base) -> [f64; 2] = |_| [1.0, 4.0];

/// The knobs of both stages.
pub(super) static KNOBS: [Knob; 6] = [
    Knob {
        name: "iterations",
        option: "--iterations",
        count: |base| base.report.luma.iterations as f64,
        factors: &[2.0, 4.0],
        share: 1.0,
        spread: 2.2,
        ..PLAIN
    },
    Knob {
        name: MAX_SIDE,
        option: "--max-side",
        count: |base| f64::from(base.side()),
        // No less than `fit` accepts.
        range: |base| [16.0, f64::from(base.largest_side)],
        factors: &[0.75, 1.5, 0.5],
        power: 2.0,
        share: 0.5,
        spread: 2.5,
        ..PLAIN
    },
    Knob {
        name: MAX_SPLATS,
        option: "--max-splats",
        count: |base| base.report.luma.splats as f64,
        range: |base| [1.0, base.most_splats()],
        factors: &[0.5, 0.25, 2.0],
        share: 0.5,
        spread: 1.7,
        ..PLAIN
    },
    Knob {
        name: "rounds",
        stage: PointStage::Color,
        option: "--rounds",
        count: |base| base.color(|chroma| Some(chroma.iterations as f64)),
        factors: &[0.5, 2.0, 0.25],
        share: 0.5,
        spread: 0.8,
        ..PLAIN
    },
    Knob {
        name: "chroma-degree",
        stage: PointStage::Color,
        option: "--sh-degree",
        count: |base| base.color(|chroma| Some(f64::from(chroma.settings.sh_degree) + 1.0)),
        range: DEGREES,
        factors: &[2.0, 3.0],
        less: 1.0,
        power: 2.0,
        share: 0.05,
        spread: 1.4,
    },
    Knob {
        name: "teacher-size",
        stage: PointStage::Color,
        option: "--teacher-size",
        count: |base| {
            base.color(|chroma| {
                let size = chroma.teachers.first()?.info.input_size?;
                Some(f64::from(size[0].min(size[1])))
            })
        },
        factors: &[0.5, 1.5],
        power: 2.0,
        share: 0.2,
        spread: 0.7,
        ..PLAIN
    },
];

pub fn knob_names() -> Vec<&'static str> {
    KNOBS.iter().map(|knob| knob.name).collect()
}

impl Knob {
    /// Values to try, and where the sign carries over the same compared with `small`.
    fn values(&'static self, base: &Base, small: Option<&Value>) -> Vec<Value> {
        let (count, [least, most]) = ((self.count)(base), (self.range)(base));
        let mut values: Vec<Value> = Vec::new();
        for factor in self.factors {
            let wanted = (count * factor).round().max(1.0);
            let doublings = self.power * (wanted / count).log2();
            let known = values.iter().any(|value| value.doublings == doublings);
            if count == 0.0 || wanted == count || known || !(least..=most).contains(&wanted) {
                continue;
            }
            let value = Value {
                knob: self,
                settings: vec![setting(self.name, wanted - self.less)],
                small: false,
                doublings,
            };
            // The sign is that on smaller photos.
            if let Some(small) = small.filter(|_| self.name == MAX_SPLATS) {
                let count = setting(MAX_SPLATS, (wanted / 4.0).ceil());
                values.push(Value {
                    settings: vec![small.settings[0].clone(), count],
                    small: true,
                    ..value.clone()
                });
            }
            values.push(value);
        }
        values
    }
}

/// All values to try of the knobs that `wanted` names, or of all where it names none.
pub(super) fn values(base: &Base, wanted: &[String]) -> Vec<Value> {
    let side = (f64::from(base.side()) / 2.0).floor();
    let splats = (base.report.luma.splats as f64 / 4.0).ceil();
    let small = Value {
        knob: &KNOBS[1],
        settings: vec![setting(MAX_SIDE, side), setting(MAX_SPLATS, splats)],
        small: false,
        doublings: -2.0,
    };
    let small = (side >= SMALL_SIDE).then_some(&small);
    let chosen = KNOBS
        .iter()
        .filter(|knob| wanted.is_empty() || wanted.iter().any(|name| name == knob.name));
    let values = chosen.flat_map(|knob| knob.values(base, small));
    let mut values: Vec<Value> = values.collect();
    if values.iter().any(|value| value.small) {
        values.extend(small.cloned());
    }
    values
}

/// The options that settings stand for, each with its value.
pub(super) fn options(settings: &[Setting]) -> impl Iterator<Item = [&str; 2]> {
    settings.iter().filter_map(|setting| {
        let knob = KNOBS.iter().find(|knob| knob.name == setting.knob)?;
        Some([knob.option, &setting.value])
    })
}

fn setting(knob: &str, value: f64) -> Setting {
    Setting {
        knob: knob.to_owned(),
        value: value.to_string(),
    }
}
