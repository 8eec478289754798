//! What can be turned, and how far around the preset.

use std::collections::HashSet;

use super::{
    around::{Around, PIXELS_SHARE},
    report::{PointStage, Setting},
    space::Value,
};
use crate::{luma::LumaSettings, run::Preset};

/// An option of `fit` or `colorize` and its value.
pub(super) type Given = (&'static str, Option<String>);

/// What turning a knob to a value changes.
enum Turn {
    /// The settings of luma.
    Luma(fn(&mut LumaSettings, &str)),
    /// What one option says of `fit` or `colorize`.
    Option(&'static str),
    /// What several options say.
    Options(fn(&str) -> Vec<Given>),
}

/// Something that trades quality for time.
pub(super) struct Knob {
    /// Name in tables and on the command line.
    pub name: &'static str,
    /// The stage whose time and quality it changes.
    pub stage: PointStage,
    /// Values to try, nearest to the base first.
    values: fn(&Around) -> Vec<String>,
    /// What a value stands for.
    turn: Turn,
    /// The stage's time at a value over the base's, as long as nothing was measured.
    time: fn(&Around, &str) -> f64,
    /// Knobs that cannot be turned with it.
    conflicts: &'static [&'static str],
}

/// The knobs of both stages.
const KNOBS: &[Knob] = &[
    Knob {
        name: BASELINE_OF_LUMA,
        stage: PointStage::Luma,
        values: |around| scaled(around.iterations, &[0.5, 2.0, 0.25]),
        turn: Turn::Luma(|settings, value| {
            settings.iterations = number(value) as usize;
            // All of them.
            settings.stop_when_flat = None;
        }),
        time: |around, value| number(value) / around.iterations as f64,
        conflicts: &[],
    },
    Knob {
        name: PRESET,
        stage: PointStage::Luma,
        values: |around| {
            around
                .presets
                .iter()
                .map(|(name, _)| (*name).to_owned())
                .collect()
        },
        turn: Turn::Option("--preset"),
        time: |around, value| {
            let known = around.presets.iter().find(|(name, _)| *name == value);
            known.map_or(1.0, |(_, work)| *work)
        },
        conflicts: &[],
    },
    Knob {
        name: "max-side",
        stage: PointStage::Luma,
        values: |around| {
            let fits = |side: &String| number(side) <= f64::from(around.largest_side);
            let sides = scaled(around.side as usize, &[0.75, 1.5, 0.5]);
            let readable = |side: &String| number(side) >= f64::from(LEAST_SIDE);
            sides.into_iter().filter(fits).filter(readable).collect()
        },
        turn: Turn::Option("--max-side"),
        time: |around, value| {
            let side = number(value) / f64::from(around.side);
            1.0 - PIXELS_SHARE + PIXELS_SHARE * side.powi(2)
        },
        conflicts: &[],
    },
    Knob {
        name: "max-splats",
        stage: PointStage::Luma,
        values: |around| {
            let cap = around.luma.max_splats;
            let mut values = scaled(around.splats.min(cap), &[0.5, 0.25]);
            // A cap that is not reached does nothing when it is raised.
            if around.reaches_cap() {
                values.extend(scaled(cap, &[2.0]));
            }
            values
        },
        turn: Turn::Luma(|settings, value| settings.max_splats = number(value) as usize),
        time: |around, value| {
            let splats = number(value) / around.splats.max(1) as f64;
            PIXELS_SHARE + (1.0 - PIXELS_SHARE) * splats
        },
        conflicts: &[],
    },
    Knob {
        name: "sh-degree",
        stage: PointStage::Luma,
        values: |around| others(&["0", "1", "2", "3"], &around.luma.sh_degree.to_string()),
        turn: Turn::Option("--sh-degree"),
        time: |around, value| {
            let cost = |degree: f64| 1.0 + 0.05 * (degree + 1.0).powi(2);
            cost(number(value)) / cost(f64::from(around.luma.sh_degree))
        },
        conflicts: &[],
    },
    Knob {
        name: "solver",
        stage: PointStage::Color,
        values: |around| around.of_color(|_| owned(&["adam"])),
        turn: Turn::Option("--solver"),
        time: |_, _| 1.0,
        conflicts: &["rounds", "until", "scales", "correct-views"],
    },
    Knob {
        name: BASELINE_OF_COLOR,
        stage: PointStage::Color,
        values: |around| around.of_color(|color| scaled(color.rounds, &[0.5, 0.25])),
        turn: Turn::Option("--rounds"),
        time: |around, value| {
            let rounds = around.color.as_ref().map_or(1, |color| color.rounds);
            number(value) / rounds.max(1) as f64
        },
        conflicts: &["solver", "until", "scales"],
    },
    Knob {
        name: "until",
        stage: PointStage::Color,
        values: |around| {
            around.of_color(|_| {
                let iterations = scaled(around.adam, &[0.5, 2.0]);
                let until = |n: &String| (number(n) as usize + around.iterations).to_string();
                iterations.iter().map(until).collect()
            })
        },
        // Only Adam counts iterations.
        turn: Turn::Options(|value| {
            let given = |option, value: &str| (option, Some(value.to_owned()));
            vec![given("--solver", "adam"), given("--until", value)]
        }),
        time: |around, value| {
            (number(value) - around.iterations as f64) / around.adam.max(1) as f64
        },
        conflicts: &["solver", "rounds", "correct-views"],
    },
    Knob {
        name: "scales",
        stage: PointStage::Color,
        values: |around| around.of_color(|_| owned(&["1", "2"])),
        // Only Adam agrees between scales.
        turn: Turn::Options(|value| {
            let solver = ("--solver", Some("adam".to_owned()));
            vec![solver, ("--scales", Some(value.to_owned()))]
        }),
        time: |_, value| 1.0 + 0.25 * number(value),
        conflicts: &["solver", "rounds", "correct-views"],
    },
    Knob {
        name: "chroma-degree",
        stage: PointStage::Color,
        values: |around| around.of_color(|_| owned(&["1", "2"])),
        turn: Turn::Option("--sh-degree"),
        time: |_, value| 1.0 + 0.1 * number(value),
        conflicts: &[],
    },
    Knob {
        name: "teacher-size",
        stage: PointStage::Color,
        values: |around| {
            around.of_color(|color| {
                let size = color.teacher_size.map(|size| size as usize);
                size.map_or(Vec::new(), |size| scaled(size, &[0.5, 1.5]))
            })
        },
        turn: Turn::Option("--teacher-size"),
        time: |_, _| 1.0,
        conflicts: &[],
    },
    Knob {
        name: "correct-views",
        stage: PointStage::Color,
        values: |around| {
            around.of_color(|color| owned(&[if color.corrects_views { "off" } else { "on" }]))
        },
        turn: Turn::Option("--correct-views"),
        time: |_, _| 1.0,
        conflicts: &["solver", "until", "scales"],
    },
];

/// Knobs of the arithmetic of luma.
const NUMERIC_KNOBS: &[Knob] = &[
    Knob {
        name: "alpha-min",
        stage: PointStage::Luma,
        values: |_| owned(&["0.008", "0.016"]),
        turn: Turn::Luma(|settings, value| numeric(settings, "alpha-min", value)),
        time: |_, _| 0.9,
        conflicts: &[],
    },
    Knob {
        name: "transmittance-min",
        stage: PointStage::Luma,
        values: |_| owned(&["0.001", "0.01"]),
        turn: Turn::Luma(|settings, value| numeric(settings, "transmittance-min", value)),
        time: |_, _| 0.95,
        conflicts: &[],
    },
    Knob {
        name: "depth-bits",
        stage: PointStage::Luma,
        values: |_| owned(&["24", "16"]),
        turn: Turn::Luma(|settings, value| numeric(settings, "depth-bits", value)),
        time: |_, _| 0.95,
        conflicts: &[],
    },
    Knob {
        name: "storage",
        stage: PointStage::Luma,
        values: |_| owned(&["half"]),
        turn: Turn::Luma(|settings, value| numeric(settings, "storage", value)),
        time: |_, _| 1.0,
        conflicts: &[],
    },
    Knob {
        name: "ssim-window",
        stage: PointStage::Luma,
        values: |_| owned(&["7"]),
        turn: Turn::Luma(|settings, value| numeric(settings, "ssim-window", value)),
        time: |_, _| 0.95,
        conflicts: &[],
    },
    Knob {
        name: "adam",
        stage: PointStage::Luma,
        values: |_| owned(&["lazy"]),
        turn: Turn::Luma(|settings, value| numeric(settings, "adam", value)),
        time: |_, _| 0.95,
        conflicts: &[],
    },
];

/// Less than this `fit` refuses.
const LEAST_SIDE: u32 = 16;

/// The knob that the others of stage 1 are compared with: time buys quality with it on
/// any scene.
pub(super) const BASELINE_OF_LUMA: &str = "iterations";

/// The knob that turns many at once, and is not turned with others.
pub(super) const PRESET: &str = "preset";

/// The same as [`BASELINE_OF_LUMA`] of stage 2.
pub(super) const BASELINE_OF_COLOR: &str = "rounds";

/// Every knob.
fn knobs() -> impl Iterator<Item = &'static Knob> {
    KNOBS.iter().chain(NUMERIC_KNOBS)
}

