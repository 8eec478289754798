//! A sweep as `tradeoff.json` holds it, and what its points are judged by.
//! docs/schemas/tradeoff.schema.json describes every key.

use serde::{Deserialize, Serialize};

/// Version of the file's layout; raised when a key changes its meaning.
pub const TRADEOFF_VERSION: u32 = 4;

/// Budget in times of the bases, where none is given.
pub(super) const BASES: f64 = 4.0;

/// `tradeoff.json`: a sweep, finished or not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Tradeoff {
    /// Layout of the file; raised when a key changes its meaning.
    ///
    /// [`TRADEOFF_VERSION`].
    pub version: u32,
    /// Version of the program.
    pub program: String,
    /// Subject of the sweep.
    pub subject: Subject,
    /// Adapter and driver, once the first point has run.
    pub device: Option<String>,
    /// Wall seconds that the points may take together; `None`: four times what the bases took.
    ///
    /// [`BASES`].
    pub budget: Option<f64>,
    /// Every point, in the order in which they were found.
    pub points: Vec<SweepPoint>,
}

/// Subject of a sweep; a folder holds points of one subject only.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Subject {
    /// The COLMAP folder, absolute.
    pub scene: String,
    /// The teacher's file or folder, absolute.
    pub teacher: Option<String>,
    /// Options of every `fit`.
    pub options: Vec<String>,
}

/// One choice of settings, and its outcome.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct SweepPoint {
    /// Name of its run folder under `points/`, or of that and a place along its curve.
    pub name: String,
    /// Stage that it measures.
    pub stage: PointStage,
    /// Settings that differ from the base; none of the base itself, several on smaller photos.
    pub settings: Vec<Setting>,
    /// Iterations or rounds after which the run was looked at; `None` at its end.
    pub after: Option<usize>,
    /// Its picture, below the sweep's folder.
    pub picture: Option<String>,
    /// The program's arguments, one list for each time it was called; none along a curve.
    pub commands: Vec<Vec<String>>,
    /// Wall seconds of all these calls, measuring among them.
    pub took: f64,
    /// Reason of the failure, if it has no outcome.
    pub failed: Option<String>,
    /// Figures measured.
    pub outcome: Option<Outcome>,
}

/// Stage that a point measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
#[serde(rename_all = "lowercase")]
pub enum PointStage {
    /// Geometry and luma.
    Luma,
    /// Color, on the base's luma.
    Color,
}

impl PointStage {
    /// Both, in the order in which they run.
    pub const ALL: [Self; 2] = [Self::Luma, Self::Color];
}

/// A knob and where it stands.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Setting {
    /// Name of the setting, as for `--knobs`.
    pub knob: String,
    /// Value of it.
    pub value: String,
}

/// Figures from a point's reports. Means are over the held-out views.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct Outcome {
    /// Iterations of stage 1.
    pub iterations: usize,
    /// Number of Gaussians.
    pub splats: usize,
    /// Wall seconds of its stage.
    pub seconds: f64,
    /// Those of asking the teacher: of the point that asked, where this one took its answers.
    pub teacher_seconds: f64,
    /// PSNR in dB of the gray pictures as viewers show them.
    pub psnr: Option<f64>,
    /// Structural similarity of the gray pictures.
    pub ssim: Option<f64>,
    /// Loss of the color solver in CIELAB units, where it is the base's but for its rounds.
    pub loss: Option<f64>,
    /// Mean ΔE00 of the colored pictures to the photos, where these have colors.
    pub delta_e: Option<f64>,
    /// Root mean square difference of a and b, in CIELAB units, between photographed
    /// views of the same places.
    pub consistency: Option<f64>,
    /// Colorfulness (Hasler and Süsstrunk 2003).
    pub colorfulness: Option<f64>,
    /// Largest resident memory of a process in bytes, where the system tells.
    pub peak_host_memory: Option<u64>,
    /// Largest memory of the device's buffers in bytes, where the backend tells.
    pub peak_device_memory: Option<u64>,
}

