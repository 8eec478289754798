//! What a sweep found: `tradeoff.json`, `tradeoff.csv` and `tradeoff.html`.
//! docs/tradeoff.md describes every key and column.

mod csv;
mod front;
mod page;
mod plots;
mod shell;
mod tables;

pub use csv::csv;
pub use front::front;
pub use page::{Pictures, page};
pub use shell::shell_line;
pub use tables::front_table;

use serde::{Deserialize, Serialize};

use crate::luma::LumaSettings;

/// Version of the file's layout; raised when a key changes its meaning.
pub const TRADEOFF_VERSION: u32 = 2;

/// `tradeoff.json`: a sweep, finished or not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tradeoff {
    /// [`TRADEOFF_VERSION`].
    pub version: u32,
    /// Version of the program.
    pub program: String,
    /// What is swept.
    pub subject: Subject,
    /// What it ran on, once the first point has.
    pub device: Option<String>,
    /// Wall seconds that the points may take together.
    pub budget: f64,
    /// Every point that ran, in the order in which they did.
    pub points: Vec<Point>,
}

/// What is swept; a folder holds points of one subject only.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Subject {
    /// The COLMAP folder, absolute.
    pub scene: String,
    /// The preset of the base.
    pub preset: String,
    /// The teacher's file or folder, absolute.
    pub teacher: Option<String>,
    /// The settings of luma of the base.
    pub luma: LumaSettings,
    /// Options that every `fit` is given besides.
    pub options: Vec<String>,
}

/// One choice of knobs, and what came of it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Name of its run folder under `points/`.
    pub name: String,
    /// What it says something about.
    pub stage: PointStage,
    /// Why it was asked for.
    pub phase: Phase,
    /// What differs from the base; empty for the base itself.
    pub settings: Vec<Setting>,
    /// The program's arguments, one list for each time it was called.
    pub commands: Vec<Vec<String>>,
    /// Wall seconds of all these calls, measuring and drawing among them.
    pub took: f64,
    /// Why there is no outcome.
    pub failed: Option<String>,
    /// What was measured.
    pub outcome: Option<Outcome>,
}

/// What a point says something about.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum PointStage {
    /// Geometry and luma.
    Luma,
    /// Color, on the base's luma.
    Color,
}

impl PointStage {
    /// As in the files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Luma => "luma",
            Self::Color => "color",
        }
    }
}

/// Why a point was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Phase {
    /// Everything as the preset has it.
    Base,
    /// One knob turned.
    One,
    /// A combination that may be on the front.
    Front,
}

impl Phase {
    /// As in the files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Base => "base",
            Self::One => "one",
            Self::Front => "front",
        }
    }
}

/// A knob and where it stands.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Setting {
    /// Name of the setting, as for `--knobs`.
    pub knob: String,
    /// Its value.
    pub value: String,
}

/// What a point's reports say. Means are over the held-out views.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Iterations of stage 1.
    pub iterations: usize,
    /// Number of Gaussians.
    pub splats: usize,
    /// Wall seconds.
    pub seconds: Seconds,
    /// PSNR in dB of the gray pictures as viewers show them.
    pub psnr: Option<f64>,
    /// The same after each photo's own gain and offset.
    pub corrected_psnr: Option<f64>,
    /// Structural similarity of the gray pictures.
    pub ssim: Option<f64>,
    /// Mean ΔE00 of the colored pictures to the photos, where these have colors.
    pub delta_e: Option<f64>,
    /// Root mean square difference of a and b, in CIELAB units, between photographed
    /// views of the same places.
    pub consistency: Option<f64>,
    /// Colorfulness (Hasler and Süsstrunk 2003).
    pub colorfulness: Option<f64>,
    /// Colorfulness of the teacher's pictures.
    pub teacher_colorfulness: Option<f64>,
    /// Largest resident memory of a process in bytes, where the system tells.
    pub peak_host_memory: Option<u64>,
    /// Largest memory of the device's buffers in bytes, where the backend tells.
    pub peak_device_memory: Option<u64>,
}