/// The names of all knobs.
pub fn knob_names() -> impl Iterator<Item = &'static str> {
    knobs().map(|knob| knob.name)
}

/// All values to try of the knobs that `wanted` names, or of all where it names none.
pub(super) fn values(around: &Around, wanted: &[String]) -> Vec<Value> {
    let chosen = knobs().filter(|knob| wanted.is_empty() || wanted.iter().any(|w| w == knob.name));
    chosen
        .flat_map(|knob| {
            let values = (knob.values)(around).into_iter();
            values.map(|value| Value {
                stage: knob.stage,
                time: (knob.time)(around, &value),
                conflicts: knob.conflicts,
                knob: knob.name,
                value,
            })
        })
        .collect()
}

/// The knobs that settings turn, each with its value, in the order of the table: how many
/// iterations there are comes before what depends on it.
fn turned(settings: &[Setting]) -> impl Iterator<Item = (&'static Knob, &str)> {
    knobs().filter_map(|knob| {
        let setting = settings.iter().find(|setting| setting.knob == knob.name)?;
        Some((knob, setting.value.as_str()))
    })
}

/// The options that settings stand for, each once.
pub(super) fn options(settings: &[Setting]) -> Vec<Given> {
    let given = turned(settings).flat_map(|(knob, value)| match &knob.turn {
        Turn::Luma(_) => Vec::new(),
        Turn::Option(option) => vec![(*option, Some(value.to_owned()))],
        Turn::Options(of) => of(value),
    });
    let mut seen = HashSet::new();
    given.filter(|option| seen.insert(option.clone())).collect()
}