/// A figure that seconds are weighed against.
pub struct Measure {
    /// The stage whose points have it.
    pub stage: PointStage,
    /// Name and, behind a comma, unit, for axes and columns.
    pub title: &'static str,
    /// Digits worth printing.
    pub digits: usize,
    /// 1 where more is better, −1 where less is, 0 where neither is: colors may be too strong
    /// as well as too weak.
    pub sign: f64,
    /// The figure of an outcome.
    pub value: fn(&Outcome) -> Option<f64>,
}

/// The measures of both stages, the one that decides first.
pub(super) const MEASURES: [Measure; 6] = [
    measure(PointStage::Luma, "PSNR, dB", 2, 1.0, |o| o.psnr),
    measure(PointStage::Luma, "SSIM", 4, 1.0, |o| o.ssim),
    measure(PointStage::Color, "ΔE00 to the photos", 2, -1.0, |o| {
        o.delta_e
    }),
    measure(
        PointStage::Color,
        "inconsistency of views, a/b",
        2,
        -1.0,
        |o| o.consistency,
    ),
    measure(PointStage::Color, "colorfulness", 1, 0.0, |o| {
        o.colorfulness
    }),
    measure(PointStage::Color, "loss", 3, -1.0, |o| o.loss),
];

const fn measure(
    stage: PointStage,
    title: &'static str,
    digits: usize,
    sign: f64,
    value: fn(&Outcome) -> Option<f64>,
) -> Measure {
    Measure {
        stage,
        title,
        digits,
        sign,
        value,
    }
}

impl Measure {
    /// An outcome's figure in words; empty without.
    pub fn in_words(&self, outcome: &Outcome) -> String {
        let figure = self.figure(outcome);
        match self.title.split_once(", ") {
            _ if figure.is_empty() => figure,
            Some((name, unit)) => format!(", {name} {figure} {unit}"),
            None => format!(", {} {figure}", self.title),
        }
    }

    /// How much better an outcome is than another; empty without figures or where neither more
    /// nor less is better.
    pub fn gain(&self, outcome: &Outcome, other: Option<&Outcome>) -> String {
        let [found, before] = [Some(outcome), other].map(|of| of.and_then(self.value));
        let gain = found.zip(before).filter(|_| self.sign != 0.0);
        let digits = self.digits;
        gain.map_or(String::new(), |(found, before)| {
            // No minus before nothing.
            format!("{:+.digits$}", self.sign * (found - before) + 0.0)
        })
    }

    /// Unit of a difference.
    pub fn unit(&self) -> &'static str {
        match self.title.split_once(", ") {
            Some((_, unit)) => unit,
            None => self.title,
        }
    }

    /// An outcome's figure with its digits; empty without.
    pub fn figure(&self, outcome: &Outcome) -> String {
        let digits = self.digits;
        (self.value)(outcome).map_or(String::new(), |value| format!("{value:.digits$}"))
    }
}

impl SweepPoint {
    /// Returns true for a run as the preset has it.
    pub fn is_base(&self) -> bool {
        self.settings.is_empty() && self.after.is_none()
    }

    /// Its settings in words, `base` without any, and where along its run it is.
    pub fn label(&self) -> String {
        let settings = self.settings.iter();
        let mut words: Vec<String> = settings
            .map(|setting| format!("{} {}", setting.knob, setting.value))
            .collect();
        words.extend(self.settings.is_empty().then(|| "base".to_owned()));
        let steps = match self.stage {
            PointStage::Luma => "iterations",
            PointStage::Color => "rounds",
        };
        words.extend(self.after.map(|after| format!("after {after} {steps}")));
        words.join(", ")
    }

    /// Seconds and, larger where it is better, figure of merit.
    pub fn place(&self, measure: &Measure) -> Option<[f64; 2]> {
        let outcome = self.outcome.as_ref()?;
        let place = [outcome.seconds, measure.sign * (measure.value)(outcome)?];
        (measure.sign != 0.0 && place.iter().all(|figure| figure.is_finite())).then_some(place)
    }
}