/// Wall seconds by stage; those of stage 2 are 0 where there was none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Seconds {
    /// Of all stages.
    pub total: f64,
    /// Reading poses and photos.
    pub load: f64,
    /// Training luma.
    pub train: f64,
    /// Measuring luma.
    pub measure: f64,
    /// Asking the teacher: of the point that asked, where this one took its answers.
    pub teacher: f64,
    /// Solving for the colors.
    pub distill: f64,
    /// Baking and measuring colors.
    pub bake: f64,
}

impl Seconds {
    /// With the total of the stages.
    pub fn summed(self) -> Self {
        let stages = [
            self.load,
            self.train,
            self.measure,
            self.teacher,
            self.distill,
            self.bake,
        ];
        Self {
            total: stages.iter().sum(),
            ..self
        }
    }
}

/// A figure of merit against which seconds are weighed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// [`Outcome::psnr`].
    Psnr,
    /// [`Outcome::ssim`].
    Ssim,
    /// [`Outcome::delta_e`].
    DeltaE,
    /// [`Outcome::consistency`].
    Consistency,
    /// [`Outcome::colorfulness`].
    Colorfulness,
}

impl Measure {
    /// What is drawn of a stage, the one that decides first.
    pub fn of(stage: PointStage) -> &'static [Self] {
        match stage {
            PointStage::Luma => &[Self::Psnr, Self::Ssim],
            PointStage::Color => &[Self::DeltaE, Self::Consistency, Self::Colorfulness],
        }
    }

    /// Name on the command line and in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Psnr => "PSNR",
            Self::Ssim => "SSIM",
            Self::DeltaE => "ΔE00 to the photos",
            Self::Consistency => "inconsistency of views",
            Self::Colorfulness => "colorfulness",
        }
    }

    /// Its unit; empty where it has none or the name says it.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Psnr => "dB",
            Self::Consistency => "a/b",
            Self::Ssim | Self::DeltaE | Self::Colorfulness => "",
        }
    }

    /// Name and unit, for axes and columns.
    pub fn title(self) -> String {
        match self.unit() {
            "" => self.name().to_owned(),
            unit => format!("{}, {unit}", self.name()),
        }
    }

    /// A value in words.
    pub fn in_words(self, value: f64) -> String {
        let digits = self.digits();
        let words = format!("{} {value:.digits$} {}", self.name(), self.unit());
        words.trim_end().to_owned()
    }

    /// The figure of an outcome.
    pub fn value(self, outcome: &Outcome) -> Option<f64> {
        match self {
            Self::Psnr => outcome.psnr,
            Self::Ssim => outcome.ssim,
            Self::DeltaE => outcome.delta_e,
            Self::Consistency => outcome.consistency,
            Self::Colorfulness => outcome.colorfulness,
        }
    }

    /// 1 where more is better, −1 where less is; `None` where neither is: colors may be
    /// too strong as well as too weak.
    pub fn sign(self) -> Option<f64> {
        match self {
            Self::Psnr | Self::Ssim => Some(1.0),
            Self::DeltaE | Self::Consistency => Some(-1.0),
            Self::Colorfulness => None,
        }
    }

    /// Digits worth printing.
    pub fn digits(self) -> usize {
        match self {
            Self::Ssim => 4,
            Self::Colorfulness => 1,
            Self::Psnr | Self::DeltaE | Self::Consistency => 2,
        }
    }
}

impl Point {
    /// Its settings in words, `base` without any.
    pub fn label(&self) -> String {
        let settings: Vec<String> = (self.settings.iter())
            .map(|setting| format!("{} {}", setting.knob, setting.value))
            .collect();
        match settings.is_empty() {
            true => "base".to_owned(),
            false => settings.join(", "),
        }
    }

    /// Its figure of merit, larger where it is better.
    pub fn merit(&self, measure: Measure) -> Option<f64> {
        Some(measure.sign()? * measure.value(self.outcome.as_ref()?)?)
    }

    /// Seconds of all its stages, where it has an outcome.
    pub fn seconds(&self) -> Option<f64> {
        Some(self.outcome.as_ref()?.seconds.total)
    }
}

impl Tradeoff {
    /// The file as indented JSON.
    pub fn to_json(&self) -> String {
        // Plain structs with string keys: serializing them cannot fail.
        serde_json::to_string_pretty(self).unwrap_or_default()
    }

