//! Knobs of a sweep, and their range around the base.

use super::sweep::{PointStage, Setting};
use crate::{
    report::{ChromaReport, Report},
    run::Preset,
};

/// Share of an iteration of stage 1 that goes by pixels and not by Gaussians: about half.
const PIXELS_SHARE: f64 = 0.5;

/// Least side in pixels that `fit` accepts.
const LEAST_SIDE: u32 = 16;

/// The knob that turns many at once, and is not turned with others.
pub(super) const PRESET: &str = "preset";

/// An option of `fit` or `colorize` that trades quality for time.
pub(super) struct Knob {
    /// Name in tables and for `--knobs`.
    pub name: &'static str,
    /// The stage whose time and quality it changes.
    pub stage: PointStage,
    pub option: &'static str,
    /// Values to try, nearest to the base first.
    values: fn(&Base) -> Vec<String>,
    /// Time with a value over the base's, as long as nothing was measured.
    time: fn(&Base, &str) -> f64,
}

/// A value of a knob.
#[derive(Clone, Debug)]
pub(super) struct Value {
    /// The stage it belongs to.
    pub stage: PointStage,
    /// As a point has it.
    pub setting: Setting,
    /// Time with it over the base's, as long as nothing was measured.
    pub time: f64,
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
        self.seen(self.report.capture.load.max_side)
    }

    fn seen(&self, max_side: Option<u32>) -> u32 {
        max_side.map_or(self.largest_side, |side| side.min(self.largest_side))
    }

    /// Work of another preset over that of the base, where the base leaves it to its own.
    fn work(&self, other: Preset) -> f64 {
        let own = self.report.preset;
        let asked = self.report.luma.settings.iterations;
        let iterations = match own.settings().iterations == asked {
            true => other.settings().iterations as f64 / asked as f64,
            false => 1.0,
        };
        let side = match self.report.capture.load.max_side == own.max_side() {
            true => f64::from(self.seen(other.max_side())) / f64::from(self.side()),
            false => 1.0,
        };
        iterations * side.powi(2)
    }

    fn color(&self, values: impl Fn(&ChromaReport) -> Vec<String>) -> Vec<String> {
        self.report.chroma.as_ref().map_or(Vec::new(), values)
    }
}

/// The knobs of both stages.
pub(super) const KNOBS: [Knob; 8] = [
    Knob {
        name: "iterations",
        stage: PointStage::Luma,
        option: "--iterations",
        values: |base| scaled(base.report.luma.iterations, &[0.5, 2.0, 0.25]),
        time: |base, value| number(value) / base.report.luma.iterations as f64,
    },
    Knob {
        name: PRESET,
        stage: PointStage::Luma,
        option: "--preset",
        values: |base| {
            let others = Preset::ALL.into_iter();
            let others = others.filter(|preset| *preset != base.report.preset);
            others.map(|preset| preset.to_string()).collect()
        },
        time: |base, value| {
            let preset = Preset::ALL
                .into_iter()
                .find(|other| other.to_string() == value);
            preset.map_or(1.0, |preset| base.work(preset))
        },
    },
    Knob {
        name: "max-side",
        stage: PointStage::Luma,
        option: "--max-side",
        values: |base| {
            let sides = f64::from(LEAST_SIDE)..=f64::from(base.largest_side);
            let scaled = scaled(base.side() as usize, &[0.75, 1.5, 0.5]).into_iter();
            scaled
                .filter(|side| sides.contains(&number(side)))
                .collect()
        },
        time: |base, value| {
            let side = number(value) / f64::from(base.side());
            1.0 - PIXELS_SHARE + PIXELS_SHARE * side.powi(2)
        },
    },
    Knob {
        name: "max-splats",
        stage: PointStage::Luma,
        option: "--max-splats",
        values: |base| {
            let luma = &base.report.luma;
            let cap = luma.settings.max_splats;
            let mut values = scaled(luma.splats.min(cap), &[0.5, 0.25]);
            // A cap that is not reached does nothing when it is raised.
            if luma.splats as f64 > 0.9 * cap as f64 {
                values.extend(scaled(cap, &[2.0]));
            }
            values
        },
        time: |base, value| {
            let splats = number(value) / base.report.luma.splats.max(1) as f64;
            PIXELS_SHARE + (1.0 - PIXELS_SHARE) * splats
        },
    },
    Knob {
        name: "sh-degree",
        stage: PointStage::Luma,
        option: "--sh-degree",
        values: |base| {
            let own = base.report.luma.settings.sh_degree;
            let others = (0..=3).filter(|degree| *degree != own);
            others.map(|degree: u32| degree.to_string()).collect()
        },
        time: |base, value| {
            let cost = |degree: f64| 1.0 + 0.05 * (degree + 1.0).powi(2);
            cost(number(value)) / cost(f64::from(base.report.luma.settings.sh_degree))
        },
    },
    Knob {
        name: "rounds",
        stage: PointStage::Color,
        option: "--rounds",
        values: |base| base.color(|chroma| scaled(chroma.iterations, &[0.5, 0.25])),
        time: |_, _| 1.0,
    },
    Knob {
        name: "chroma-degree",
        stage: PointStage::Color,
        option: "--sh-degree",
        values: |base| base.color(|_| ["1", "2"].map(str::to_owned).to_vec()),
        time: |_, value| 1.0 + 0.1 * number(value),
    },
    Knob {
        name: "teacher-size",
        stage: PointStage::Color,
        option: "--teacher-size",
        values: |base| {
            base.color(|chroma| {
                let size = chroma.teachers.first().and_then(|t| t.info.input_size);
                let size = size.map(|[width, height]| width.min(height) as usize);
                size.map_or(Vec::new(), |size| scaled(size, &[0.5, 1.5]))
            })
        },
        time: |_, _| 1.0,
    },
];

pub fn knob_names() -> [&'static str; KNOBS.len()] {
    KNOBS.map(|knob| knob.name)
}

/// All values to try of the knobs that `wanted` names, or of all where it names none.
pub(super) fn values(base: &Base, wanted: &[String]) -> Vec<Value> {
    let chosen = KNOBS
        .iter()
        .filter(|knob| wanted.is_empty() || wanted.iter().any(|name| name == knob.name));
    let values = chosen.flat_map(|knob| {
        let values = (knob.values)(base).into_iter();
        values.map(|value| Value {
            stage: knob.stage,
            time: (knob.time)(base, &value),
            setting: Setting {
                knob: knob.name.to_owned(),
                value,
            },
        })
    });
    values.collect()
}

/// The options that settings stand for, each with its value.
pub(super) fn options(settings: &[Setting]) -> impl Iterator<Item = [&str; 2]> {
    settings.iter().filter_map(|setting| {
        let knob = KNOBS.iter().find(|knob| knob.name == setting.knob)?;
        Some([knob.option, &setting.value])
    })
}

/// These multiples of a count, rounded, without the count itself and without repeats.
fn scaled(count: usize, factors: &[f64]) -> Vec<String> {
    let mut values: Vec<String> = Vec::new();
    for factor in factors {
        let value = ((count as f64 * factor).round() as usize)
            .max(1)
            .to_string();
        if value != count.to_string() && !values.contains(&value) {
            values.push(value);
        }
    }
    values
}

/// The values of this table are numbers wherever one is needed.
fn number(value: &str) -> f64 {
    value.parse().unwrap_or(0.0)
}