impl Tradeoff {
    /// The file as indented JSON.
    pub fn to_json(&self) -> String {
        // Plain structs with string keys: serializing them cannot fail.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// Wall seconds that the points may take together.
    pub fn limit(&self) -> f64 {
        let bases = self.points.iter().filter(|point| point.is_base());
        let took: f64 = bases.map(|base| base.took).sum();
        self.budget.unwrap_or(BASES * took)
    }

    /// Wall seconds that the points took.
    pub fn spent(&self) -> f64 {
        self.points.iter().map(|point| point.took).sum()
    }

    pub fn find(&self, name: &str) -> Option<&SweepPoint> {
        self.points.iter().find(|point| point.name == name)
    }

    pub fn of(&self, stage: PointStage) -> impl Iterator<Item = &SweepPoint> {
        self.points.iter().filter(move |point| point.stage == stage)
    }

    /// The base of a stage, where it ran.
    pub fn base(&self, stage: PointStage) -> Option<&SweepPoint> {
        self.of(stage).find(|point| point.is_base())
    }

    /// The first on smaller photos, which others there are compared with.
    pub fn small(&self) -> Option<&SweepPoint> {
        self.points.iter().find(|point| point.settings.len() > 1)
    }

    /// The point that another is compared with.
    pub fn reference(&self, point: &SweepPoint) -> Option<&SweepPoint> {
        let among = |small: &&SweepPoint| point.settings.len() > 1 && small.name != point.name;
        let small = self.small().filter(among);
        small.or_else(|| self.base(point.stage))
    }

    /// The measures that some point of a stage has.
    pub fn measures(&self, stage: PointStage) -> impl Iterator<Item = &'static Measure> {
        let of_stage = MEASURES.iter().filter(move |m| m.stage == stage);
        of_stage.filter(move |measure| {
            let mut outcomes = self.of(stage).filter_map(|point| point.outcome.as_ref());
            outcomes.any(|outcome| (measure.value)(outcome).is_some())
        })
    }

    /// The points of a stage that no other beats in seconds or a measure and equals in the
    /// other, fastest first; of equal ones the first.
    pub fn front(&self, stage: PointStage, measure: &Measure) -> Vec<&SweepPoint> {
        let mut placed: Vec<(&SweepPoint, [f64; 2])> = (self.of(stage))
            .filter_map(|point| Some((point, point.place(measure)?)))
            .collect();
        placed.sort_by(|(_, a), (_, b)| a[0].total_cmp(&b[0]).then(b[1].total_cmp(&a[1])));
        let mut best = f64::NEG_INFINITY;
        placed.retain(|(_, [_, merit])| {
            let better = *merit > best;
            best = best.max(*merit);
            better
        });
        placed.into_iter().map(|(point, _)| point).collect()
    }

    /// The front of what decides in a stage: its first measure that its points have.
    pub fn best(&self, stage: PointStage) -> Vec<&SweepPoint> {
        let first = self.measures(stage).next();
        first.map_or(Vec::new(), |measure| self.front(stage, measure))
    }
}

#[cfg(test)]
mod tests {
    use super::super::fixtures::{failed, luma, sweep};
    use super::*;

    /// The definition, applied to every pair; another stage, failures and what is not finite do
    /// not count.
    #[test]
    fn the_front_is_what_no_other_beats() {
        let mut random = fastrand::Rng::with_seed(3);
        for _ in 0..200 {
            let places: Vec<[f64; 2]> = (0..random.usize(1..12))
                .map(|_| [random.u8(0..6), random.u8(0..6)].map(f64::from))
                .collect();
            let mut points: Vec<SweepPoint> =
                places.iter().map(|&[x, y]| luma("side-1", x, y)).collect();
            let color = SweepPoint {
                stage: PointStage::Color,
                ..luma("color", -1.0, 99.0)
            };
            points.extend([
                color,
                failed("sh-3", ""),
                luma("side-2", -1.0, f64::INFINITY),
            ]);
            let beats = |a: [f64; 2], b: [f64; 2]| a != b && a[0] <= b[0] && a[1] >= b[1];
            let mut expected: Vec<[f64; 2]> = (places.iter().copied())
                .filter(|&place| !places.iter().any(|&other| beats(other, place)))
                .collect();
            expected.sort_by(|a, b| a[0].total_cmp(&b[0]));
            expected.dedup();
            let sweep = sweep(points);
            let found: Vec<[f64; 2]> = (sweep.best(PointStage::Luma).iter())
                .filter_map(|point| point.place(&MEASURES[0]))
                .collect();
            assert_eq!(found, expected, "{places:?}");
            assert!(sweep.best(PointStage::Color).is_empty());
        }
    }
}
