//! Stage 2 in `report.json`.

use serde::{Deserialize, Deserializer, Serialize};

use super::{EffectReport, KernelReport};
use crate::{
    chroma::{
        ChromaSettings,
        teacher::{TeacherInfo, Upsample},
    },
    measure::DeltaE,
};

/// Stage 2.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ChromaReport {
    /// All teachers as on the command line.
    pub teachers: Vec<TeacherReport>,
    /// Factor on the teachers' a and b.
    pub strength: f32,
    /// Method of upsampling answers smaller than the photo.
    pub upsample: Upsample,
    /// Profile of the networks, where it was given.
    #[serde(default)]
    pub teacher_profile: Option<String>,
    /// Input size of the networks, where it was given, in pixels.
    #[serde(default)]
    pub teacher_size: Option<u32>,
    /// Class that the networks were asked with, where it was given.
    #[serde(default)]
    pub teacher_class: Option<u16>,
    /// Views with painted hints.
    pub hints: usize,
    /// The folder of hints, absolute.
    ///
    /// `None` without hints, and where it is no UTF-8.
    #[serde(default)]
    pub hint_folder: Option<String>,
    /// Share of the Gaussians that hints claim by half or more.
    ///
    /// `None` where none grew.
    #[serde(default)]
    pub claimed: Option<f64>,
    /// Held-out views painted by hand, not measured.
    #[serde(default)]
    pub painted_held_out: Vec<String>,
    /// Views that colors were learned from.
    ///
    /// A teacher colored them, or they have hints.
    pub colored_views: usize,
    /// Settings of the chroma solver.
    pub settings: ChromaSettings,
    /// Share of the Gaussians that no colored view shows well.
    ///
    /// Surroundings do not count. `None` of Adam.
    pub unseen: Option<f64>,
    /// Factor on a and b to match the teachers, 1 to 1.25.
    pub saturation: f64,
    /// Iterations of Adam, or rounds of least squares.
    pub iterations: usize,
    /// The last of them, counted from the start of stage 1.
    pub until: usize,
    /// Drawings of a view with adjoints.
    ///
    /// Those of coarser scales count by their share of the pixels.
    pub passes: f64,
    /// Mean color change in the last round, in CIELAB units.
    ///
    /// `None` of Adam, and where that round was undone.
    pub moved: Option<f64>,
    /// `teacher-correction` and `chroma-degree`.
    pub effects: Vec<EffectReport>,
    /// Warnings of `colorize`.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// Loss at full size, in CIELAB units.
    ///
    /// Mean of Adam's last iterations, or before the last round of least squares. JSON has `null`
    /// for what is not finite.
    #[serde(deserialize_with = "number_or_nan")]
    #[cfg_attr(test, schemars(with = "Option<f64>"))]
    pub loss: f64,
    /// Wall time.
    pub seconds: ChromaSeconds,
    /// Peak of the process's resident memory, in bytes.
    ///
    /// `None` where the system does not tell.
    pub peak_host_memory: Option<u64>,
    /// Peak of the device's buffers, in bytes.
    ///
    /// `None` where the backend does not tell.
    pub peak_device_memory: Option<u64>,
    /// Upper estimate for solving and baking, in bytes.
    pub estimated_device_memory: u64,
    /// Views whose tile lists and targets stayed on the device.
    pub pinned_views: usize,
    /// Gaussians on the device at a time, where they waited on the host.
    pub splats_at_a_time: Option<usize>,
    /// `color.ply` against native blending, mean over the views.
    pub bake: ColorError,
    /// Views measured: `test` but for painted ones, or else `train`.
    pub measured_on: String,
    /// Pictures of `color.ply`, mean over these views.
    pub pictures: ColorQuality,
    /// Each of these views.
    pub views: Vec<ColorView>,
    /// Device time of each kernel, with `--timings`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timings: Option<Vec<KernelReport>>,
}

/// A teacher.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct TeacherReport {
    /// Name, kind and identity.
    #[serde(flatten)]
    pub info: TeacherInfo,
    /// File, folder or known name.
    ///
    /// Files and folders are absolute; `frames` asks it again. `None` where that is no UTF-8.
    #[serde(default)]
    pub path: Option<String>,
    /// Weight among the teachers.
    pub weight: f32,
}

/// Wall seconds of stage 2.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ChromaSeconds {
    /// Asking the teacher, in seconds.
    pub teacher: f64,
    /// Solving for a and b, in seconds.
    pub distill: f64,
    /// Baking to RGB, in seconds.
    pub bake: f64,
    /// Measuring and drawing the contact sheet, in seconds.
    pub measure: f64,
    /// From the start until files are written, in seconds.
    ///
    /// 0 in reports of former versions.
    #[serde(default)]
    pub all: f64,
}

/// A color difference.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ColorError {
    /// CIEDE2000, mean over the pixels, in ΔE00.
    pub mean: f64,
    /// 95th percentile of the pixels, in ΔE00.
    ///
    /// Over several views, the mean of theirs.
    pub percentile_95: f64,
}

impl From<DeltaE> for ColorError {
    fn from(
        DeltaE {
            mean,
            percentile_95,
        }: DeltaE,
    ) -> Self {
        Self {
            mean,
            percentile_95,
        }
    }
}

/// Quality of colored pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ColorQuality {
    /// Difference to the photos; `None` if gray.
    pub delta_e: Option<ColorError>,
    /// Hasler and Süsstrunk's: 0 gray, 15 slight, 33 average, 59 high.
    ///
    /// On RGB from 0 to 255.
    pub colorfulness: f64,
    /// Colorfulness of the teacher's pictures.
    ///
    /// `None` where it has none.
    pub teacher_colorfulness: Option<f64>,
}

/// One colored picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub struct ColorView {
    /// The photo's name, or a face's.
    pub name: String,
    /// Its quality.
    #[serde(flatten)]
    pub quality: ColorQuality,
}

/// JSON has no NaN and is given `null`; a run that diverged can still be read.
pub(super) fn number_or_nan<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    Ok(Option::deserialize(deserializer)?.unwrap_or(f64::NAN))
}