/// Changes the settings of luma as settings of knobs say.
pub(super) fn turn(luma: &mut LumaSettings, settings: &[Setting]) {
    for (knob, value) in turned(settings) {
        if let Turn::Luma(turn) = &knob.turn {
            turn(luma, value);
        }
    }
}

/// The preset that is a setting, if one is.
pub(super) fn preset(settings: &[Setting]) -> Option<Preset> {
    let (_, value) = turned(settings).find(|(knob, _)| knob.name == PRESET)?;
    Preset::ALL
        .into_iter()
        .find(|preset| preset.name() == value)
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

fn owned(values: &[&str]) -> Vec<String> {
    values.iter().map(|&value| value.to_owned()).collect()
}

fn others(values: &[&str], base: &str) -> Vec<String> {
    owned(values)
        .into_iter()
        .filter(|value| value != base)
        .collect()
}

/// Changes one of the numerics; the values of this table are such.
fn numeric(settings: &mut LumaSettings, key: &str, value: &str) {
    let changed = settings.numerics.with(&format!("{key}={value}"));
    settings.numerics = changed.unwrap_or(settings.numerics);
}

/// The values of this table are numbers wherever one is needed.
fn number(value: &str) -> f64 {
    value.parse().unwrap_or(0.0)
}

#[cfg(test)]
#[path = "knobs_tests.rs"]
mod tests;