    /// Wall seconds that the points took.
    pub fn spent(&self) -> f64 {
        self.points.iter().map(|point| point.took).sum()
    }

    /// The points of a stage.
    pub fn of(&self, stage: PointStage) -> impl Iterator<Item = &Point> {
        self.points.iter().filter(move |point| point.stage == stage)
    }

    /// The base of a stage, where it has an outcome.
    pub fn base(&self, stage: PointStage) -> Option<&Point> {
        self.of(stage)
            .find(|point| point.phase == Phase::Base && point.outcome.is_some())
    }

    /// The points of a stage on the front of seconds against a measure, fastest first.
    pub fn front(&self, stage: PointStage, measure: Measure) -> Vec<&Point> {
        let (points, places): (Vec<&Point>, Vec<[f64; 2]>) = self
            .of(stage)
            .filter_map(|point| Some((point, [point.seconds()?, point.merit(measure)?])))
            .unzip();
        (front(&places).into_iter())
            .map(|index| points[index])
            .collect()
    }

    /// What decides in a stage: its first measure that the points have.
    pub fn decisive(&self, stage: PointStage) -> Option<Measure> {
        let has = |measure: &&Measure| self.of(stage).any(|point| point.merit(**measure).is_some());
        Measure::of(stage).iter().find(has).copied()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    pub fn sweep(points: Vec<Point>) -> Tradeoff {
        Tradeoff {
            version: TRADEOFF_VERSION,
            program: "0.1.0".to_owned(),
            subject: Subject {
                scene: "/photos/<garden>".to_owned(),
                preset: "draft".to_owned(),
                teacher: None,
                luma: LumaSettings::default(),
                options: Vec::new(),
            },
            device: None,
            budget: 60.0,
            points,
        }
    }

    pub fn failed(name: &str, reason: &str) -> Point {
        Point {
            name: name.to_owned(),
            stage: PointStage::Luma,
            phase: Phase::One,
            settings: Vec::new(),
            commands: Vec::new(),
            took: 1.0,
            failed: Some(reason.to_owned()),
            outcome: None,
        }
    }

    pub fn luma(name: &str, seconds: f64, psnr: f64) -> Point {
        let (knob, value) = name.split_once('-').unwrap_or((name, ""));
        let setting = Setting {
            knob: knob.to_owned(),
            value: value.to_owned(),
        };
        let seconds = Seconds {
            train: seconds,
            ..Seconds::default()
        };
        Point {
            phase: if name == "base" {
                Phase::Base
            } else {
                Phase::One
            },
            settings: if name == "base" {
                Vec::new()
            } else {
                vec![setting]
            },
            took: seconds.train,
            failed: None,
            outcome: Some(Outcome {
                iterations: 700,
                splats: 1000,
                seconds: seconds.summed(),
                psnr: Some(psnr),
                corrected_psnr: None,
                ssim: Some(psnr / 30.0),
                delta_e: None,
                consistency: None,
                colorfulness: None,
                teacher_colorfulness: None,
                peak_host_memory: None,
                peak_device_memory: None,
            }),
            ..failed(name, "")
        }
    }

    #[test]
    fn the_front_is_of_one_stage_and_leaves_failures_out() {
        let mut color = luma("color", 1.0, 99.0);
        color.stage = PointStage::Color;
        let sweep = sweep(vec![
            luma("base", 10.0, 24.0),
            color,
            failed("sh-3", "no memory"),
            luma("side-200", 5.0, 22.0),
            luma("coarse-0.5", 12.0, 23.0),
        ]);
        let front = sweep.front(PointStage::Luma, Measure::Psnr);
        let names: Vec<&str> = front.iter().map(|point| &point.name[..]).collect();
        assert_eq!(names, ["side-200", "base"]);
        assert_eq!(sweep.decisive(PointStage::Luma), Some(Measure::Psnr));
        assert_eq!(sweep.decisive(PointStage::Color), None);
        assert_eq!(sweep.spent(), 29.0);
    }

    #[test]
    fn the_file_is_read_as_it_was_written() {
        let sweep = sweep(vec![luma("base", 10.0, 24.0), failed("sh-3", "no memory")]);
        let read: Tradeoff = serde_json::from_str(&sweep.to_json()).expect("JSON");
        assert_eq!(read, sweep);
    }
}
